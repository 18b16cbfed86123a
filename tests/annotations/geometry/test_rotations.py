import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from annotations.geometry.rotations import Quaternion, about_axis, from_matrix, matrix, quaternion

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


def test_an_axis_has_a_length() -> None:
    with pytest.raises(ValueError, match="axis"):
        about_axis((0, 0, 0), 30)
