"""What is annotated, as one slice shows it: drawn over the image, and found under the mouse."""

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QPainter

from annotator.session import Session
from annotator.session.editing.solids import Solid
from annotator.session.predictions.drawn_prediction import drawn_prediction
from annotator.slices.handle_marks import HandleMark, handle_marks, handle_under
from annotator.slices.handle_painting import paint_handles, paint_hint
from annotator.slices.marks import Mark, mark_under, marks
from annotator.slices.others_painting import (
    OtherMark,
    OtherOutline,
    other_marks,
    other_outlines,
    paint_differences,
    paint_other_marks,
    paint_other_outlines,
)
from annotator.slices.outline_painting import paint_outlines
from annotator.slices.overlays import paint_links, paint_marks
from annotator.slices.prediction_painting import PredictionPainter
from annotator.slices.solid_outlines import SolidOutline, solid_outlines
from annotator.slices.viewport import Viewport

GRAB_RADIUS_PX = 8.0
"""A press this near to a handle or a keypoint takes hold of it."""


class AnnotationLayer:
    """Keypoints, links, bodies and handles on one slice, one's own over the other annotators'.

    A prediction lies partly under one's own, and partly over it.

    All is worked out once for each state that is drawn; the mouse meets one's own alone.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._viewport: Viewport | None = None
        self._index = 0
        self._solids: tuple[Solid, ...] | None = None
        self._marks: tuple[Mark, ...] | None = None
        self._outlines: tuple[SolidOutline, ...] | None = None
        self._handles: tuple[HandleMark, ...] | None = None
        self._others: tuple[tuple[OtherMark, ...], tuple[OtherOutline, ...]] | None = None
        self._prediction: PredictionPainter | None = None

    def show(self, viewport: Viewport | None, index: int) -> None:
        """Show what there is now on a part of the plane with an index."""
        self._viewport, self._index = viewport, index
        self._solids = self._marks = self._outlines = self._handles = self._others = self._prediction = None

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The bodies in the volume; none while overlays are hidden."""
        if self._session.view.overlays_hidden or self._viewport is None:
            return ()
        if self._solids is None:
            self._solids = self._session.solids()
        return self._solids

    def mark_under(self, x: float, y: float, radius_px: float) -> Mark | None:
        """Return the keypoint on or near the plane within a radius of a pixel, if keypoints are shown."""
        return mark_under(self._shown_marks(), x, y, radius_px)

    def handle_under(self, x: float, y: float, radius_px: float) -> HandleMark | None:
        """Return the handle within a radius of a pixel that the mouse can take, if handles are shown."""
        return handle_under(self._shown_handles(), x, y, radius_px)

    def paint(self, painter: QPainter, cursor_at: QPointF | None, held: str | None) -> None:
        """Draw it all.

        Parameters
        ----------
        cursor_at : QPointF or None
            Where the mouse is over the slice.
        held : str or None
            Name of the handle that is held.
        """
        viewport, tool, view = self._viewport, self._session.tool, self._session.view
        if viewport is None or view.overlays_hidden:
            return
        names = "names" in view.layers
        prediction = self._shown_prediction(viewport)
        if prediction is not None:
            prediction.paint_beneath(painter)
        initials = self._paint_others(painter, viewport)
        paint_outlines(painter, self._shown_outlines(viewport), names=names, posing=view.mode == "pose")
        if "links" in view.layers and tool is not None:
            paint_links(painter, viewport, self._index, tool, self._session.shown_positions_um())
        unnamed = prediction.named if prediction is not None else frozenset()
        named = paint_marks(painter, self._shown_marks(), names=names, unnamed=unnamed)
        if prediction is not None:
            prediction.paint_above(painter, (*named, *initials))
            if view.maximized is not None:
                # Otherwise the scene says it.
                prediction.paint_legend(painter)
        pointed = None
        if cursor_at is not None and held is None:
            pointed = self.handle_under(cursor_at.x(), cursor_at.y(), GRAB_RADIUS_PX)
        name = pointed.handle.name if pointed is not None else None
        paint_handles(painter, self._shown_handles(), pointed_at=name, held=held)
        if pointed is not None:
            paint_hint(painter, viewport.area, pointed)

    def _paint_others(self, painter: QPainter, viewport: Viewport) -> list[QRectF]:
        """Draw the others' work, and return what their initials cover."""
        others = self._session.others
        if not others.drawn:
            return []
        if self._others is None:
            self._others = (
                other_marks(others.drawn, viewport, self._index),
                other_outlines(others.drawn, viewport, self._index),
            )
        marks, outlines = self._others
        paint_other_outlines(painter, outlines)
        paint_differences(painter, viewport, self._index, others.differences())
        return paint_other_marks(painter, marks, viewport.area, others.unnamed)

    def _shown_prediction(self, viewport: Viewport) -> PredictionPainter | None:
        if self._prediction is None:
            session = self._session
            drawn = drawn_prediction(
                session.predicting.shown, session.view, session.tool, session.shown_positions_um()
            )
            if drawn is not None:
                self._prediction = PredictionPainter(drawn, viewport, self._index)
        return self._prediction

    def _shown_marks(self) -> tuple[Mark, ...]:
        if self._session.view.overlays_hidden or self._viewport is None:
            return ()
        if self._marks is None:
            self._marks = marks(self._session, self._viewport, self._index)
        return self._marks

    def _shown_outlines(self, viewport: Viewport) -> tuple[SolidOutline, ...]:
        if self._outlines is None:
            self._outlines = solid_outlines(self.solids, viewport, self._index)
        return self._outlines

    def _shown_handles(self) -> tuple[HandleMark, ...]:
        if self._session.view.overlays_hidden or self._viewport is None:
            return ()
        if self._handles is None:
            handles, view = self._session.handles(), self._session.view
            self._handles = handle_marks(handles, self.solids, view, self._viewport, self._index)
        return self._handles
