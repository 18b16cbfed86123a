"""What the mouse does on a slice, as wishes to the session and to the view that it was done on.

Navigating never changes the annotation: only in place mode do clicks place, and drags move keypoints and
boxes; in pose mode drags move the tool.
"""

import math
from dataclasses import dataclass
from typing import Protocol

from PySide6.QtCore import QPoint, QPointF, Qt

from annotations.geometry.frames import Vector
from annotator.looks.windowing import dragged_window
from annotator.session import Session
from annotator.slices.annotation_layer import GRAB_RADIUS_PX
from annotator.slices.body_drag import BodyDrag, BodyGrip, BodySurface, is_far
from annotator.slices.marks import RADIUS_PX, Mark

NOTCH = 120
ZOOM_PER_NOTCH = 1.2
PLANES_PER_NOTCH = 1
PLANES_PER_NOTCH_SHIFT = 10


class Surface(BodySurface, Protocol):
    """The slice view, as far as gestures need it."""

    def mark_under(self, x: float, y: float, radius_px: float) -> Mark | None:
        """Return the keypoint that can be taken hold of at a pixel."""

    def pan(self, dx: float, dy: float) -> None:
        """Move what is seen by some pixels."""

    def zoom(self, factor: float, x: float, y: float) -> None:
        """Enlarge what is seen around a pixel."""

    def point_with(self, cursor: Qt.CursorShape) -> None:
        """Show a cursor."""


@dataclass(frozen=True)
class _Spent:
    """A button is held, and moving does nothing more."""


@dataclass
class _Panning:
    last: QPointF


@dataclass(frozen=True)
class _Windowing:
    start: QPointF
    window: tuple[float, float]


@dataclass
class _Aiming:
    """The crosshair follows, once the hand has moved far enough from a keypoint that was pressed."""

    start: QPointF
    following: bool


@dataclass(frozen=True)
class _Pressed:
    """A keypoint is held in place mode: a drag moves it, a click is decided on release."""

    mark: Mark
    start: QPointF


@dataclass(frozen=True)
class _Dragging:
    keypoint: str
    grip: QPointF
    through_um: float


_Hold = _Spent | _Panning | _Windowing | _Aiming | _Pressed | _Dragging | BodyDrag


