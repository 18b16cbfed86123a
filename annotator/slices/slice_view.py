"""One slice of the open volume: the image, what is annotated in it, and where the others cut it."""

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QEnterEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QRegion,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from annotations.documents.annotation import Annotation
from annotations.volumes import SliceImage, level_slice
from annotator.looks import theme
from annotator.looks.colormaps import COLORMAPS
from annotator.looks.redrawing import Redrawing
from annotator.session import Session
from annotator.session.editing.click_meaning import click_meaning
from annotator.session.editing.solids import Solid
from annotator.session.viewing.view import View
from annotator.slices.annotation_layer import AnnotationLayer
from annotator.slices.fetching import SliceFetcher
from annotator.slices.gestures import SliceGestures
from annotator.slices.guides import crosshair_rects, paint_axis_names, paint_crosshair, paint_scale_bar
from annotator.slices.handle_marks import HandleMark
from annotator.slices.header import COARSE, FAILED, Header, paint_header, plane_texts
from annotator.slices.marks import Mark
from annotator.slices.picture import SlicePicture
from annotator.slices.projection import AXIS_NAMES, Plane
from annotator.slices.readout import Readout, read_out
from annotator.slices.viewport import Area, Viewport, fitting_scale

# Dark in every theme: grey values are judged against it.
CANVAS = QColor("#16181b")
# Over images, the colours of the dark theme are the readable ones.
OVER_IMAGE = theme.colors(theme.palette(dark=True))
# A crosshair that jumps nearer to the edge than this is brought to the middle.
SIGHT_MARGIN_PX = 8.0
BORDER_PX = 2.0


