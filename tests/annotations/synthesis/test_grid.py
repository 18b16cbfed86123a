import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.synthesis.grid import FULL_SHAPE, REALTIME_SHAPE, WORKSPACE_UM, Grid
from annotations.volumes.spacing import OMES_REALTIME_SPACING_UM, OMES_SPACING_UM


def test_full_shape_has_the_scanners_own_spacing() -> None:
    assert Grid.over_workspace(FULL_SHAPE).spacing_um == OMES_SPACING_UM


def test_realtime_shape_has_the_spacing_that_is_offered_for_it() -> None:
    assert Grid.over_workspace(REALTIME_SHAPE).spacing_um == OMES_REALTIME_SPACING_UM


@given(st.tuples(*[st.integers(1, 3000)] * 3).filter(lambda shape: shape != REALTIME_SHAPE))
def test_any_shape_covers_the_same_workspace(shape: tuple[int, int, int]) -> None:
    grid = Grid.over_workspace(shape)

    np.testing.assert_allclose(np.multiply(grid.spacing_um, shape), WORKSPACE_UM, rtol=1e-5)


def test_axis_lists_voxel_centres_from_the_origin() -> None:
    grid = Grid((3, 4, 5), (10.0, 20.0, 30.0))

    assert grid.axis_um(1) == pytest.approx([0, 20, 40, 60])
    assert grid.extent_um == (20.0, 60.0, 120.0)
