"""The hand in the scene: what it points at, what it takes hold of, and where that goes along with it."""

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF, Qt

from annotations.documents.annotation import Annotation
from annotations.geometry.frames import Vector, vector
from annotator.scene.handle_paths import HandlePath, PlanePath, handle_path
from annotator.scene.picking import SPHERE_PX, Picture
from annotator.session import Session
from annotator.session.editing.handles import Handle
from annotator.session.editing.solids import Solid, SolidKind, solid_on_ray

_HANDLE_PX = 12.0
_KEYPOINT_PX = SPHERE_PX / 2 + 3
_Shape = Qt.CursorShape


@dataclass(frozen=True)
class _Grip:
    """What is held since a press, and how.

    Attributes
    ----------
    name : str
        Of the handle; of the link whose body is held.
    is_body : bool
    begin_um : (float, float, float)
        Where what is held was.
    off_px : QPointF
        From there to the cursor.
    document, mode, active_part
        Of the session then: with others there is nothing to hold on to.
    """

    name: str
    is_body: bool
    begin_um: Vector
    path: HandlePath
    off_px: QPointF
    document: Annotation | None
    mode: str
    active_part: str | None


class Hand:
    """Holds a handle, or in pose mode the body of the tool, and asks the session to move it.

    Attributes
    ----------
    pointed : Handle or None
        The handle that is held, or else the one under the cursor.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._grip: _Grip | None = None
        self._has_moved = False
        self.pointed: Handle | None = None

    @property
    def is_holding(self) -> bool:
        """Whether something is held that still follows."""
        return self._grip is not None

    def take(self, picture: Picture, at: QPointF) -> bool:
        """Take hold of what is at a place; False where a drag is to turn the camera."""
        handle = self.handle_at(picture, at)
        if handle is not None:
            self.pointed = handle
            self._hold(handle.name, handle.position_um, handle_path(handle), picture, at)
            return True
        met = self._graspable(picture, at)
        if met is None:
            return False
        solid, hit_um = met
        self._hold(solid.link, hit_um, PlanePath(hit_um), picture, at, is_body=True)
        return True

    def carry(self, picture: Picture, at: QPointF) -> None:
        """Let what is held follow to a place; what it is part of is shown so, and not yet changed."""
        self.follow_session()
        grip = self._grip
        if grip is None:
            return
        off = at - grip.off_px
        to_um = grip.path.follow(picture, off.x(), off.y())
        if grip.is_body:
            self._session.drag_body(grip.name, vector(np.subtract(to_um, grip.begin_um)))
        else:
            self._session.drag_handle(grip.name, to_um)
        self._has_moved = self._session.view.draft is not None

    def release(self) -> None:
        """Let go: where it was moved to, it stays; one edit."""
        self.follow_session()
        if self._grip is not None and self._has_moved:
            self._grip = None
            self._session.keep_draft()
        self._grip = None

    def follow_session(self) -> None:
        """Let go of what the session has dropped or changed: the next move must not bring it back."""
        grip, session = self._grip, self._session
        if grip is None:
            return
        view = session.view
        same = session.document is grip.document and view.mode == grip.mode
        if not same or view.active_part != grip.active_part or (self._has_moved and view.draft is None):
            self._grip = None

    def point(self, picture: Picture, at: QPointF | None) -> bool:
        """Point at a place, or at none; True if it is another handle than before."""
        if self._grip is not None:
            return False
        before = self.pointed
        self.pointed = self.handle_at(picture, at) if at is not None else None
        return (before and before.name) != (self.pointed and self.pointed.name)

    def handle_at(self, picture: Picture, at: QPointF) -> Handle | None:
        """Return the handle that is drawn at a place, the topmost one of several."""
        if self._session.view.overlays_hidden:
            return None
        handles = {handle.name: handle for handle in self._session.handles()}
        positions_um = {name: handle.position_um for name, handle in handles.items()}
        return handles.get(picture.topmost(positions_um, at.x(), at.y(), _HANDLE_PX) or "")

    def keypoint_at(self, picture: Picture, at: QPointF) -> str | None:
        """Return the keypoint whose sphere is drawn at a place."""
        if self._session.view.overlays_hidden:
            return None
        return picture.nearest(self._session.shown_positions_um(), at.x(), at.y(), _KEYPOINT_PX)

    def box_to_activate(self, picture: Picture, at: QPointF) -> str | None:
        """Return the link whose box is at a place where a click cannot place another end."""
        session = self._session
        document, name = session.document, session.view.active_part
        if document is None or document.method != "boxes":
            return None
        if name is not None and document.part(name).anchor_um is None:
            return None
        met = self._body_at(picture, at, "box")
        return met[0].link if met is not None else None

    def cursor(self, picture: Picture, at: QPointF | None) -> Qt.CursorShape:
        """Return the cursor that says what a press or a click at a place would do."""
        if self.is_holding:
            return _Shape.ClosedHandCursor
        if self.pointed is not None:
            return _Shape.OpenHandCursor
        mode = self._session.view.mode
        if at is None:
            return _Shape.CrossCursor if mode == "place" else _Shape.ArrowCursor
        if mode == "place":
            over_box = self.box_to_activate(picture, at) is not None
            return _Shape.PointingHandCursor if over_box else _Shape.CrossCursor
        if self.keypoint_at(picture, at) is not None:
            return _Shape.PointingHandCursor
        return _Shape.OpenHandCursor if self._graspable(picture, at) is not None else _Shape.ArrowCursor

    def _hold(
        self,
        name: str,
        position_um: Vector,
        path: HandlePath,
        picture: Picture,
        at: QPointF,
        *,
        is_body: bool = False,
    ) -> None:
        x, y, _ = picture.project([position_um])[0]
        session = self._session
        self._has_moved = False
        self._grip = _Grip(
            name,
            is_body,
            position_um,
            path,
            at - QPointF(x, y),
            session.document,
            session.view.mode,
            session.view.active_part,
        )

    def _graspable(self, picture: Picture, at: QPointF) -> tuple[Solid, Vector] | None:
        """Return the body that a press takes hold of: only in pose mode, so that else the camera turns."""
        return self._body_at(picture, at, "box", "ghost") if self._session.view.mode == "pose" else None

    def _body_at(self, picture: Picture, at: QPointF, *kinds: SolidKind) -> tuple[Solid, Vector] | None:
        if self._session.view.overlays_hidden:
            return None
        solids = (solid for solid in self._session.solids() if solid.kind in kinds)
        return solid_on_ray(solids, picture.ray(at.x(), at.y()))
