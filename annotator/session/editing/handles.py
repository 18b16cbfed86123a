"""Handles: the places at which a box or the posed tool is taken hold of. No painting, no mouse."""

from dataclasses import dataclass
from typing import Literal

from annotations.geometry.frames import Vector

HandleKind = Literal["move", "end", "face", "turn", "bend"]
"""What a drag does: moves the body, moves one end of it, moves one face, turns it, bends a joint."""


@dataclass(frozen=True)
class Handle:
    """A place that a person can drag, in the scene and in every slice.

    Attributes
    ----------
    name : str
        Unique among the handles that are shown; says to `box_dragged` or `pose_dragged` what to do.
    kind : str
        See `HandleKind`; views draw each kind in a form of its own.
    position_um : (float, float, float)
        In the volume's frame.
    color : str
        ``#rrggbb``, the link's.
    hint : str
        What a drag of it does, in a few words.
    stem_um : (float, float, float) or None
        Where a knob that stands off the body is joined to it; None for one on the body.
    pivot_um : (float, float, float) or None
        What it turns about: a place on the axis, or the centre of a sphere where there is no axis. None for
        one that does not turn.
    axis : (float, float, float) or None
        Unit vector in the volume's frame: the axis that it turns about, or along which it slides; None where
        neither binds it.
    """

    name: str
    kind: HandleKind
    position_um: Vector
    color: str
    hint: str
    stem_um: Vector | None = None
    pivot_um: Vector | None = None
    axis: Vector | None = None
