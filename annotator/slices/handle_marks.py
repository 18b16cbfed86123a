"""Handles as a slice shows them: where, how far from the plane, whether within reach. No painting."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from annotations.geometry.frames import Vector, vector
from annotator.session.editing.handles import Handle
from annotator.session.editing.solids import Solid
from annotator.session.viewing.view import View
from annotator.slices.marks import NEAR_UM
from annotator.slices.solid_outlines import Point, section_um
from annotator.slices.viewport import Viewport

# A knob stands off its body by at least this, however small the body is drawn.
STEM_PX = 20.0
# Of handles nearer to each other than this only the one nearest to the plane is shown.
COVER_PX = 9.0
# Half as far from the plane as the longest link is long: from there on a handle looks no fainter.
FAR_UM = 5500.0


@dataclass(frozen=True)
class HandleMark:
    """A handle on a slice.

    Attributes
    ----------
    handle : Handle
    position_um : (float, float, float)
        Where it is shown: a knob farther off its body than in the scene, where that is drawn small.
    x, y : float
        Its projection onto the plane, in pixels of the widget.
    distance_um : float
        From the plane, signed along the plane's axis.
    is_reachable : bool
        Whether the mouse can take it: on or near the plane, or on a body that the plane cuts.
    stem_px : (float, float) or None
        Where a knob is joined to its body.
    """

    handle: Handle
    position_um: Vector
    x: float
    y: float
    distance_um: float
    is_reachable: bool
    stem_px: Point | None

    @property
    def nearness(self) -> float:
        """1 on the plane, falling to 0 at `FAR_UM` and beyond."""
        return max(0.0, 1 - abs(self.distance_um) / FAR_UM)


def handle_marks(
    handles: Sequence[Handle], solids: Iterable[Solid], view: View, viewport: Viewport, index: int
) -> tuple[HandleMark, ...]:
    """Return the handles to be shown on the plane with an index, those that can be taken last.

    A handle that lies under one nearer to the plane is left out: in a section across a link both its ends
    and its centre are at one pixel.
    """
    bodies = [solid for solid in solids if is_handled(solid, view)]
    made = [_mark(handle, bodies, viewport, index) for handle in handles]
    shown: list[HandleMark] = []
    for mark in sorted(made, key=lambda each: (not each.is_reachable, abs(each.distance_um))):
        if all(math.hypot(mark.x - other.x, mark.y - other.y) > COVER_PX for other in shown):
            shown.append(mark)
    return tuple(reversed(shown))


def handle_under(shown: Iterable[HandleMark], x: float, y: float, radius_px: float) -> HandleMark | None:
    """Return the nearest handle within a radius of a pixel, among those that can be taken."""
    within = [
        (distance_px, mark)
        for mark in shown
        if mark.is_reachable and (distance_px := math.hypot(mark.x - x, mark.y - y)) <= radius_px
    ]
    return min(within, key=lambda entry: entry[0])[1] if within else None


def is_handled(solid: Solid, view: View) -> bool:
    """Say whether the handles that are shown, and a drag of its body, move a body."""
    return solid.kind == "ghost" if view.mode == "pose" else solid.kind == "box" and solid.active


def _mark(handle: Handle, bodies: Iterable[Solid], viewport: Viewport, index: int) -> HandleMark:
    position_um = _standing_off(handle, viewport)
    distance_um = viewport.plane.distance_um(position_um, index)
    body = _body_of(handle, bodies)
    is_cut = body is not None and bool(section_um(body, viewport.plane, index))
    x, y = viewport.pixel(position_um)
    return HandleMark(
        handle,
        position_um,
        x,
        y,
        distance_um,
        is_reachable=is_cut or abs(distance_um) <= NEAR_UM,
        stem_px=viewport.pixel(handle.stem_um) if handle.stem_um is not None else None,
    )


def _standing_off(handle: Handle, viewport: Viewport) -> Vector:
    """Return where a handle is shown. Turning knows only the direction of a knob: its distance is free."""
    if handle.stem_um is None:
        return handle.position_um
    stem_um = np.asarray(handle.stem_um)
    way_um = np.asarray(handle.position_um) - stem_um
    length_px = math.hypot(*way_um) * viewport.scale
    return vector(stem_um + way_um * max(1.0, STEM_PX / length_px)) if length_px else handle.position_um


def _body_of(handle: Handle, bodies: Iterable[Solid]) -> Solid | None:
    """Return the body that a handle sits on: the one whose box it, or the foot of its stem, is nearest to."""
    foot_um = np.asarray(handle.position_um if handle.stem_um is None else handle.stem_um)

    def beyond_um(solid: Solid) -> float:
        local_um = (foot_um - np.asarray(solid.box.center_um)) @ solid.box.axes
        return math.hypot(*np.maximum(np.abs(local_um) - np.asarray(solid.box.size_um) / 2, 0.0))

    return min(bodies, key=beyond_um, default=None)
