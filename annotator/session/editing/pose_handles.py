"""The handles of the posed tool, and what dragging one makes of the pose: pure functions."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry import rotations
from annotations.geometry.angles import signed_angle_deg
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import LinkFrame, ToolPose, link_frames
from annotations.geometry.tool import Joint, ToolSpecification
from annotator.session.editing.box_handles import KNOB_UM, roll_to_deg, smallest_turn
from annotator.session.editing.handles import Handle

MOVE, SWING, ROLL, BEND = "move:", "swing", "roll", "bend:"


def pose_handles(pose: ToolPose, tool: ToolSpecification) -> tuple[Handle, ...]:
    """Return the handles of a posed tool: links move it, two knobs turn it, the tips of children bend it."""
    frames = link_frames(pose, tool)
    if not frames:
        return ()
    handles = []
    for name, frame in frames.items():
        link = tool.link(name)
        middle_um = _on_axis(frame, link.length_um / 2)
        handles.append(Handle(MOVE + name, "move", middle_um, link.color, "move the tool"))
    root_name, root = next(iter(frames.items()))
    link = tool.link(root_name)
    # At the base, where no joint's handle is in the way.
    handles.append(
        Handle(
            SWING,
            "turn",
            _on_axis(root, -KNOB_UM),
            link.color,
            f"turn the tool about the middle of {root_name}",
            _on_axis(root, 0.0),
            pose.position_um,
        )
    )
    middle = np.asarray(_on_axis(root, link.length_um / 2))
    side_um = link.cross_section_um[1] / 2
    handles.append(
        Handle(
            ROLL,
            "turn",
            vector(middle - (side_um + KNOB_UM) * root.axes[:, 2]),
            link.color,
            f"turn the tool about the axis of {root_name}",
            vector(middle - side_um * root.axes[:, 2]),
            pose.position_um,
            vector(root.axes[:, 0]),
        )
    )
    for joint in tool.joints:
        if joint.child in frames:
            child = tool.link(joint.child)
            tip_um = _on_axis(frames[joint.child], child.length_um)
            hinge_um, hinge = _hinge(frames, joint)
            handles.append(
                Handle(
                    BEND + joint.name,
                    "bend",
                    tip_um,
                    child.color,
                    f"bend {joint.name}, within its limits",
                    pivot_um=vector(hinge_um),
                    axis=vector(hinge),
                )
            )
    return tuple(handles)


def pose_dragged(pose: ToolPose, tool: ToolSpecification, handle: str, to_um: Vector) -> ToolPose:
    """Return the pose after one of its handles was dragged to a position in µm; joints keep their limits."""
    frames = link_frames(pose, tool)
    root = next(iter(frames.values()))
    to = np.asarray(to_um, dtype=np.float64)
    middle = np.asarray(pose.position_um)
    if handle.startswith(MOVE):
        name = handle.removeprefix(MOVE)
        return moved(pose, to - _on_axis(frames[name], tool.link(name).length_um / 2))
    if handle == SWING:
        turn = smallest_turn(-root.axes[:, 0], to - middle)
        return pose if turn is None else _turned_by(pose, turn)
    if handle == ROLL:
        return turned(pose, 0, roll_to_deg(root.axes, -1.0, to - middle))
    joint = joint_named(tool, handle.removeprefix(BEND))
    hinge_um, hinge = _hinge(frames, joint)
    angle_deg = signed_angle_deg(frames[joint.parent].axes[:, 0], to - hinge_um, hinge)
    return pose if math.isnan(angle_deg) else bent(pose, joint, angle_deg)


def moved(pose: ToolPose, by_um: ArrayLike) -> ToolPose:
    """Return the pose moved by a vector in µm, shape (3,)."""
    return replace(pose, position_um=vector(np.asarray(pose.position_um) + np.asarray(by_um)))


def turned(pose: ToolPose, axis: int, turn_deg: float) -> ToolPose:
    """Return the pose turned about one of the root link's own axes, through its middle."""
    turn = rotations.about_axis(np.eye(3)[axis], turn_deg)
    return replace(pose, rotation_wxyz=rotations.product(pose.rotation_wxyz, turn))


def bent(pose: ToolPose, joint: Joint, angle_deg: float) -> ToolPose:
    """Return the pose with a joint at a signed angle, or at the limit that is nearest to it."""
    low, high = joint.limits_deg
    if not low <= angle_deg <= high:
        # Round the circle: a pull far beyond one limit must not land at the other.
        angle_deg = min((low, high), key=lambda limit: abs((angle_deg - limit + 180) % 360 - 180))
    return replace(pose, angles_deg={**pose.angles_deg, joint.name: float(angle_deg)})


def joint_named(tool: ToolSpecification, name: str) -> Joint:
    """Return a joint of the tool; KeyError if it has none of that name."""
    for joint in tool.joints:
        if joint.name == name:
            return joint
    raise KeyError(name)


def _turned_by(pose: ToolPose, turn: rotations.Quaternion) -> ToolPose:
    return replace(pose, rotation_wxyz=rotations.product(turn, pose.rotation_wxyz))


def _hinge(frames: Mapping[str, LinkFrame], joint: Joint) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where a joint's hinge is in µm, and its unit vector, shape (3,) each, in the volume's frame."""
    child = frames[joint.child]
    hinge_um = child.base_um - child.axes[:, 0] * joint.offsets_um[1]
    return hinge_um, frames[joint.parent].axes @ np.asarray(joint.hinge_axis)


def _on_axis(frame: LinkFrame, along_um: float) -> Vector:
    return vector(frame.base_um + frame.axes[:, 0] * along_um)
