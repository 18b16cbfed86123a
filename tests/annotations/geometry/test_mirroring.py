import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from annotations.geometry.boxes import hinge_axes
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.mirroring import has_mirrored_poses, mirrored_um
from annotations.geometry.targets import PoseTargets, pose_targets
from annotations.geometry.tool import ToolSpecification
from tests.annotations.geometry.mirrored_poses import mirrored_pose

mirrors = st.tuples(st.integers(0, 2), st.floats(-20_000, 20_000))


def with_hinges(tool: ToolSpecification, *hinges: tuple[float, float, float]) -> ToolSpecification:
    """Return the tool with other hinges, whose limits allow both senses."""
    fields = tool.model_dump(mode="json")
    for joint, hinge in zip(fields["joints"], hinges, strict=True):
        joint |= {"hinge_axis": hinge, "limits_deg": (-180.0, 180.0)}
    return ToolSpecification.model_validate(fields)


def targets_of(pose: ToolPose, tool: ToolSpecification) -> PoseTargets:
    return pose_targets(keypoints_um(pose, tool), tool, hinge_axes(link_boxes(pose, tool), tool))


def assert_has_mirrored_pose(pose: ToolPose, tool: ToolSpecification, mirror: tuple[int, float]) -> ToolPose:
    """Check that a pose shows what is in the mirror, keypoints and the links' bodies; returns it."""
    assert has_mirrored_poses(tool)
    found = mirrored_pose(pose, tool, *mirror)
    positions_um = keypoints_um(found, tool)
    for name, position_um in keypoints_um(pose, tool).items():
        np.testing.assert_allclose(positions_um[name], mirrored_um(position_um, *mirror), rtol=0, atol=1e-7)
    boxes = link_boxes(found, tool)
    for name, box in link_boxes(pose, tool).items():
        center_um, axes = mirrored_um(box.center_um, *mirror), mirrored_um(box.axes.T, mirror[0], 0.0).T
        np.testing.assert_allclose(boxes[name].center_um, center_um, rtol=0, atol=1e-7)
        # The same body: the sense of own y alone has turned, so that the frame is right-handed again.
        np.testing.assert_allclose(boxes[name].axes, axes * (1, -1, 1), rtol=0, atol=1e-12)
    return found


def test_a_mirror_moves_positions_across_its_plane() -> None:
    found = mirrored_um([[1.0, 2.0, 3.0], [np.nan] * 3], 1, 10.0)
    np.testing.assert_array_equal(found, [[1.0, 18.0, 3.0], [np.nan] * 3])


@given(pose=..., mirror=mirrors)
def test_the_forceps_in_a_mirror_are_the_forceps_with_the_same_angles(
    forceps: ToolSpecification, pose: ToolPose, mirror: tuple[int, float]
) -> None:
    found = assert_has_mirrored_pose(pose, forceps, mirror)
    assert found.angles_deg == pose.angles_deg


@given(pose=..., mirror=mirrors, turn=st.floats(0, 2 * np.pi))
def test_angles_about_hinges_in_the_own_xz_plane_change_their_sign(
    forceps: ToolSpecification, pose: ToolPose, mirror: tuple[int, float], turn: float
) -> None:
    tool = with_hinges(forceps, (0.0, 0.0, 1.0), (float(np.sin(turn)), 0.0, float(np.cos(turn))))
    found = assert_has_mirrored_pose(pose, tool, mirror)
    assert found.angles_deg == {name: -angle_deg for name, angle_deg in pose.angles_deg.items()}


@given(pose=..., mirror=mirrors)
def test_targets_in_a_mirror_keep_their_unsigned_angles_and_turn_their_direction(
    forceps: ToolSpecification, pose: ToolPose, mirror: tuple[int, float]
) -> None:
    for tool in (forceps, with_hinges(forceps, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
        found = assert_has_mirrored_pose(pose, tool, mirror)
        before, after = targets_of(pose, tool), targets_of(found, tool)
        assert before.position_um is not None
        assert before.orientation is not None
        assert after.position_um == pytest.approx(mirrored_um(before.position_um, *mirror), abs=1e-7)
        assert after.orientation == pytest.approx(mirrored_um(before.orientation, mirror[0], 0.0), abs=1e-9)
        assert after.angles_deg == pytest.approx(before.angles_deg, abs=1e-8)
        for joint in tool.joints:
            sense = 1 if joint.hinge_axis[1] else -1
            assert after.signed_angles_deg[joint.name] == pytest.approx(
                sense * before.signed_angles_deg[joint.name], abs=1e-8
            )


def test_a_tool_with_an_oblique_hinge_is_another_tool_in_a_mirror(forceps: ToolSpecification) -> None:
    assert has_mirrored_poses(forceps)
    assert not has_mirrored_poses(with_hinges(forceps, (0.0, 1.0, 0.0), (0.0, 0.6, 0.8)))


def test_a_needle_needs_no_hinges_to_be_mirrored(needle: ToolSpecification) -> None:
    assert_has_mirrored_pose(ToolPose((1.0, 2.0, 3.0), (0.6, 0.8, 0.0, 0.0)), needle, (2, 5.0))
