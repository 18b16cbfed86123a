"""The handles of a box, and what dragging one makes of the box: pure functions."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry import rotations
from annotations.geometry.boxes import Box, box_between
from annotations.geometry.frames import Vector, vector
from annotator.session.editing.handles import Handle

SMALLEST_UM = 10.0
"""No drag makes a side of a box shorter: about the size of a voxel."""

KNOB_UM = 700.0
"""How far the knobs that turn a box stand off it: apart from the handles on the faces at any usual zoom."""

_FACES = {"+y": (1, 1.0), "-y": (1, -1.0), "+z": (2, 1.0), "-z": (2, -1.0)}
_SIDES = {"y": "width", "z": "height"}


def box_handles(box: Box, color: str, *, free: bool) -> tuple[Handle, ...]:
    """Return the handles of a box; those that change its cross-section only where it is ``free``."""
    swing_um = _beyond(box, (0.5, 0.0, 0.0))
    roll_um = _beyond(box, (0.0, 0.0, -0.5))
    handles = [
        Handle("center", "move", box.center_um, color, "move the box"),
        Handle("base", "end", box.base_um, color, "move the base; the tip stays"),
        Handle("tip", "end", box.tip_um, color, "move the tip; the base stays"),
        Handle("swing", "turn", swing_um, color, "turn the box about its centre", box.tip_um, box.center_um),
        Handle(
            "roll",
            "turn",
            roll_um,
            color,
            "turn the box about its own x",
            box.position_um((0.0, 0.0, -0.5)),
            box.center_um,
            vector(box.axes[:, 0]),
        ),
    ]
    if free:
        for name, (axis, sense) in _FACES.items():
            share = np.eye(3)[axis] * sense / 2
            hint = f"change the {_SIDES[name[1]]} on this side"
            own = vector(box.axes[:, axis])
            handles.append(Handle(name, "face", box.position_um(share), color, hint, axis=own))
    return tuple(handles)


def box_dragged(box: Box, handle: str, to_um: Vector) -> Box:
    """Return the box after one of its handles was dragged to a position in µm.

    A position that no box can follow, such as both ends at one place, leaves it as it is.
    """
    to = np.asarray(to_um, dtype=np.float64)
    match handle:
        case "center":
            return replace(box, center_um=to_um)
        case "base":
            return _between(box, to, box.tip_um)
        case "tip":
            return _between(box, box.base_um, to)
        case "swing":
            return swung(box, to - box.center_um)
        case "roll":
            return rolled(box, roll_to_deg(box.axes, -1.0, to - box.center_um))
    axis, sense = _FACES[handle]
    return resized(box, axis, sense, float((to - box.center_um) @ box.axes[:, axis]) * sense)


def swung(box: Box, direction: ArrayLike) -> Box:
    """Return the box turned about its centre by the smallest turn that points its +x in a direction."""
    turn = smallest_turn(box.axes[:, 0], direction)
    return box if turn is None else replace(box, rotation_wxyz=rotations.product(turn, box.rotation_wxyz))


def rolled(box: Box, turn_deg: float) -> Box:
    """Return the box turned about its own x."""
    return turned(box, 0, turn_deg)


def turned(box: Box, axis: int, turn_deg: float) -> Box:
    """Return the box turned about one of its own axes through its centre."""
    turn = rotations.about_axis(np.eye(3)[axis], turn_deg)
    return replace(box, rotation_wxyz=rotations.product(box.rotation_wxyz, turn))


def resized(box: Box, axis: int, sense: float, face_um: float) -> Box:
    """Return the box with one face moved along its own axis, and the opposite one where it is.

    Parameters
    ----------
    axis : int
        The own axis across which the face lies.
    sense : float
        1 for the face towards +axis, −1 for the other.
    face_um : float
        New distance of the face from the old centre, outwards; the side keeps at least `SMALLEST_UM`.
    """
    opposite_um = -box.size_um[axis] / 2
    face_um = max(face_um, opposite_um + SMALLEST_UM)
    size_um = list(box.size_um)
    size_um[axis] = face_um - opposite_um
    shift_um = sense * (face_um + opposite_um) / 2
    center_um = vector(np.asarray(box.center_um) + shift_um * box.axes[:, axis])
    return replace(box, center_um=center_um, size_um=(size_um[0], size_um[1], size_um[2]))


def smallest_turn(old: ArrayLike, new: ArrayLike) -> rotations.Quaternion | None:
    """Return the smallest rotation from one direction to another, shape (3,) each; None if one is zero.

    Where they are opposite there are many such rotations, and none is preferred: None too.
    """
    first, second = np.asarray(old, dtype=np.float64), np.asarray(new, dtype=np.float64)
    lengths = math.hypot(*first) * math.hypot(*second)
    if not lengths:
        return None
    # The half-way quaternion: (|a||b| + a·b, a × b), of twice the half angle.
    half = np.array([lengths + first @ second, *np.cross(first, second)])
    return rotations.quaternion(half) if math.hypot(*half) > 1e-9 * lengths else None


def roll_to_deg(axes: NDArray[np.float64], sense: float, towards: ArrayLike) -> float:
    """Return the turn about own x that brings own z (times a sense) nearest to a direction."""
    _, y, z = np.asarray(towards, dtype=np.float64) @ axes * sense
    # Turning by t about x takes z to (0, −sin t, cos t).
    return math.degrees(math.atan2(-y, z)) if y or z else 0.0


def _between(box: Box, base_um: ArrayLike, tip_um: ArrayLike) -> Box:
    """Return the box with other ends: its axes follow by the smallest turn, and its cross-section stays."""
    along = np.asarray(tip_um, dtype=np.float64) - np.asarray(base_um, dtype=np.float64)
    turn = smallest_turn(box.axes[:, 0], along)
    if math.hypot(*along) < SMALLEST_UM or turn is None:
        return box
    hinge = rotations.matrix(turn) @ box.axes[:, 1]
    return box_between(base_um, tip_um, (box.size_um[1], box.size_um[2]), hinge)


def _beyond(box: Box, share: Vector) -> Vector:
    """Return a place that stands off a face of the box, given as for `Box.position_um`."""
    outwards = box.axes @ np.asarray(share) * 2
    return vector(np.asarray(box.position_um(share)) + KNOB_UM * outwards)
