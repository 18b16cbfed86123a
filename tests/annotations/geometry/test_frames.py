import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry.frames import extent_um, is_inside, nearest_voxel, um_to_voxel, vector, voxel_to_um

SPACING_UM = (15.9, 13.5, 9.4)
SHAPE = (1096, 1936, 1152)

spacings = st.tuples(*[st.floats(1e-3, 1e4)] * 3)
indices = st.tuples(*[st.integers(0, 5000)] * 3)
positions = st.tuples(*[st.floats(-1e6, 1e6)] * 3)


def test_the_centre_of_the_first_voxel_is_the_origin() -> None:
    assert vector(voxel_to_um((0, 0, 0), SPACING_UM)) == (0.0, 0.0, 0.0)


def test_axes_keep_their_order() -> None:
    assert vector(voxel_to_um((1, 2, 3), (10.0, 100.0, 1000.0))) == (10.0, 200.0, 3000.0)
    assert vector(um_to_voxel((10.0, 200.0, 3000.0), (10.0, 100.0, 1000.0))) == (1.0, 2.0, 3.0)


@given(index=indices, spacing_um=spacings)
def test_a_voxel_is_found_again_from_its_centre(
    index: tuple[int, int, int], spacing_um: tuple[float, float, float]
) -> None:
    position_um = voxel_to_um(index, spacing_um)
    assert nearest_voxel(position_um, spacing_um, (5001, 5001, 5001)) == index
    assert is_inside(position_um, (5001, 5001, 5001), spacing_um)


@given(position_um=positions, spacing_um=spacings)
def test_a_position_survives_the_way_through_voxels(
    position_um: tuple[float, float, float], spacing_um: tuple[float, float, float]
) -> None:
    there_and_back = voxel_to_um(um_to_voxel(position_um, spacing_um), spacing_um)
    np.testing.assert_allclose(there_and_back, position_um, rtol=1e-15, atol=1e-300)


def test_many_positions_are_converted_at_once() -> None:
    index = np.arange(24).reshape(2, 4, 3)
    found = voxel_to_um(index, SPACING_UM)
    assert found.shape == (2, 4, 3)
    np.testing.assert_array_equal(found[1, 2], np.array([18, 19, 20]) * SPACING_UM)


def test_the_last_voxel_ends_the_extent() -> None:
    assert extent_um(SHAPE, SPACING_UM) == pytest.approx((1095 * 15.9, 1935 * 13.5, 1151 * 9.4))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_outer_half_of_a_border_voxel_is_inside(axis: int) -> None:
    first, last = [0.0, 0.0, 0.0], list(extent_um(SHAPE, SPACING_UM))
    for fraction, inside in ((0.49, True), (0.51, False)):
        first[axis] = -fraction * SPACING_UM[axis]
        last[axis] = (SHAPE[axis] - 1 + fraction) * SPACING_UM[axis]
        assert is_inside(first, SHAPE, SPACING_UM) is inside
        assert is_inside(last, SHAPE, SPACING_UM) is inside


def test_outside_the_nearest_voxel_is_on_the_border() -> None:
    assert nearest_voxel((-1e5, 100.0, 1e9), SPACING_UM, SHAPE) == (0, 7, 1151)


def test_a_vector_is_three_plain_floats() -> None:
    found = vector(np.array([1, 2, 3], dtype=np.float32))
    assert found == (1.0, 2.0, 3.0)
    assert [type(value) for value in found] == [float, float, float]
    with pytest.raises(ValueError, match="unpack"):
        vector([1.0, 2.0])
