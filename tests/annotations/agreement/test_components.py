import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.agreement.components import component_values, difference_from_others
from annotations.agreement.measured import Measured
from annotations.geometry.angles import angle_deg


def directions(*each: tuple[float, float, float]) -> Measured:
    """Return one volume with the directions of its annotators."""
    values = np.array([each], dtype=float)
    return Measured("orientation_deg", "angle", values / np.linalg.norm(values, axis=-1, keepdims=True))


def test_position_has_three_components_with_its_unit_and_an_angle_is_its_own() -> None:
    position = Measured("position_um", "distance", np.array([[[1.0, 2.0, 3.0], [np.nan] * 3]]))
    theta1 = Measured("theta1_deg", "difference", np.array([[[30.0], [31.0]]]))
    found = component_values([position, theta1])
    assert list(found) == ["position_x_um", "position_y_um", "position_z_um", "theta1_deg"]
    np.testing.assert_array_equal(found["position_y_um"], [[2.0, np.nan]])
    np.testing.assert_array_equal(found["theta1_deg"], [[30.0, 31.0]])


def test_first_angle_is_a_turn_about_z_and_the_second_a_tilt_towards_z() -> None:
    turned = component_values([directions((np.cos(0.02), np.sin(0.02), 0), (np.cos(0.02), -np.sin(0.02), 0))])
    np.testing.assert_allclose(turned["orientation_1_deg"], np.degrees([[0.02, -0.02]]))
    np.testing.assert_allclose(turned["orientation_2_deg"], 0, atol=1e-12)
    tilted = component_values([directions((0, np.cos(0.02), np.sin(0.02)), (0, np.cos(0.02), -np.sin(0.02)))])
    np.testing.assert_allclose(tilted["orientation_1_deg"], 0, atol=1e-12)
    np.testing.assert_allclose(tilted["orientation_2_deg"], np.degrees([[0.02, -0.02]]))


def test_along_z_itself_the_axes_are_those_of_no_yaw() -> None:
    found = component_values([directions((0, 0.01, 1), (0, -0.01, 1))])
    np.testing.assert_allclose(found["orientation_1_deg"], [[0.573, -0.573]], atol=0.001)


numbers = st.floats(-1, 1).map(lambda value: round(value, 3))
vectors = st.tuples(numbers, numbers, numbers).filter(lambda vector: np.linalg.norm(vector) > 0.1)


@given(vectors, st.lists(vectors, min_size=2, max_size=5))
def test_angle_to_the_mean_is_kept(around: tuple[float, float, float], off: list) -> None:
    measured = directions(*[tuple(np.array(around) + 0.05 * np.array(each)) for each in off])
    found = component_values([measured])
    mean = measured.values[0].sum(axis=0)
    lengths = np.hypot(found["orientation_1_deg"], found["orientation_2_deg"])[0]
    expected = [angle_deg(mean, direction) for direction in measured.values[0]]
    assert lengths == pytest.approx(expected, abs=1e-9)


def test_in_the_common_frame_volumes_differ_as_their_directions_do() -> None:
    yaws_deg = np.array([[-20.0, -20.0], [0.0, 1.0], [20.0, 19.0]])
    values = np.stack([np.cos(np.radians(yaws_deg)), np.sin(np.radians(yaws_deg)), 0 * yaws_deg], axis=-1)
    measured = Measured("orientation_deg", "angle", values)
    common = component_values([measured], frame="common")["orientation_1_deg"]
    np.testing.assert_allclose(common - common[0, 0], yaws_deg + 20, atol=1e-9)
    own = component_values([measured])["orientation_1_deg"]
    np.testing.assert_allclose(own, [[0, 0], [-0.5, 0.5], [0.5, -0.5]], atol=1e-9)


def test_absent_directions_are_no_obstacle_and_opposite_ones_have_no_mean() -> None:
    values = np.array([[[1.0, 0, 0], [-1, 0, 0]], [[np.nan] * 3, [0, 1, 0]], [[np.nan] * 3, [np.nan] * 3]])
    measured = Measured("orientation_deg", "angle", values)
    found = component_values([measured])["orientation_1_deg"]
    np.testing.assert_array_equal(found, [[np.nan, np.nan], [np.nan, 0], [np.nan, np.nan]])
    common = component_values([measured], frame="common")["orientation_1_deg"]
    np.testing.assert_allclose(common, [[-90, 90], [np.nan, 0], [np.nan, np.nan]], atol=1e-9)


def test_of_the_direction_opposite_to_the_mean_the_angle_is_kept() -> None:
    values = np.array([[[1.0, 0, 0]], [[1, 0, 0]], [[-1, 0, 0]]])
    found = component_values([Measured("orientation_deg", "angle", values)], frame="common")
    np.testing.assert_allclose(np.hypot(*found.values()), [[0], [0], [180]])


def test_difference_is_from_the_mean_of_the_others() -> None:
    values = np.array([[1.0, 2.0, 6.0], [1.0, np.nan, 3.0], [np.nan, 4.0, np.nan]])
    np.testing.assert_allclose(
        difference_from_others(values), [[-3, -1.5, 4.5], [-2, np.nan, 2], [np.nan, np.nan, np.nan]]
    )
