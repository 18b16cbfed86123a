import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from annotations.geometry.rotations import (
    Quaternion,
    about_axis,
    along,
    from_matrix,
    from_yaw_pitch_roll,
    matrix,
    product,
    quaternion,
    yaw_pitch_roll_deg,
)

components = st.floats(-1.0, 1.0)
raw_quaternions = st.tuples(*[components] * 4).filter(lambda values: math.hypot(*values) > 1e-3)
axes = st.tuples(*[components] * 3).filter(lambda values: math.hypot(*values) > 1e-3)


def same_rotation(first: Quaternion, second: Quaternion, tolerance: float = 1e-14) -> bool:
    return bool(
        np.allclose(first, second, rtol=0, atol=tolerance)
        or np.allclose(np.negative(first), second, rtol=0, atol=tolerance)
    )


@given(raw=raw_quaternions)
def test_a_quaternion_has_unit_length_and_no_negative_w(raw: tuple[float, float, float, float]) -> None:
    unit = quaternion(raw)
    assert math.hypot(*unit) == pytest.approx(1, abs=1e-15)
    assert unit[0] >= 0
    assert same_rotation(unit, vector_over_length(raw))


def vector_over_length(raw: tuple[float, float, float, float]) -> Quaternion:
    w, x, y, z = (value / math.hypot(*raw) for value in raw)
    return (w, x, y, z)


@given(raw=raw_quaternions)
@example(raw=(0.1, 0.2, 0.3, 0.4))
def test_a_unit_quaternion_stays_as_it_is(raw: tuple[float, float, float, float]) -> None:
    unit = quaternion(raw)
    assert quaternion(unit) == unit


@pytest.mark.parametrize("scale", [5e-324, 1e-200, 1e200, 1e308])
def test_the_length_of_a_quaternion_does_not_matter(scale: float) -> None:
    assert quaternion((scale, 0, -scale, 0)) == pytest.approx((math.sqrt(0.5), 0, -math.sqrt(0.5), 0))


@pytest.mark.parametrize(
    "wrong",
    [(0, 0, 0, 0), (1, 0, 0), (1, 0, 0, 0, 0), (math.nan, 0, 0, 1), (math.inf, 0, 0, 1), [[1, 0, 0, 0]]],
)
def test_what_is_no_rotation_is_refused(wrong: object) -> None:
    with pytest.raises(ValueError, match="four finite numbers"):
        quaternion(wrong)  # type: ignore[arg-type]


@given(raw=raw_quaternions)
def test_matrices_agree_with_scipy(raw: tuple[float, float, float, float]) -> None:
    expected = Rotation.from_quat(raw, scalar_first=True).as_matrix()
    np.testing.assert_allclose(matrix(raw), expected, atol=1e-14)


@given(raw=raw_quaternions)
@example(raw=(1.0, 0.0, 0.0, 0.0))
@example(raw=(0.0, 1.0, 0.0, 0.0))
@example(raw=(0.0, 0.0, 1.0, 0.0))
@example(raw=(0.0, 0.0, 0.0, 1.0))
@example(raw=(1e-9, 1.0, 1.0, 1.0))
def test_a_rotation_survives_the_way_through_its_matrix(raw: tuple[float, float, float, float]) -> None:
    assert same_rotation(from_matrix(matrix(raw)), quaternion(raw))
    w, x, y, z = Rotation.from_matrix(matrix(raw)).as_quat(scalar_first=True)
    assert same_rotation(from_matrix(matrix(raw)), (w, x, y, z))


@pytest.mark.parametrize(
    "wrong",
    [np.diag([1, 1, -1]), -np.eye(3), 2 * np.eye(3), np.eye(2), np.zeros((3, 3)), np.full((3, 3), np.nan)],
    ids=["mirror", "point reflection", "scaling", "2 × 2", "zero", "NaN"],
)
def test_a_matrix_that_is_no_rotation_is_refused(wrong: np.ndarray) -> None:
    with pytest.raises(ValueError, match="not the \\(3, 3\\) matrix of a rotation"):
        from_matrix(wrong)


@given(axis=axes, turn_deg=st.floats(-720, 720))
def test_turns_about_an_axis_agree_with_scipy(axis: tuple[float, float, float], turn_deg: float) -> None:
    unit = np.array(axis) / math.hypot(*axis)
    expected = Rotation.from_rotvec(unit * turn_deg, degrees=True).as_matrix()
    np.testing.assert_allclose(matrix(about_axis(axis, turn_deg)), expected, atol=1e-13)


