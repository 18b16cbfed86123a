from collections.abc import Callable

import pytest

from annotations.documents.annotation import Annotation
from annotations.fitting.pose_fit import fit_document
from annotations.fitting.told_keypoints import told_keypoints_um
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification

Write = Callable[..., Annotation]


@pytest.mark.parametrize(
    ("angles_deg", "seen", "told"),
    [
        # All links are seen: what is hidden between them follows.
        ((40.0, 50.0), "k0 k1 k2 k3 k5", "k0 k1 k2 k3 k4 k5"),
        ((40.0, 50.0), "k0 k1 k3 k4 k5", "k0 k1 k2 k3 k4 k5"),
        # θ2 is open, and so is where link 2 lies.
        ((40.0, 50.0), "k0 k1 k2 k3", "k0 k1 k2 k3"),
        ((40.0, 50.0), "k0 k1 k3", "k0 k1 k2 k3"),
        ((40.0, 50.0), "k0 k1", "k0 k1"),
        # Where link 0 lies is open, and with it the fit as a whole.
        ((40.0, 50.0), "k4 k5", ""),
        # Link 2 opens a little one way, or less than that the other way: its tip is told by neither.
        ((40.0, 8.0), "k0 k1 k2 k3 k4", "k0 k1 k2 k3 k4"),
        # In line, the roll is open and moves nothing.
        ((0.0, 0.0), "k0 k2 k3 k4 k5", "k0 k1 k2 k3 k4 k5"),
    ],
)
def test_only_what_is_seen_tells_a_keypoint(
    forceps: ToolSpecification,
    keypoint_document: Write,
    angles_deg: tuple[float, float],
    seen: str,
    told: str,
) -> None:
    angles = dict(zip(("theta1", "theta2"), angles_deg, strict=True))
    truth_um = keypoints_um(ToolPose((7000.0, 8000.0, 3000.0), (1.0, 0.0, 0.0, 0.0), angles), forceps)
    fit = fit_document(keypoint_document(forceps, {name: truth_um[name] for name in seen.split()}), forceps)
    assert fit is not None
    found_um = told_keypoints_um(fit, forceps)
    assert sorted(found_um) == told.split()
    for name, position_um in found_um.items():
        assert position_um == pytest.approx(truth_um[name], abs=60)
