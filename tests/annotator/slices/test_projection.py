import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotator.slices.projection import Plane

SHAPE = (4, 6, 5)
SPACING_UM = (15.9, 13.5, 9.4)


@pytest.mark.parametrize(
    ("axis", "depth_axis", "horizontal", "vertical"),
    [
        (0, 2, 1, 2),
        (1, 2, 0, 2),
        (2, 2, 0, 1),
        (0, 0, 1, 2),
        (1, 0, 2, 0),
        (2, 0, 1, 0),
        (0, 1, 2, 1),
        (1, 1, 0, 2),
        (2, 1, 0, 1),
    ],
)
def test_depth_runs_downwards_where_it_lies_in_the_plane(
    axis: int, depth_axis: int, horizontal: int, vertical: int
) -> None:
    plane = Plane.across(axis, SHAPE, SPACING_UM, depth_axis)

    assert (plane.horizontal, plane.vertical) == (horizontal, vertical)
    if axis != depth_axis:
        assert plane.vertical == depth_axis


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("depth_axis", range(3))
def test_a_slice_is_turned_so_that_its_rows_run_along_the_vertical_axis(axis: int, depth_axis: int) -> None:
    volume = np.arange(np.prod(SHAPE)).reshape(SHAPE)
    plane = Plane.across(axis, SHAPE, SPACING_UM, depth_axis)

    drawn = plane.on_screen(volume.take(2, axis))

    assert drawn.shape == (SHAPE[plane.vertical], SHAPE[plane.horizontal])
    assert drawn.flags.c_contiguous
    index = [0, 0, 0]
    index[axis], index[plane.vertical], index[plane.horizontal] = 2, 3, 1
    assert drawn[3, 1] == volume[tuple(index)]


@given(
    axis=st.sampled_from([0, 1, 2]),
    depth_axis=st.sampled_from([0, 1, 2]),
    position_um=st.tuples(*[st.floats(-1e5, 1e5)] * 3),
)
def test_flattening_and_lifting_a_position_gives_it_back(
    axis: int, depth_axis: int, position_um: tuple[float, float, float]
) -> None:
    plane = Plane.across(axis, SHAPE, SPACING_UM, depth_axis)

    assert plane.lifted(plane.flat(position_um), position_um[axis]) == position_um


@pytest.mark.parametrize(
    ("x_um", "index"), [(-100.0, 0), (0.0, 0), (7.9, 0), (8.0, 1), (31.8, 2), (1000.0, 3)]
)
def test_the_plane_shown_is_the_nearest_one_that_exists(x_um: float, index: int) -> None:
    plane = Plane.across(0, SHAPE, SPACING_UM, 2)

    assert plane.index((x_um, 0.0, 0.0)) == index


def test_edges_lie_half_a_voxel_outside_the_outermost_centres() -> None:
    plane = Plane.across(0, SHAPE, SPACING_UM, 2)

    assert plane.low_um == (-6.75, -4.7)
    assert plane.high_um == (5.5 * 13.5, 4.5 * 9.4)