class SliceView(QWidget):
    """Shows the slice across one axis at the crosshair. Draws and asks; the session decides.

    Attributes
    ----------
    axis : int
        The array axis that the slices are across.

    Signals
    -------
    cursor_moved : (float, float, float) or None, str
        Position in µm under the cursor, and the intensity there; None and no text when the cursor has left.
    scale_changed : float
        A person zoomed to this many pixels per µm.
    """

    cursor_moved = Signal(object, str)
    scale_changed = Signal(float)

    def __init__(
        self, session: Session, axis: int, fetcher: SliceFetcher, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.axis = axis
        self._session = session
        self._fetcher = fetcher
        self._viewport: Viewport | None = None
        self._index = 0
        self._image: SliceImage | None = None
        self._cursor_at: QPointF | None = None
        self._layer = AnnotationLayer(session)
        self._layer_redrawing = Redrawing(self.update, self)
        self._is_image_first = False
        self._painted_size = QSize()
        self._picture = SlicePicture(COLORMAPS, CANVAS)
        self._gestures = SliceGestures(session, self)
        self.setObjectName(f"slice_view_{axis}")
        self.setAccessibleName(f"Slice across {AXIS_NAMES[axis]}")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.PreventContextMenu)
        self.setMouseTracking(True)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        session.volume_changed.connect(self._on_session_volume_changed)
        session.levels_changed.connect(self._on_session_levels_changed)
        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.others.changed.connect(self._redraw)
        session.predicting.shown_changed.connect(self._redraw)
        fetcher.slice_arrived.connect(self._on_fetcher_slice_arrived)
        fetcher.reading_failed.connect(self.update)
        self._on_session_volume_changed()

    # What is seen

    @property
    def viewport(self) -> Viewport | None:
        """What part of the plane is seen, and how large; None without a volume."""
        return self._viewport

    @property
    def index(self) -> int:
        """Voxel index, along the axis, of the plane that is shown."""
        return self._index

    @property
    def in_plane_axes(self) -> tuple[int, int]:
        """The array axes that run to the right and downwards."""
        if self._viewport is None:
            first, second = (axis for axis in range(3) if axis != self.axis)
            return (first, second)
        return (self._viewport.plane.horizontal, self._viewport.plane.vertical)

    @property
    def is_sharp(self) -> bool:
        """Whether the image is in full resolution; so is nothing, without a volume."""
        return self._viewport is None or (self._image is not None and self._image.sharp)

    @property
    def is_fine(self) -> bool:
        """Whether the image is as sharp as the screen can show it: full resolution looks nearly alike."""
        if self.is_sharp or self._viewport is None or self._image is None:
            return self.is_sharp
        had, shown = self._image.every, self._viewport.voxels_per_pixel(self.devicePixelRatioF())
        return had is not None and had[0] <= shown[0] and had[1] <= shown[1]

    @property
    def times_drawn(self) -> int:
        """How often the image, not only what lies over it, was drawn."""
        return self._picture.times_drawn

    def fit(self) -> None:
        """Show the whole plane."""
        if self._viewport is not None:
            self._see(Viewport.fitted(self._viewport.plane, self._area()))

    def pan(self, dx: float, dy: float) -> None:
        """Move what is seen by some pixels."""
        if self._viewport is not None:
            self._see(self._viewport.panned(dx, dy))

    def zoom(self, factor: float, x: float, y: float) -> None:
        """Enlarge what is seen around a pixel, and let other views know."""
        if self._viewport is not None:
            self._see(self._viewport.zoomed(factor, x, y))
            self.scale_changed.emit(self._viewport.scale)

    def zoom_at_crosshair(self, factor: float) -> None:
        """Enlarge what is seen around the crosshair, and let other views know."""
        if self._viewport is not None:
            self.zoom(factor, *self._viewport.pixel(self._session.view.crosshair_um))

    def set_scale(self, scale: float) -> None:
        """Take over another view's pixels per µm, but never shrink the plane below its fitting size."""
        viewport = self._viewport
        if viewport is None:
            return
        fit = fitting_scale(viewport.plane, viewport.area)
        if scale <= fit:
            self.fit()
        else:
            self._see(viewport.scaled(scale, *viewport.pixel(self._session.view.crosshair_um)))
            self._bring_crosshair_in_sight()

    def center_crosshair(self) -> None:
        """Move what is seen so that the crosshair is in the middle, as far as there is plane around it."""
        if self._viewport is not None:
            self._see(self._viewport.centered(self._session.view.crosshair_um))

    def draw_annotation_apart(self) -> None:
        """If this view gets another size, draw what is annotated and predicted a turn after the rest."""
        self._is_image_first = True

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The bodies in the volume; none while overlays are hidden."""
        return self._layer.solids

    def mark_under(self, x: float, y: float, radius_px: float) -> Mark | None:
        """Return the keypoint on or near the plane within a radius of a pixel, if keypoints are shown."""
        return self._layer.mark_under(x, y, radius_px)

    def handle_under(self, x: float, y: float, radius_px: float) -> HandleMark | None:
        """Return the handle within a radius of a pixel that the mouse can take, if handles are shown."""
        return self._layer.handle_under(x, y, radius_px)

    def point_with(self, cursor: Qt.CursorShape) -> None:
        """Show a cursor."""
        if self.cursor().shape() != cursor:
            self.setCursor(cursor)

    def sizeHint(self) -> QSize:
        return QSize(480, 360)

    def minimumSizeHint(self) -> QSize:
        return QSize(160, 120)

    # What the session and the fetcher tell

    def _on_session_volume_changed(self) -> None:
        volume, spacing_um = self._session.volume, self._session.spacing_um
        self._gestures.cancel()
        self._image = None
        self._viewport = None
        if volume is not None and spacing_um is not None:
            plane = Plane.across(self.axis, volume.shape, spacing_um, volume.depth_axis)
            self._viewport = Viewport.fitted(plane, self._area())
            self._show_plane(plane.index(self._session.view.crosshair_um))
            # The image goes first: the panels have another volume to draw, too.
            self._layer_redrawing.ask_apart()
        self._redraw()
        self._tell_cursor()

    def _on_session_levels_changed(self) -> None:
        if self._image is None or self._image.every is None:
            self._take_coarse_image()
            self.update()

    def _on_session_document_changed(self, _before: Annotation | None, _after: Annotation | None) -> None:
        self._redraw()

    def _on_session_view_changed(self, before: View, after: View) -> None:
        self._gestures.follow_session()
        viewport, shown_index = self._viewport, self._index
        if self._viewport is not None:
            index = self._viewport.plane.index(after.crosshair_um)
            if index != self._index:
                self._show_plane(index)
                self._tell_cursor()
            if before.crosshair_um != after.crosshair_um and not self._gestures.is_held:
                self._bring_crosshair_in_sight()
        if self._cursor_at is not None and before.mode != after.mode:
            self._gestures.show_cursor(self._cursor_at)
        is_same_sight = self._viewport is viewport and self._index == shown_index
        if viewport is not None and is_same_sight and before.differs_in_crosshair_alone(after):
            self._move_crosshair(viewport, before, after)
        else:
            self._redraw()

    def _on_fetcher_slice_arrived(self, image: SliceImage) -> None:
        is_wanted = image.axis == self.axis and image.index == self._index and image is not self._image
        if is_wanted and self._viewport is not None and (image.sharp or not self.is_sharp):
            self._image = image
            self._tell_cursor()
            self.update()

    def _show_plane(self, index: int) -> None:
        """Take the sharp image if it is in memory, else a coarse one until the sharp one arrives."""
        self._index = index
        if self._viewport is not None:
            self.setAccessibleDescription(plane_texts(self._viewport.plane, index)[0])
        sharp = self._fetch()
        if sharp is not None:
            self._image = sharp
        else:
            self._take_coarse_image()

    def _fetch(self) -> SliceImage | None:
        """Return the sharp image if it is in memory; else it is read, what the screen can show first."""
        every = (1, 1)
        # Of what is under the cursor, the intensity is shown, too.
        if self._viewport is not None and self._cursor_at is None:
            every = self._viewport.voxels_per_pixel(self.devicePixelRatioF())
        return self._fetcher.fetch(self.axis, self._index, every)

    def _take_coarse_image(self) -> None:
        level, volume, spacing_um = self._session.slice_level, self._session.volume, self._session.spacing_um
        if level is None or volume is None or spacing_um is None:
            self._image = None
        else:
            self._image = level_slice(level, volume.shape, spacing_um, self.axis, self._index)

    # Drawing

    def paintEvent(self, _event: QPaintEvent) -> None:
        # One that waits for a turn of its own keeps it.
        is_owed = self._layer_redrawing.is_owed
        if self._is_image_first and self.size() != self._painted_size and not is_owed:
            self._layer_redrawing.ask()
        self._is_image_first, self._painted_size = False, self.size()
        painter = QPainter(self)
        viewport, view = self._viewport, self._session.view
        if viewport is None:
            painter.fillRect(self.rect(), CANVAS)
        else:
            self._paint(painter, viewport, view)
        # Not left to Python: whatever keeps this frame, and the painter in it, alive until the next garbage
        # collection, Qt does not survive it.
        painter.end()

    def _paint(self, painter: QPainter, viewport: Viewport, view: View) -> None:
        ratio = self.devicePixelRatioF()
        picture = self._picture.drawn(self._image, viewport, view.window, view.colormap, ratio)
        painter.drawImage(QPointF(), picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not view.overlays_hidden:
            self._paint_overlays(painter, viewport, view)
        if view.mode != "navigate":
            inset = BORDER_PX / 2
            painter.setPen(QPen(OVER_IMAGE.placing, BORDER_PX))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(QRectF(self.rect()).adjusted(inset, inset, -inset, -inset))

    def _paint_overlays(self, painter: QPainter, viewport: Viewport, view: View) -> None:
        if "crosshair" in view.layers:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
            paint_crosshair(painter, viewport, view.crosshair_um, OVER_IMAGE.axes)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not self._layer_redrawing.is_owed:
            self._layer.paint(painter, self._cursor_at, self._gestures.held_handle)
        if "axes" in view.layers:
            paint_axis_names(painter, viewport, OVER_IMAGE.axes)
        if "scale_bar" in view.layers:
            paint_scale_bar(painter, viewport)
        paint_header(painter, viewport.area, self._header(viewport), OVER_IMAGE)

    def _header(self, viewport: Viewport) -> Header:
        readout = self._readout()
        return Header(
            plane=plane_texts(viewport.plane, self._index),
            readout=readout.text if readout is not None else "",
            placing=click_meaning(self._session),
            remark="" if self.is_fine else FAILED if self._fetcher.is_failing else COARSE,
        )

    def _area(self) -> Area:
        return Area(0.0, 0.0, float(max(self.width(), 1)), float(max(self.height(), 1)))

    def _redraw(self) -> None:
        self._layer.show(self._viewport, self._index)
        self.update()

    def _move_crosshair(self, viewport: Viewport, before: View, after: View) -> None:
        """Draw anew only where the crosshair was and is: nothing else hangs on it while the plane stays."""
        region = QRegion()
        for view in (before, after):
            for rect in crosshair_rects(viewport, view.crosshair_um):
                region += rect.intersected(self.rect())
        self.update(region)

    def _see(self, viewport: Viewport) -> None:
        if viewport != self._viewport:
            self._viewport = viewport
            if not self.is_fine:
                self._fetch()
            self._redraw()
            self._tell_cursor()

    def _bring_crosshair_in_sight(self) -> None:
        viewport, crosshair_um = self._viewport, self._session.view.crosshair_um
        if (
            viewport is not None
            and not viewport.is_fitted
            and not viewport.shows(crosshair_um, SIGHT_MARGIN_PX)
        ):
            # A pan by hand may have led away from it; only a crosshair that moves is followed.
            self._see(viewport.centered(crosshair_um))

    # The cursor

    def _readout(self) -> Readout | None:
        viewport, at = self._viewport, self._cursor_at
        if viewport is None or at is None or not viewport.area.contains(at.x(), at.y()):
            return None
        return read_out(viewport, self._index, self._image, at.x(), at.y())

    def _tell_cursor(self) -> None:
        if self._cursor_at is None:
            return
        readout = self._readout()
        if readout is None:
            self.cursor_moved.emit(None, "")
        else:
            self.cursor_moved.emit(readout.position_um, readout.intensity)

    def _point_at(self, at: QPointF | None) -> None:
        if at is None and self._cursor_at is not None:
            self.cursor_moved.emit(None, "")
        self._cursor_at = at
        self._tell_cursor()
        self.update()

    # Events

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._gestures.press(event.position(), event.button(), event.modifiers())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        self._point_at(event.position())
        self._gestures.move(self._inside(event.position()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._gestures.release(self._inside(event.position()), event.button())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        # Not a second press: a nervous finger would place two keypoints at one spot.
        event.accept()

    def wheelEvent(self, event: QWheelEvent) -> None:
        self._gestures.wheel(event.position(), event.angleDelta(), event.modifiers())
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() != Qt.Key.Key_Escape or not self._gestures.escape():
            super().keyPressEvent(event)

    def enterEvent(self, event: QEnterEvent) -> None:
        self._point_at(event.position())
        if not self.is_sharp:
            self._fetch()
        self._gestures.show_cursor(event.position())

    def leaveEvent(self, _event: QEvent) -> None:
        self._point_at(None)

    def resizeEvent(self, _event: QResizeEvent) -> None:
        if self._viewport is not None:
            self._see(self._viewport.resized(self._area()))

    def _inside(self, at: QPointF) -> QPointF:
        """A drag that leaves the widget goes on along its edge."""
        return QPointF(*self._area().nearest(at.x(), at.y()))
