"""Drags of boxes and of the posed tool on a slice, by a handle or by the body itself."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from PySide6.QtCore import QPointF

from annotations.geometry.frames import Vector, vector
from annotator.session import Session
from annotator.session.editing.click_meaning import is_active_locked
from annotator.session.editing.solids import Solid, solid_around
from annotator.session.viewing.view import Mode, View
from annotator.slices.annotation_layer import GRAB_RADIUS_PX
from annotator.slices.handle_marks import HandleMark, is_handled
from annotator.slices.viewport import Viewport

# Less than this is a click with an unsteady hand, not a drag.
DRAG_DISTANCE_PX = 3.0
# With less of its way on the screen than this, a handle that is bound to an axis follows the mouse loosely.
_LEAST_SHARE = 0.3


class BodySurface(Protocol):
    """The slice view, as far as boxes and the tool need it."""

    @property
    def viewport(self) -> Viewport | None:
        """What part of the plane is seen; None without a volume."""

    @property
    def index(self) -> int:
        """Which plane is shown."""

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The bodies in the volume, as far as they are shown."""

    def handle_under(self, x: float, y: float, radius_px: float) -> HandleMark | None:
        """Return the handle that can be taken hold of at a pixel."""


@dataclass
class BodyDrag:
    """A handle or a body that is held: it follows the cursor once the hand has moved far enough.

    Attributes
    ----------
    grabbed : HandleMark or Solid
    start : QPointF
        Where it was pressed.
    start_um : (float, float)
        The same, along the horizontal and the vertical axis of the plane: zooming does not change it.
    mode, active_part : str
        The view's, when it was pressed: what is held belongs to them.
    has_begun : bool
        Whether there is a draft of it.
    """

    grabbed: HandleMark | Solid
    start: QPointF
    start_um: tuple[float, float]
    mode: Mode
    active_part: str | None
    has_begun: bool = False

    @property
    def handle(self) -> str | None:
        """Name of the handle that is held; None where it is the body itself."""
        return self.grabbed.handle.name if isinstance(self.grabbed, HandleMark) else None

    def is_over(self, view: View) -> bool:
        """Say whether somebody else dropped or kept what is held, or turned to something else."""
        is_dropped = self.has_begun and view.draft is None
        return is_dropped or (view.mode, view.active_part) != (self.mode, self.active_part)


class BodyGrip:
    """Takes hold of handles and bodies on one slice view, and drags them within its plane.

    Parameters
    ----------
    session : Session
    surface : BodySurface
        The view.
    """

    def __init__(self, session: Session, surface: BodySurface) -> None:
        self._session = session
        self._surface = surface

    @property
    def is_refused(self) -> bool:
        """Whether a lock keeps everything that could be dragged where it is."""
        document = self._session.document
        if self._session.view.mode == "pose" and document is not None:
            return any(part.locked for part in document.parts)
        return is_active_locked(self._session)

    def take_hold(self, at: QPointF) -> BodyDrag | None:
        """Return a drag of the handle at a pixel, or of the body around it that can be moved; else None."""
        view, viewport = self._session.view, self._surface.viewport
        grabbed: HandleMark | Solid | None = self._surface.handle_under(at.x(), at.y(), GRAB_RADIUS_PX)
        if grabbed is None:
            grabbed = self._body_at(at, (solid for solid in self._surface.solids if is_handled(solid, view)))
        if grabbed is None or viewport is None:
            return None
        return BodyDrag(grabbed, at, viewport.flat_um(at.x(), at.y()), view.mode, view.active_part)

    def box_at(self, at: QPointF) -> str | None:
        """Return the link of the box around a pixel that is not the active one."""
        others = (solid for solid in self._surface.solids if solid.kind == "box" and not solid.active)
        other = self._body_at(at, others)
        return other.link if other is not None else None

    def drag(self, drag: BodyDrag, at: QPointF) -> bool:
        """Draw what is held at a pixel, as far from the plane as it was; False where the session refuses."""
        viewport, grabbed = self._surface.viewport, drag.grabbed
        if viewport is None:
            return False
        if not drag.has_begun and not is_far(at, drag.start):
            return True
        across_um, down_um = np.subtract(viewport.flat_um(at.x(), at.y()), drag.start_um)
        by_um = viewport.plane.lifted((float(across_um), float(down_um)), 0.0)
        if isinstance(grabbed, HandleMark):
            to_um = _led_um(grabbed, by_um, viewport.plane.axis)
            self._session.drag_handle(grabbed.handle.name, to_um)
        else:
            self._session.drag_body(grabbed.link, by_um)
        drag.has_begun = self._session.view.draft is not None
        return drag.has_begun

    def aimed_um(self, at: QPointF) -> Vector | None:
        """Return the position of a pixel on the plane that is seen."""
        viewport = self._surface.viewport
        if viewport is None:
            return None
        # Not through the crosshair, which may lie up to half a voxel from that plane.
        return viewport.position_um(at.x(), at.y(), viewport.plane.depth_um(self._surface.index))

    def _body_at(self, at: QPointF, bodies: Iterable[Solid]) -> Solid | None:
        position_um = self.aimed_um(at)
        return solid_around(bodies, position_um) if position_um is not None else None


def _led_um(mark: HandleMark, by_um: Vector, across: int) -> Vector:
    """Return where a handle is led, so that it stays under the mouse where it is not free.

    Parameters
    ----------
    by_um : (float, float, float)
        How far the mouse has moved, within the plane.
    across : int
        The array axis that the plane is across.
    """
    by, own = np.asarray(by_um), np.asarray(mark.handle.axis or (0.0, 0.0, 0.0))
    toward_person, within = float(own[across]), float(own @ own - own[across] ** 2)
    if mark.handle.pivot_um is not None and abs(toward_person) >= _LEAST_SHARE:
        # It goes round in the plane across its axis.
        by = by - np.eye(3)[across] * (own @ by) / toward_person
    elif mark.handle.pivot_um is None and within >= _LEAST_SHARE**2:
        by = own * (own @ by) / within
    return vector(np.add(mark.position_um, by))


def is_far(at: QPointF, start: QPointF) -> bool:
    """Say whether a hand has moved from where it pressed."""
    return math.hypot(at.x() - start.x(), at.y() - start.y()) > DRAG_DISTANCE_PX
