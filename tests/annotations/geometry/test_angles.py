import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from annotations.geometry.angles import angle_deg, angles_deg, lengths, signed_angle_deg, unit_vectors
from annotations.geometry.frames import um_to_voxel
from annotations.geometry.rotations import about_axis, matrix

SPACING_UM = (15.9, 13.5, 9.4)

components = st.floats(-1.0, 1.0)
directions = (
    st.tuples(components, components, components)
    .filter(lambda values: math.hypot(*values) > 0.1)
    .map(lambda values: np.array(values) / math.hypot(*values))
)


@pytest.mark.parametrize("tangent", [1e-1, 1e-4, 1e-8, 1e-12, 1e-200])
def test_small_angles_keep_all_their_digits(tangent: float) -> None:
    # arccos of the cosine would return 0 for every tangent below 1e-8.
    expected = math.degrees(math.atan(tangent))
    assert angle_deg((1, 0, 0), (1, tangent, 0)) == pytest.approx(expected, rel=4e-16, abs=0)
    assert signed_angle_deg((1, 0, 0), (1, -tangent, 0), (0, 0, 1)) == pytest.approx(
        -expected, rel=4e-16, abs=0
    )


@pytest.mark.parametrize("tangent", [1e-4, 1e-6, 1e-8, 1e-10])
def test_angles_near_180_degrees_keep_all_their_digits(tangent: float) -> None:
    expected = 180 - math.degrees(math.atan(tangent))
    assert angle_deg((1, 0, 0), (-1, tangent, 0)) == pytest.approx(expected, rel=0, abs=6e-14)


@pytest.mark.parametrize(
    ("first", "second", "expected_deg"),
    [
        ((1, 0, 0), (1, 0, 0), 0.0),
        ((1, 2, 3), (-1, -2, -3), 180.0),
        ((1, 0, 0), (0, 1, 0), 90.0),
        ((1, 0, 0), (1, 1, 0), 45.0),
        ((1, 1, 0), (0, 1, 1), 60.0),
        ((1, 0, 0), (-1, 0, math.sqrt(3)), 120.0),
    ],
)
def test_known_angles(first: tuple[float, ...], second: tuple[float, ...], expected_deg: float) -> None:
    assert angle_deg(first, second) == pytest.approx(expected_deg, abs=3e-14)
    assert angle_deg(second, first) == pytest.approx(expected_deg, abs=3e-14)


@given(first=directions, second=directions, scale=st.sampled_from([1e-300, 1e-160, 1e-3, 1e9, 1e160, 1e300]))
def test_lengths_do_not_matter(first: np.ndarray, second: np.ndarray, scale: float) -> None:
    expected = angle_deg(first, second)
    assert 0 <= expected <= 180
    assert angle_deg(first * scale, second) == pytest.approx(expected, abs=1e-13)
    assert angle_deg(first, second * scale) == pytest.approx(expected, abs=1e-13)
    # About the normal of their own plane: about another axis the angle may be all rounding.
    normal = np.cross(first, second)
    assume(np.abs(normal).max() > 1e-3)
    normal = normal / np.abs(normal).max()
    assert signed_angle_deg(first * scale, second, normal * scale) == pytest.approx(expected, abs=1e-12)
    assert signed_angle_deg(second, first * scale, normal) == pytest.approx(-expected, abs=1e-12)


@given(turn_deg=st.floats(-179.9, 179.9))
def test_a_signed_angle_is_the_rotation_about_the_hinge(turn_deg: float) -> None:
    turn = math.radians(turn_deg)
    # Right-handed about +y: x turns towards −z.
    turned = (math.cos(turn), 0.0, -math.sin(turn))
    assert signed_angle_deg((1, 0, 0), turned, (0, 1, 0)) == pytest.approx(turn_deg, abs=1e-12)
    assert signed_angle_deg((1, 0, 0), turned, (0, -1, 0)) == pytest.approx(-turn_deg, abs=1e-12)
    assert angle_deg((1, 0, 0), turned) == pytest.approx(abs(turn_deg), abs=1e-12)


