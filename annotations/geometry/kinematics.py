"""Forward kinematics: from a tool's pose to where its links and keypoints are."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from annotations.geometry import rotations
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, vector
from annotations.geometry.tool import ToolSpecification


@dataclass(frozen=True)
class ToolPose:
    """Where a tool is and how its joints stand.

    Attributes
    ----------
    position_um : (float, float, float)
        Middle of the root link's axis in the volume's frame.
    rotation_wxyz : (float, float, float, float)
        Rotation of the root link: its own +x runs along the link towards the tip.
    angles_deg : mapping of str to float
        Signed angle of each joint, by name; a joint that is not named is straight.
    """

    position_um: Vector
    rotation_wxyz: rotations.Quaternion
    angles_deg: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class LinkFrame:
    """Where a link is: its base in µm, shape (3,), and the (3, 3) matrix whose columns are its own axes."""

    base_um: NDArray[np.float64]
    axes: NDArray[np.float64]


def link_frames(pose: ToolPose, tool: ToolSpecification) -> dict[str, LinkFrame]:
    """Return the frame of each link that hangs together with the root link.

    A tool without links has none. A joint turns its child about ``hinge_axis``, right-handed, by its signed
    angle; the hinge lies ``offsets_um[0]`` beyond the parent's tip and ``offsets_um[1]`` before the child's
    base.
    """
    root = tool.root
    if root is None:
        return {}
    axes = rotations.matrix(pose.rotation_wxyz)
    base = np.asarray(pose.position_um, dtype=np.float64) - axes[:, 0] * root.length_um / 2
    frames = {root.name: LinkFrame(base, axes)}
    waiting = list(tool.joints)
    while ready := [joint for joint in waiting if joint.parent in frames]:
        for joint in ready:
            waiting.remove(joint)
            parent = frames[joint.parent]
            length_um = tool.link(joint.parent).length_um
            hinge_um = parent.base_um + parent.axes[:, 0] * (length_um + joint.offsets_um[0])
            turn = rotations.matrix(
                rotations.about_axis(joint.hinge_axis, pose.angles_deg.get(joint.name, 0.0))
            )
            turned = parent.axes @ turn
            frames[joint.child] = LinkFrame(hinge_um + turned[:, 0] * joint.offsets_um[1], turned)
    return frames


def keypoints_um(pose: ToolPose, tool: ToolSpecification) -> dict[str, Vector]:
    """Return the position in µm of each keypoint at the end of a link of the posed tool."""
    positions: dict[str, Vector] = {}
    for name, frame in link_frames(pose, tool).items():
        link = tool.link(name)
        positions[link.base] = vector(frame.base_um)
        positions[link.tip] = vector(frame.base_um + frame.axes[:, 0] * link.length_um)
    return positions


def link_boxes(pose: ToolPose, tool: ToolSpecification) -> dict[str, Box]:
    """Return the box of each link of the posed tool, with the cross-section of the specification."""
    boxes = {}
    for name, frame in link_frames(pose, tool).items():
        link = tool.link(name)
        middle_um = vector(frame.base_um + frame.axes[:, 0] * link.length_um / 2)
        size_um = (link.length_um, *link.cross_section_um)
        boxes[name] = Box(middle_um, size_um, rotations.from_matrix(frame.axes))
    return boxes