def test_turns_are_right_handed() -> None:
    np.testing.assert_allclose(matrix(about_axis((0, 0, 1), 90)) @ (1, 0, 0), (0, 1, 0), atol=1e-15)


@given(second=raw_quaternions, first=raw_quaternions)
def test_a_product_turns_by_one_rotation_after_the_other(
    second: tuple[float, float, float, float], first: tuple[float, float, float, float]
) -> None:
    np.testing.assert_allclose(matrix(product(second, first)), matrix(second) @ matrix(first), atol=1e-14)


@given(yaw_deg=st.floats(-360, 360), pitch_deg=st.floats(-180, 180), roll_deg=st.floats(-360, 360))
def test_yaw_pitch_and_roll_agree_with_scipy(yaw_deg: float, pitch_deg: float, roll_deg: float) -> None:
    expected = Rotation.from_euler("ZYX", (yaw_deg, pitch_deg, roll_deg), degrees=True).as_matrix()
    np.testing.assert_allclose(
        matrix(from_yaw_pitch_roll(yaw_deg, pitch_deg, roll_deg)), expected, atol=1e-13
    )


@given(yaw_deg=st.floats(-179.9, 179.9), pitch_deg=st.floats(-89.9, 89.9), roll_deg=st.floats(-179.9, 179.9))
def test_yaw_pitch_and_roll_are_read_as_they_were_said(
    yaw_deg: float, pitch_deg: float, roll_deg: float
) -> None:
    found = yaw_pitch_roll_deg(from_yaw_pitch_roll(yaw_deg, pitch_deg, roll_deg))
    assert found == pytest.approx((yaw_deg, pitch_deg, roll_deg), abs=1e-9)


@given(raw=raw_quaternions)
@example(raw=(1.0, 0.0, 1.0, 0.0))
@example(raw=(1.0, 0.0, -1.0, 0.0))
@example(raw=(1.0, 1.0, 1.0, 1.0))
@example(raw=(1.0, -0.3, -1.0, 0.3))
def test_a_rotation_survives_the_way_through_yaw_pitch_and_roll(
    raw: tuple[float, float, float, float],
) -> None:
    yaw_deg, pitch_deg, roll_deg = yaw_pitch_roll_deg(raw)
    assert -180 <= yaw_deg <= 180
    assert -90 <= pitch_deg <= 90
    assert -180 <= roll_deg <= 180
    # Where +x is all but vertical, yaw is called 0: that turns nothing by more than its distance from there.
    found = matrix(from_yaw_pitch_roll(yaw_deg, pitch_deg, roll_deg))
    np.testing.assert_allclose(found, matrix(raw), atol=3e-9)


@pytest.mark.parametrize("pitch_deg", [-90.0, 90.0])
@pytest.mark.parametrize("roll_deg", [-170.0, -35.0, 0.0, 35.0, 170.0])
def test_the_yaw_of_a_vertical_rotation_is_called_0(pitch_deg: float, roll_deg: float) -> None:
    found = yaw_pitch_roll_deg(from_yaw_pitch_roll(0.0, pitch_deg, roll_deg))
    assert found == pytest.approx((0.0, pitch_deg, roll_deg), abs=1e-9)
    # A yaw is a roll here: the one turns by what the other one does, about the same vertical.
    turned = yaw_pitch_roll_deg(from_yaw_pitch_roll(40.0, pitch_deg, roll_deg))
    assert turned[0] == 0.0
    assert math.remainder(turned[2] - roll_deg + math.copysign(40.0, pitch_deg), 360) == pytest.approx(0)


@given(direction=axes, roll_deg=st.floats(-179, 179))
@example(direction=(0.0, 0.0, 1.0), roll_deg=30.0)
@example(direction=(0.0, 0.0, -1.0), roll_deg=30.0)
@example(direction=(-1e-12, 1e-12, 1.0), roll_deg=30.0)
@example(direction=(0.0, 1e-7, -1.0), roll_deg=30.0)
def test_along_a_direction_the_roll_is_the_one_said(
    direction: tuple[float, float, float], roll_deg: float
) -> None:
    rotation = along(direction, roll_deg)
    unit = np.array(direction) / math.hypot(*direction)
    np.testing.assert_allclose(matrix(rotation)[:, 0], unit, atol=3e-9)
    assert yaw_pitch_roll_deg(rotation)[2] == pytest.approx(roll_deg, abs=1e-5)


def test_along_nothing_there_is_no_rotation() -> None:
    with pytest.raises(ValueError, match="direction"):
        along((0, 0, 0), 30)


def test_an_axis_has_a_length() -> None:
    with pytest.raises(ValueError, match="axis"):
        about_axis((0, 0, 0), 30)