@given(first=directions, hinge=directions, turn_deg=st.floats(-179.0, 179.0))
def test_a_hinge_may_stand_at_any_angle_to_what_it_turns(
    first: np.ndarray, hinge: np.ndarray, turn_deg: float
) -> None:
    assume(10 < angle_deg(first, hinge) < 170)
    turned = matrix(about_axis(hinge, turn_deg)) @ first
    assert signed_angle_deg(first, turned, hinge) == pytest.approx(turn_deg, abs=1e-9)


@pytest.mark.parametrize("length", [1e-200, 0.1, 7.0, 1e200])
def test_the_length_of_the_hinge_axis_does_not_matter(length: float) -> None:
    hinge = (length, 2 * length, 2 * length)
    found = signed_angle_deg((2.0, 1.0, -2.0), (2.0, 2.0, 2.0), hinge)
    # The cross product is (6, −8, 2), of which (6 − 16 + 4) / 3 = −2 lies along the hinge.
    assert found == pytest.approx(math.degrees(math.atan2(-2.0, 2.0)))


def test_there_is_no_angle_to_a_vector_without_length() -> None:
    assert math.isnan(angle_deg((0, 0, 0), (1, 0, 0)))
    assert math.isnan(angle_deg((1, 0, 0), (0, 0, 0)))
    assert math.isnan(signed_angle_deg((0, 0, 0), (1, 0, 0), (0, 0, 1)))
    assert math.isnan(signed_angle_deg((1, 0, 0), (1, 0, 0), (0, 0, 0)))


def test_voxels_turn_a_direction_by_up_to_15_degrees() -> None:
    angles = np.radians(np.arange(0, 90, 0.1))
    turns = [
        angle_deg(direction_um, um_to_voxel(direction_um, SPACING_UM))
        for direction_um in np.stack([np.cos(angles), np.zeros_like(angles), np.sin(angles)], axis=1)
    ]
    # asin((15.9 − 9.4) / (15.9 + 9.4)), where the two axes pull in opposite directions.
    assert max(turns) == pytest.approx(math.degrees(math.asin(6.5 / 25.3)), abs=1e-4)
    assert 14.5 < max(turns) < 15


def test_voxels_change_the_angle_between_two_directions_by_up_to_30_degrees() -> None:
    steepest = math.atan(math.sqrt(9.4 / 15.9))
    upwards_um = np.array([math.cos(steepest), 0, math.sin(steepest)])
    downwards_um = upwards_um * (1, 1, -1)
    in_um = angle_deg(upwards_um, downwards_um)
    in_voxels = angle_deg(um_to_voxel(upwards_um, SPACING_UM), um_to_voxel(downwards_um, SPACING_UM))
    assert in_um == pytest.approx(math.degrees(2 * steepest))
    assert 29 < in_voxels - in_um < 30


def test_many_pairs_broadcast_and_what_is_missing_stays_missing() -> None:
    first = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (np.nan, 0.0, 0.0), (-2.0, 0.0, 0.0)])

    assert angles_deg(first, np.array((0.0, 3.0, 0.0))) == pytest.approx(
        [90, np.nan, np.nan, 90], nan_ok=True
    )
    assert angles_deg(first[:, np.newaxis], first).shape == (4, 4)
    assert lengths(first) == pytest.approx([1, 0, np.nan, 2], nan_ok=True)


def test_unit_vectors_have_length_one_however_short_or_long_they_were() -> None:
    vectors = np.array([(3e-300, 0.0, 4e-300), (0.0, 3e300, -4e300), (0.0, 0.0, 0.0)])

    found = unit_vectors(vectors)

    assert found[:2] == pytest.approx(np.array([(0.6, 0.0, 0.8), (0.0, 0.6, -0.8)]))
    assert np.isnan(found[2]).all()
