"""The scene's widget: gathers what the session says to be drawn, and tells it what was clicked."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QEvent, QPointF, Qt, QTimer, Signal, Slot
from PySide6.QtGui import (
    QCloseEvent,
    QColor,
    QImage,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QShowEvent,
)
from PySide6.QtWidgets import QVBoxLayout, QWidget

from annotations.geometry.frames import Vector, vector, voxel_to_um
from annotator.looks.windowing import dragged_window
from annotator.scene.camera import Camera, aimed, fitted, preset, shifted, turned, zoomed
from annotator.scene.colors import ground
from annotator.scene.construction import Construction
from annotator.scene.gestures import Gestures
from annotator.scene.hand import Hand
from annotator.scene.picking import Picture
from annotator.session import Session
from annotator.session.editing.keypoint_marks import keypoint_marks
from annotator.session.predictions.drawn_prediction import drawn_prediction
from annotator.session.viewing.view import Preset, View
from annotator.settings import Renderer

if TYPE_CHECKING:
    from annotator.scene.stage import SceneLook, Stage

REST_MS = 130
"""This long after the last change of the volume's picture was met it is drawn at its best: within 150 ms of
the move itself."""

_FOLLOW_MS = 80
"""Without a GPU the scene shows this long after they moved where the slices lie: they go first."""

_CLOSE_UP = 1 / 6  # of the volume's diagonal: what the picture's height shows around a keypoint
_NOWHERE = Camera((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0), 1.0, 1.0)


class SceneView(QWidget):
    """The open volume in three dimensions, with its keypoints.

    Mayavi and VTK are imported, and their scene is built, by `start` or `start_in_turns`; the second comes by
    itself once the widget has been shown.

    Signals
    -------
    started
        The Mayavi scene is there, also where it is not seen yet.
    """

    started = Signal()

    def __init__(
        self, session: Session, parent: QWidget | None = None, *, renderer: Renderer = "auto"
    ) -> None:
        super().__init__(parent)
        self.setObjectName("scene_view")
        self.setAccessibleName("3D scene")
        self.setMinimumSize(120, 90)
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._session = session
        self._construction = Construction(self, renderer, self._draw, self._take_in)
        self._construction.finished.connect(self.started)
        self._hand = Hand(session)
        self._cursor_at: QPointF | None = None
        self._camera: Camera | None = None
        self._fitted: Camera | None = None
        self._parallel = True
        self._seen: object = None
        self._is_close_up = False
        self._volume_key: object = None
        self._at_rest = False
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(REST_MS)
        self._rest.timeout.connect(self._on_rest_timeout)
        self._follow = QTimer(self)
        self._follow.setSingleShot(True)
        self._follow.setInterval(_FOLLOW_MS)
        self._follow.timeout.connect(self._redraw)
        session.volume_changed.connect(self._on_session_volume_changed)
        session.levels_changed.connect(self._on_session_levels_changed)
        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.others.changed.connect(self._redraw)
        session.predicting.shown_changed.connect(self._redraw_apart)

    # Beginning and end

    def start(self) -> None:
        """Build the Mayavi scene; does nothing where it is built already."""
        self._construction.finish()

    def start_in_turns(self) -> None:
        """Build it in turns of the event loop, between which the window answers; ``started`` follows."""
        self._construction.finish_in_turns()

    @property
    def _stage(self) -> "Stage | None":
        return self._construction.stage

    def _take_in(self, stage: "Stage") -> None:
        canvas = stage.canvas.widget
        canvas.setObjectName("scene_canvas")
        canvas.setAccessibleName("3D scene")
        self._layout.addWidget(canvas)
        self.setFocusProxy(canvas)
        gestures = Gestures(canvas, self._takes_hold)
        gestures.turn_requested.connect(self._on_gestures_turn_requested)
        gestures.carry_requested.connect(self._on_gestures_carry_requested)
        gestures.released.connect(self._on_gestures_released)
        gestures.shift_requested.connect(self._on_gestures_shift_requested)
        gestures.zoom_requested.connect(self._on_gestures_zoom_requested)
        gestures.window_requested.connect(self._on_gestures_window_requested)
        gestures.pick_requested.connect(self._on_gestures_pick_requested)
        gestures.look_requested.connect(self._on_gestures_look_requested)
        gestures.hovered.connect(self._on_gestures_hovered)
        gestures.left.connect(self._on_gestures_left)
        stage.canvas.show()
        canvas.update()

    def shut_down(self) -> None:
        """Let go of everything that Mayavi, VTK and OpenGL hold; call it before the window goes."""
        self._rest.stop()
        self._follow.stop()
        self._construction.end()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        # Before the canvas is laid out the picture has no size.
        self._layout.activate()
        if self._camera is not None and self._camera == self._fitted:
            self.zoom_to_fit()
        self._at_rest = False

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        # The window is drawn first; importing Mayavi takes seconds.
        self.start_in_turns()

    def closeEvent(self, event: QCloseEvent) -> None:
        self.shut_down()
        super().closeEvent(event)

    # The camera

    @property
    def camera(self) -> Camera | None:
        """From where the volume is seen; None where none is open."""
        return self._camera

    def look_from(self, name: Preset) -> None:
        """See the whole volume from one of the preset directions."""
        if (camera := self._preset(name)) is not None:
            self._set_camera(camera)
            self._fitted = camera
            self._is_close_up = False

    def zoom_to_fit(self) -> None:
        """See the whole volume from where the camera looks now."""
        if (box_um := self._box_um()) is not None and self._camera is not None:
            self._fitted = fitted(self._camera, *box_um, self._aspect)
            self._set_camera(self._fitted)
            self._is_close_up = False

    def zoom_to_part(self, name: str) -> None:
        """See the whole of a link's box, or a keypoint from near; does nothing where it has no place."""
        document = self._session.shown_document
        box = document.placed_boxes.get(name) if document is not None else None
        if box is None or self._camera is None:
            self.zoom_to_keypoint(name)
            return
        reach_um = np.abs(box.axes) @ box.size_um / 2
        low_um, high_um = box.center_um - reach_um, box.center_um + reach_um
        self._set_camera(fitted(self._camera, low_um, high_um, self._aspect))
        self._is_close_up = True

    def zoom_to_keypoint(self, name: str) -> None:
        """See a keypoint or a link's box in the middle and from near; does nothing where it has no place."""
        position_um = self._session.shown_anchor_um(name)
        if position_um is not None and self._camera is not None:
            near_um = min(self._camera.height_um, _CLOSE_UP * self._camera.scope_um)
            self._set_camera(aimed(self._camera, position_um, near_um))
            self._is_close_up = True

    @property
    def is_parallel(self) -> bool:
        """Whether the projection is parallel, so that one scale holds everywhere."""
        return self._parallel

    def set_parallel(self, parallel: bool) -> None:
        """Use parallel projection, in which one scale holds everywhere, or perspective."""
        self._parallel = parallel
        if self._camera is not None:
            was_fitted = self._camera == self._fitted
            self._set_camera(replace(self._camera, parallel=parallel))
            if was_fitted:
                self.zoom_to_fit()

    # The picture

    @property
    def volume_draws(self) -> int:
        """How often the volume itself was drawn, and not its kept picture."""
        return self._stage.renderers.volume_draws if self._stage else 0

    @property
    def is_at_rest(self) -> bool:
        """Whether the volume has been drawn at its best, and nothing has changed since."""
        return self._at_rest

    def picture(self) -> QImage:
        """Return the scene as it is now, at its best; works without a screen too."""
        self.start()
        if self._stage is None:
            return QImage()
        self._layout.activate()
        self._rest.stop()
        look = self._look()
        self._volume_key = self._stage.volume_key(look)
        self._stage.draw(look, self.font(), final=True)
        self._at_rest = True
        return self._stage.canvas.picture()

    def paintEvent(self, event: QPaintEvent) -> None:
        # Seen only until the canvas covers it.
        with QPainter(self) as painter:
            painter.fillRect(event.rect(), QColor.fromRgbF(*ground(self.palette())))

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() in (QEvent.Type.PaletteChange, QEvent.Type.FontChange):
            self._redraw()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape and self._session.view.is_anything_on_its_way:
            self._session.drop_preview()
        else:
            super().keyPressEvent(event)

    def _redraw(self) -> None:
        self._at_rest = False
        if self._stage is not None:
            # Any number of wishes is one frame, drawn when nothing else is to be done.
            self._stage.canvas.widget.update()

    def _redraw_apart(self) -> None:
        """Draw a turn of the event loop later: what all views show anew is painted around the scene first."""
        if self._stage is not None:
            self._stage.canvas.draw_apart()
        self._redraw()

    def _draw(self) -> None:
        """Draw a frame: coarsely while the volume's picture changes, and at its best once it rests."""
        if self._stage is None:
            return
        self._follow.stop()
        look = self._look()
        key = self._stage.volume_key(look)
        if key != self._volume_key:
            self._volume_key = key
            self._rest.start()
        self._at_rest = not self._rest.isActive()
        self._stage.draw(look, self.font(), final=self._at_rest)

    def _look(self) -> "SceneLook":
        from annotator.scene.stage import SceneLook

        session = self._session
        if self._camera is None:
            self._camera = self._fitted = self._preset("home")
            self._seen = self._sight()
        return SceneLook(
            picture=self._picture(),
            ground=ground(self.palette()),
            box_um=self._box_um(),
            level=session.level,
            view=session.view,
            tool=session.tool,
            marks=keypoint_marks(session.shown_document, session.tool, session.view),
            solids=session.solids(),
            handles=session.handles(),
            pointed=self._hand.pointed.name if self._hand.pointed is not None else None,
            others=session.others.drawn,
            differences=session.others.differences(),
            unnamed=session.others.unnamed,
            prediction=drawn_prediction(
                session.predicting.shown, session.view, session.tool, session.shown_positions_um()
            ),
        )

    def _picture(self) -> Picture:
        canvas = self._stage.canvas.widget if self._stage else self
        return Picture(self._camera or _NOWHERE, canvas.width(), canvas.height(), canvas.devicePixelRatioF())

    @property
    def _aspect(self) -> float:
        picture = self._picture()
        return picture.width_px / max(picture.height_px, 1)

    def _box_um(self) -> tuple[Vector, Vector] | None:
        """Return the outer faces of the volume's first and last voxels."""
        volume, spacing_um = self._session.volume, self._session.spacing_um
        if volume is None or spacing_um is None:
            return None
        last = [size - 0.5 for size in volume.shape]
        return vector(voxel_to_um((-0.5, -0.5, -0.5), spacing_um)), vector(voxel_to_um(last, spacing_um))

    def _preset(self, name: Preset) -> Camera | None:
        box_um, volume = self._box_um(), self._session.volume
        if box_um is None or volume is None:
            return None
        camera = preset(name, *box_um, volume.depth_axis, self._aspect)
        return fitted(replace(camera, parallel=self._parallel), *box_um, self._aspect)

    def _sight(self) -> object:
        """Return what the camera was made for: another volume that is equal in this keeps it."""
        volume = self._session.volume
        return None if volume is None else (volume.shape, self._session.spacing_um)

    def _set_camera(self, camera: Camera) -> None:
        self._camera = camera
        self._redraw()

    # What the session announces

    @Slot()
    def _on_session_volume_changed(self) -> None:
        sight = self._sight()
        # From one volume of a study to the next the camera stays.
        if sight is not None and sight != self._seen:
            self._camera, self._is_close_up = None, False
        elif sight is not None and self._is_close_up:
            # Where a part of the last volume was, there may be nothing in this one.
            self.zoom_to_fit()
        self._redraw_apart()

    @Slot()
    def _on_session_levels_changed(self) -> None:
        self._redraw()

    @Slot(object, object)
    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        self._redraw()

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        self._hand.follow_session()
        self._point()
        is_software = self._stage is not None and self._stage.is_software
        if is_software and before.differs_in_crosshair_alone(after):
            self._at_rest = False
            if not self._follow.isActive():
                self._follow.start()
        else:
            self._redraw()

    @Slot()
    def _on_rest_timeout(self) -> None:
        self._redraw()

    # What the mouse does

    @Slot(QPointF)
    def _on_gestures_turn_requested(self, moved: QPointF) -> None:
        if self._camera is not None:
            picture = self._picture()
            self._set_camera(
                turned(self._camera, moved.x() / picture.width_px, moved.y() / picture.height_px)
            )

    @Slot(QPointF)
    def _on_gestures_shift_requested(self, moved: QPointF) -> None:
        if self._camera is not None:
            um_per_px = self._picture().um_per_px
            self._set_camera(shifted(self._camera, moved.x() * um_per_px, moved.y() * um_per_px))

    @Slot(float, QPointF)
    def _on_gestures_zoom_requested(self, factor: float, at: QPointF) -> None:
        if self._camera is not None:
            self._set_camera(zoomed(self._camera, factor, *self._picture().from_middle_um(at.x(), at.y())))

    @Slot(QPointF)
    def _on_gestures_window_requested(self, moved: QPointF) -> None:
        self._session.look(window=dragged_window(self._session.view.window, moved.x(), moved.y()))

    @Slot(QPointF)
    def _on_gestures_carry_requested(self, to: QPointF) -> None:
        self._cursor_at = to
        self._hand.carry(self._picture(), to)

    @Slot()
    def _on_gestures_released(self) -> None:
        self._hand.release()
        self._point()

    @Slot(QPointF)
    def _on_gestures_pick_requested(self, at: QPointF) -> None:
        if self._camera is None:
            return
        picture, session = self._picture(), self._session
        if self._hand.handle_at(picture, at) is not None:
            return  # handles are there to be dragged
        if session.view.mode != "place":
            if (name := self._hand.keypoint_at(picture, at)) is not None:
                session.activate(name, jump=True)
        elif (link := self._hand.box_to_activate(picture, at)) is not None:
            session.activate(link)
        else:
            session.pick_ray(picture.ray(at.x(), at.y()))

    @Slot(QPointF)
    def _on_gestures_look_requested(self, at: QPointF) -> None:
        navigating = self._camera is not None and self._session.view.mode == "navigate"
        if navigating and self._hand.keypoint_at(self._picture(), at) is None:
            self._session.look_along_ray(self._picture().ray(at.x(), at.y()))

    @Slot(QPointF)
    def _on_gestures_hovered(self, at: QPointF) -> None:
        self._cursor_at = at
        self._point()

    @Slot()
    def _on_gestures_left(self) -> None:
        self._cursor_at = None
        self._point()

    def _takes_hold(self, at: QPointF) -> bool:
        taken = self._camera is not None and self._hand.take(self._picture(), at)
        self._cursor_at = at
        self._point()
        return taken

    def _point(self) -> None:
        """Mark the handle under the cursor, and show by the cursor what a press or a click would do there."""
        if self._stage is None:
            return
        picture, canvas = self._picture(), self._stage.canvas.widget
        if self._hand.point(picture, self._cursor_at):
            canvas.setToolTip(self._hand.pointed.hint if self._hand.pointed is not None else "")
            self._redraw()
        shape = self._hand.cursor(picture, self._cursor_at)
        if canvas.cursor().shape() != shape:
            canvas.setCursor(shape)