class SliceGestures:
    """Turns mouse events on one slice view into wishes.

    Parameters
    ----------
    session : Session
    surface : Surface
        The view.
    """

    def __init__(self, session: Session, surface: Surface) -> None:
        self._session = session
        self._surface = surface
        self._grip = BodyGrip(session, surface)
        self._hold: _Hold | None = None
        self._button = Qt.MouseButton.NoButton
        self._notches = 0.0

    @property
    def is_held(self) -> bool:
        """Whether a button is held on the slice."""
        return self._hold is not None

    @property
    def is_dragging(self) -> bool:
        """Whether a keypoint, a handle or a body is being dragged."""
        hold = self._hold
        return isinstance(hold, _Dragging) or (isinstance(hold, BodyDrag) and hold.has_begun)

    @property
    def held_handle(self) -> str | None:
        """Name of the handle that is held."""
        return self._hold.handle if isinstance(self._hold, BodyDrag) else None

    def press(self, at: QPointF, button: Qt.MouseButton, modifiers: Qt.KeyboardModifier) -> None:
        """Begin what a button does here; while one is held, others do nothing."""
        if self._hold is not None or self._surface.viewport is None:
            return
        self._button = button
        shifted = bool(modifiers & Qt.KeyboardModifier.ShiftModifier)
        if button == Qt.MouseButton.MiddleButton or (button == Qt.MouseButton.LeftButton and shifted):
            self._hold = _Panning(at)
        elif button == Qt.MouseButton.RightButton:
            self._hold = _Windowing(at, self._session.view.window)
        elif button == Qt.MouseButton.LeftButton:
            # Held from here on: what the press changes must not move the slice under the hand.
            self._hold = _Spent()
            self._hold = self._press(at)
        self.show_cursor(at)

    def move(self, at: QPointF) -> None:
        """Go on with what the held button does; with none held, show what a click would place."""
        hold = self._hold
        if isinstance(hold, _Pressed) and is_far(at, hold.start):
            hold = self._hold = self._begin_drag(hold)
        if isinstance(hold, _Dragging):
            self._drag(hold, at)
        elif isinstance(hold, BodyDrag):
            if not self._grip.drag(hold, at):
                self._hold = _Spent()
        elif isinstance(hold, _Panning):
            self._surface.pan(at.x() - hold.last.x(), at.y() - hold.last.y())
            hold.last = at
        elif isinstance(hold, _Windowing):
            way = at - hold.start
            self._session.look(window=dragged_window(hold.window, way.x(), way.y()))
        elif isinstance(hold, _Aiming):
            hold.following = hold.following or is_far(at, hold.start)
            if hold.following:
                self._session.look(crosshair_um=self._aimed_um(at))
        elif hold is None:
            self._aim_second_end(at)
        self.show_cursor(at)

    def release(self, at: QPointF, button: Qt.MouseButton) -> None:
        """End what the held button does: a drag is kept here, once."""
        if button != self._button or self._hold is None:
            return
        hold, self._hold = self._hold, None
        if isinstance(hold, _Dragging):
            self._session.keep_preview()
        elif isinstance(hold, _Pressed):
            self._click(hold)
        elif isinstance(hold, BodyDrag):
            self._let_go(hold)
        self.show_cursor(at)

    def wheel(self, at: QPointF, turned: QPoint, modifiers: Qt.KeyboardModifier) -> None:
        """Scroll by planes, or zoom with Ctrl. Fine wheels and touchpads add up to whole planes."""
        # With Shift some platforms report a vertical wheel as a horizontal one.
        angle = turned.y() or turned.x()
        if modifiers & Qt.KeyboardModifier.ControlModifier:
            self._surface.zoom(ZOOM_PER_NOTCH ** (angle / NOTCH), at.x(), at.y())
            return
        if self._notches * angle < 0:
            self._notches = 0.0
        self._notches += angle / NOTCH
        whole = math.trunc(self._notches)
        self._notches -= whole
        if whole:
            shifted = bool(modifiers & Qt.KeyboardModifier.ShiftModifier)
            self._scroll(-whole * (PLANES_PER_NOTCH_SHIFT if shifted else PLANES_PER_NOTCH))
            if self._hold is None:
                self._aim_second_end(at)

    def escape(self) -> bool:
        """Take a drag back; False if there is none."""
        if not self.is_dragging:
            return False
        self._hold = _Spent()
        self._session.drop_preview()
        return True

    def follow_session(self) -> None:
        """End a drag whose preview somebody else dropped or kept: the next move must not bring it back."""
        view, hold = self._session.view, self._hold
        if isinstance(hold, BodyDrag):
            is_over = hold.is_over(view)
        elif isinstance(hold, _Dragging):
            is_over = view.preview is None or view.preview.keypoint != hold.keypoint
        else:
            # Who leaves place mode with the button down wants nothing dragged.
            is_over = isinstance(hold, _Pressed) and view.mode != "place"
        if is_over:
            self._hold = _Spent()

    def cancel(self) -> None:
        """Forget what a held button was doing, because what it was done to is gone."""
        self._hold = None if self._hold is None else _Spent()

    def show_cursor(self, at: QPointF) -> None:
        """Show by the cursor what is done, or what a press would do."""
        self._surface.point_with(self._cursor(at))

    def _press(self, at: QPointF) -> _Hold:
        mode, document = self._session.view.mode, self._session.document
        mark = self._surface.mark_under(at.x(), at.y(), GRAB_RADIUS_PX)
        if mode == "pose":
            return self._grip.take_hold(at) or self._press_to_navigate(at, mark)
        if mode == "navigate" or document is None:
            return self._press_to_navigate(at, mark)
        is_by_boxes = document.method == "boxes"
        return self._press_at_boxes(at, mark) if is_by_boxes else self._press_to_place(at, mark)

    def _press_to_navigate(self, at: QPointF, mark: Mark | None) -> _Hold:
        if mark is not None:
            self._session.activate(mark.name)
            return _Aiming(at, following=False)
        self._session.look(crosshair_um=self._aimed_um(at))
        return _Aiming(at, following=True)

    def _press_to_place(self, at: QPointF, mark: Mark | None) -> _Hold:
        if mark is not None:
            return _Pressed(mark, at)
        self._place(at)
        return _Spent()

    def _press_at_boxes(self, at: QPointF, mark: Mark | None) -> _Hold:
        """Place an end of the active box; once it is placed, take hold of it, or choose another one."""
        if not self._awaits_end:
            if drag := self._grip.take_hold(at):
                return drag
            if part := self._grip.box_at(at) or (mark and mark.name):
                self._session.activate(part)
                return _Spent()
        # With nothing to place, the session says why.
        self._place(at)
        return _Spent()

    def _let_go(self, drag: BodyDrag) -> None:
        """Keep a drag; a click on a body looks there, and one on a handle does nothing."""
        if drag.has_begun:
            self._session.keep_draft()
        elif drag.handle is None:
            self._session.look(crosshair_um=self._aimed_um(drag.start))

    @property
    def _awaits_end(self) -> bool:
        """Whether the next click places an end of the active box."""
        document, view = self._session.document, self._session.view
        if document is None or document.method != "boxes" or view.mode != "place":
            return False
        return any(box.link == view.active_part and box.anchor_um is None for box in document.boxes)

    def _aim_second_end(self, at: QPointF) -> None:
        """Show the box as a click here would place it."""
        aimed_um = self._grip.aimed_um(at)
        if self._awaits_end and self._session.view.first_end_um is not None and aimed_um is not None:
            self._session.aim_second_end(aimed_um)

    def _click(self, hold: _Pressed) -> None:
        """Choose the keypoint if it was hit; beside it, place the active one: neighbours lie close."""
        # Who clicks one keypoint after the other hits a neighbour by accident rather than by wish.
        awaited = self._session.view.active_part not in self._session.shown_positions_um()
        radius_px = RADIUS_PX / 2 if awaited else RADIUS_PX
        if math.hypot(hold.start.x() - hold.mark.x, hold.start.y() - hold.mark.y) > radius_px:
            self._place(hold.start)
        else:
            self._session.activate(hold.mark.name)

    def _place(self, at: QPointF) -> None:
        aimed_um = self._grip.aimed_um(at)
        if aimed_um is not None:
            self._session.place(aimed_um)

    def _begin_drag(self, hold: _Pressed) -> _Hold:
        document, viewport = self._session.document, self._surface.viewport
        if document is None or viewport is None:
            return _Spent()
        shown_um = self._session.shown_positions_um()[hold.mark.name]
        grip = QPointF(hold.mark.x, hold.mark.y) - hold.start
        if document.keypoint(hold.mark.name).locked:
            # Asked all the same: the session refuses, and says why.
            self._session.begin_preview(hold.mark.name, shown_um, "dragged")
            return _Spent()
        return _Dragging(hold.mark.name, grip, shown_um[viewport.plane.axis])

    def _drag(self, hold: _Dragging, at: QPointF) -> None:
        """Move a keypoint within the plane; its distance from the plane stays."""
        viewport = self._surface.viewport
        if viewport is not None:
            x, y = at.x() + hold.grip.x(), at.y() + hold.grip.y()
            self._session.begin_preview(hold.keypoint, viewport.position_um(x, y, hold.through_um), "dragged")

    def _aimed_um(self, at: QPointF) -> Vector:
        viewport, crosshair_um = self._surface.viewport, self._session.view.crosshair_um
        if viewport is None:
            return crosshair_um
        return viewport.position_um(at.x(), at.y(), crosshair_um[viewport.plane.axis])

    def _scroll(self, planes: int) -> None:
        viewport = self._surface.viewport
        if viewport is None:
            return
        plane, crosshair_um = viewport.plane, list(self._session.view.crosshair_um)
        index = min(max(self._surface.index + planes, 0), plane.shape[plane.axis] - 1)
        crosshair_um[plane.axis] = plane.depth_um(index)
        self._session.look(crosshair_um=tuple(crosshair_um))

    def _cursor(self, at: QPointF) -> Qt.CursorShape:
        if isinstance(self._hold, _Panning | _Windowing):
            return Qt.CursorShape.SizeAllCursor
        if self.is_dragging:
            return Qt.CursorShape.ClosedHandCursor
        document, mode = self._session.document, self._session.view.mode
        if mode == "navigate" or self._surface.viewport is None or document is None:
            return Qt.CursorShape.ArrowCursor
        if mode == "pose" or document.method == "boxes":
            return self._cursor_over_bodies(at)
        mark = self._surface.mark_under(at.x(), at.y(), GRAB_RADIUS_PX)
        if mark is None:
            return Qt.CursorShape.CrossCursor
        return Qt.CursorShape.ForbiddenCursor if mark.locked else Qt.CursorShape.OpenHandCursor

    def _cursor_over_bodies(self, at: QPointF) -> Qt.CursorShape:
        if self._awaits_end:
            return Qt.CursorShape.ForbiddenCursor if self._grip.is_refused else Qt.CursorShape.CrossCursor
        if self._grip.take_hold(at) is not None:
            return Qt.CursorShape.ForbiddenCursor if self._grip.is_refused else Qt.CursorShape.OpenHandCursor
        is_on_part = self._grip.box_at(at) or self._surface.mark_under(at.x(), at.y(), GRAB_RADIUS_PX)
        if self._session.view.mode == "place" and is_on_part:
            return Qt.CursorShape.PointingHandCursor
        return Qt.CursorShape.ArrowCursor
