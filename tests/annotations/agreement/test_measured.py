from collections.abc import Callable

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import arrays

from annotations.agreement.compared import Compared
from annotations.agreement.measured import measured_targets, target_metrics
from annotations.geometry.angles import angle_deg
from annotations.geometry.targets import pose_targets, target_arrays
from annotations.geometry.tool import Targets, ToolSpecification
from annotations.geometry.tool_library import find_tool

coordinates = st.floats(-30_000, 30_000).map(lambda value: round(value, 3))


@given(arrays(np.float64, (2, 3, 6, 3), elements=coordinates), arrays(np.bool_, (2, 3, 6)))
def test_targets_of_many_are_those_of_each(positions_um: np.ndarray, is_there: np.ndarray) -> None:
    tool = find_tool("magnetic-forceps")
    found = target_arrays(np.where(is_there[..., np.newaxis], positions_um, np.nan), tool)

    for volume, annotator in np.ndindex(2, 3):
        points = {
            name: tuple(positions_um[volume, annotator, index].tolist())
            for index, name in enumerate(tool.keypoint_names)
            if is_there[volume, annotator, index]
        }
        expected = pose_targets(points, tool)
        for array, value in (
            (found.position_um, expected.position_um),
            (found.orientation, expected.orientation),
        ):
            assert array is not None
            assert array[volume, annotator] == pytest.approx(value or (np.nan,) * 3, abs=1e-9, nan_ok=True)
        for name, angles in found.angles_deg.items():
            wanted = expected.angles_deg.get(name, np.nan)
            assert angles[volume, annotator] == pytest.approx(wanted, abs=1e-9, nan_ok=True)


def test_targets_are_by_the_published_formulas(
    forceps: ToolSpecification, compared_of: Callable[..., Compared]
) -> None:
    points_um = np.array([(0, 0, 0), (2000, 0, 0), (2500, 0, 0), (2500, 900, 0), (0, 0, 0), (0, 500, 500)])
    found = measured_targets(compared_of(points_um[np.newaxis, np.newaxis].astype(float)), forceps)

    assert found["position_um"].values[0, 0] == pytest.approx((1000, 0, 0))
    assert found["orientation_deg"].values[0, 0] == pytest.approx((1, 0, 0))
    assert found["theta1_deg"].values[0, 0] == pytest.approx([90.0])
    assert found["theta2_deg"].values[0, 0] == pytest.approx([angle_deg((0, 900, 0), (0, 500, 500))])
    assert list(found) == list(target_metrics(forceps))
    assert [target.metric for target in found.values()] == list(target_metrics(forceps).values())


def test_a_target_that_a_tool_lacks_is_absent(compared_of: Callable[..., Compared]) -> None:
    needle = find_tool("needle")
    without = needle.model_copy(update={"targets": Targets()})
    compared = compared_of(np.ones((1, 2, 2, 3)))

    assert list(measured_targets(compared, needle)) == ["position_um", "orientation_deg"]
    assert measured_targets(compared, without) == {}
    # Both points are at one place.
    assert np.isnan(measured_targets(compared, needle)["orientation_deg"].values).all()
