"""What a network sees of a volume, and where it has the tool: three projections, painted at each frame."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, link_boxes
from annotations.geometry.meshes import Mesh, box_mesh
from annotations.geometry.silhouette import silhouette_um
from annotations.geometry.tool import ToolSpecification
from annotations.prediction.live.frame import LiveFrame
from annotator.dialogs.live.live_layout import AXIS_NAMES, Pane, panes
from annotator.looks.scale_bar import length_text, round_length_um

_GROUND = QColor("#0c0d0f")
_INK = QColor("#f2f2f2")
_SHADE = QColor(0, 0, 0, 150)
_OUTSIDE = QColor("#dda2f0")
_ALARM = QColor("#b3261e")
_GAP_PX = 10.0
_MARGIN_PX = 8.0
_RADIUS_PX = 4.0
_TOGETHER_PX = 16.0
"""Within which keypoints share a label."""
_LONGEST_BAR = 0.3
_DARKEST, _BRIGHTEST = 0.2, 0.998
"""Which share of the projections is black, and which is not white."""
_SLOWNESS = 0.9
"""How much of the last frame's black and white stays, so that speckle does not make the pictures flicker."""


class LiveProjections(QWidget):
    """Paints a frame: the brightest sample along each axis, keypoints, links, and the outline of the tool."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._frame: LiveFrame | None = None
        self._tool: ToolSpecification | None = None
        self._bodies: Mapping[str, Mesh] = {}
        self._limits: tuple[float, float] | None = None
        self._words = ""
        self._note = ""
        self._was_painted = False
        self.setObjectName("live_projections")
        self.setAccessibleName("What the network sees, along each axis")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)

    @property
    def frame(self) -> LiveFrame | None:
        """The frame that is shown."""
        return self._frame

    @property
    def warning(self) -> str:
        """Which keypoints are not in the volume; empty where all are."""
        return "" if self._frame is None else _warning(self._frame)

    def sizeHint(self) -> QSize:
        return QSize(760, 470)

    def minimumSizeHint(self) -> QSize:
        return QSize(320, 200)

    def show_frame(self, frame: LiveFrame, tool: ToolSpecification) -> bool:
        """Paint a frame at once; False where nothing was painted, as in a window that is not to be seen."""
        self._frame, self._tool = frame, tool
        self._bodies = _told_bodies(frame, tool)
        self._limits = _limits(frame, self._limits)
        self.setAccessibleDescription(self.warning)
        self._was_painted = False
        # Now, rather than with the next round of events: this is what latency is measured by.
        self.repaint()
        return self._was_painted

    def show_words(self, words: str) -> None:
        """Say something where no frame is shown yet."""
        self._words = words
        self.update()

    @property
    def note(self) -> str:
        """What is said over the frame that is shown."""
        return self._note

    def show_note(self, note: str) -> None:
        """Say over the frame why it is not the newest; empty where it is."""
        if note != self._note:
            self._note = note
            self.update()

    def clear(self) -> None:
        """Show no frame."""
        self._frame, self._limits = None, None
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), _GROUND)
        if self._frame is None or self._tool is None or self._limits is None:
            painter.setPen(_INK)
            room = QRectF(self.rect()).adjusted(_MARGIN_PX, _MARGIN_PX, -_MARGIN_PX, -_MARGIN_PX)
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(room, int(flags), self._words)
            return
        frame = self._frame
        grid = frame.projections[1].shape[0], frame.projections[0].shape[0], frame.projections[0].shape[1]
        room = QRectF(self.rect()).adjusted(_MARGIN_PX, _MARGIN_PX, -_MARGIN_PX, -_MARGIN_PX)
        low_um, extent_um = _edges_um(frame, grid)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        for pane in panes(low_um, extent_um, frame.depth_axis, room, _GAP_PX):
            self._paint_pane(painter, pane, frame)
        painter.setClipping(False)
        self._paint_warning(painter, frame)
        self._paint_note(painter)
        self._was_painted = True

    def _paint_pane(self, painter: QPainter, pane: Pane, frame: LiveFrame) -> None:
        assert self._limits is not None
        assert self._tool is not None
        # Predicted places just outside of what the network sees are drawn in the gap.
        half = _GAP_PX / 2
        painter.setClipRect(pane.area.adjusted(-half, -half, half, half).toAlignedRect())
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        values = frame.projections[pane.axis]
        painter.drawImage(
            pane.area, _image(values.T if pane.vertical > pane.horizontal else values, self._limits)
        )
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._paint_tool(painter, pane)
        self._paint_keypoints(painter, pane, frame)
        self._paint_guides(painter, pane, frame)

    def _paint_tool(self, painter: QPainter, pane: Pane) -> None:
        assert self._tool is not None
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for link in self._tool.links:
            body = self._bodies.get(link.name)
            if body is None:
                continue
            outline_px = pane.pixels(silhouette_um(body, (pane.horizontal, pane.vertical)))
            outline = QPolygonF([QPointF(x, y) for x, y in outline_px.tolist()])
            painter.setPen(QPen(QColor(link.color), 1.5))
            painter.drawPolygon(outline)

    def _paint_keypoints(self, painter: QPainter, pane: Pane, frame: LiveFrame) -> None:
        assert self._tool is not None
        places = {
            keypoint.name: pane.pixel(keypoint.position_um)
            for keypoint in frame.keypoints
            if keypoint.position_um is not None
        }
        for link in self._tool.links:
            if link.base in places and link.tip in places:
                painter.setPen(QPen(QColor(link.color), 2.5))
                painter.drawLine(QLineF(places[link.base], places[link.tip]))
        for keypoint in frame.keypoints:
            if keypoint.name not in places:
                continue
            color = _INK if keypoint.state == "placed" else _OUTSIDE
            painter.setPen(QPen(QColor(0, 0, 0), 1.0))
            painter.setBrush(color)
            painter.drawEllipse(places[keypoint.name], _RADIUS_PX, _RADIUS_PX)
        # As far as is painted at all.
        right_px = pane.area.right() + _GAP_PX / 2 - 2
        for names, place in _labels(places):
            width_px = painter.fontMetrics().horizontalAdvance(names)
            beside = place + QPointF(_RADIUS_PX + 2, -_RADIUS_PX - 2)
            if beside.x() + width_px > right_px:
                beside.setX(place.x() - _RADIUS_PX - 2 - width_px)
            _paint_text(painter, beside, names, _INK)

    def _paint_guides(self, painter: QPainter, pane: Pane, frame: LiveFrame) -> None:
        area = pane.area
        along = "from the scanner" if pane.axis == frame.depth_axis else f"along {AXIS_NAMES[pane.axis]}"
        text = f"{AXIS_NAMES[pane.horizontal]} →  {AXIS_NAMES[pane.vertical]} ↓   {along}"
        metrics = painter.fontMetrics()
        if metrics.horizontalAdvance(text) > area.width() - 8:
            text = f"{AXIS_NAMES[pane.horizontal]} →  {AXIS_NAMES[pane.vertical]} ↓"
        _paint_text(painter, area.topLeft() + QPointF(4, metrics.ascent() + 4), text, _INK)
        length_um = round_length_um(area.width() * _LONGEST_BAR / pane.scale)
        right, lower = area.right() - 8, area.bottom() - 8
        left = right - length_um * pane.scale
        painter.setPen(QPen(_INK, 2.0))
        painter.drawLine(QLineF(left, lower, right, lower))
        words = length_text(length_um)
        middle = (left + right - metrics.horizontalAdvance(words)) / 2
        _paint_text(painter, QPointF(middle, lower - 6), words, _INK)

    def _paint_warning(self, painter: QPainter, frame: LiveFrame) -> None:
        words = _warning(frame)
        if not words:
            return
        height = painter.fontMetrics().height() + 8.0
        _paint_banner(painter, QRectF(0, self.height() - height, self.width(), height), _ALARM, words)

    def _paint_note(self, painter: QPainter) -> None:
        if not self._note:
            return
        painter.fillRect(self.rect(), _SHADE)
        height = 2.0 * painter.fontMetrics().height()
        middle = QRectF(0, (self.height() - height) / 2, self.width(), height)
        _paint_banner(painter, middle, _GROUND, self._note)


def _edges_um(frame: LiveFrame, grid: tuple[int, int, int]) -> tuple[Vector, Vector]:
    """Return the lower corner and the size of the samples, their outer halves included."""
    low = [origin - spacing / 2 for origin, spacing in zip(frame.origin_um, frame.spacing_um, strict=True)]
    size = [count * spacing for count, spacing in zip(grid, frame.spacing_um, strict=True)]
    return (low[0], low[1], low[2]), (size[0], size[1], size[2])


def _told_bodies(frame: LiveFrame, tool: ToolSpecification) -> Mapping[str, Mesh]:
    """Return the bodies of the links of which the fitted pose tells the place."""
    if frame.pose is None:
        return {}
    told = frame.pose.keypoints_um
    pose = ToolPose(frame.pose.position_um, frame.pose.rotation_wxyz, frame.pose.angles_deg)
    links = {name: (tool.link(name), box) for name, box in link_boxes(pose, tool).items()}
    return {
        name: box_mesh(box, is_round=link.is_round)
        for name, (link, box) in links.items()
        if link.base in told and link.tip in told
    }


def _limits(frame: LiveFrame, before: tuple[float, float] | None) -> tuple[float, float]:
    """Return the values that are drawn black and white."""
    values = np.concatenate([picture.ravel() for picture in frame.projections])
    shares = np.bincount(values, minlength=256).cumsum() / len(values)
    low, high = (float(value) for value in np.searchsorted(shares, (_DARKEST, _BRIGHTEST)))
    if before is not None:
        low, high = (
            _SLOWNESS * old + (1 - _SLOWNESS) * new for old, new in zip(before, (low, high), strict=True)
        )
    return low, max(high, low + 1)


def _image(values: NDArray[np.uint8], limits: tuple[float, float]) -> QImage:
    low, high = limits
    shades = np.clip((np.arange(256) - low) * (255 / (high - low)), 0, 255).astype(np.uint32)
    # As colours, though grey: only those are scaled up quickly.
    shown = np.ascontiguousarray((0xFF000000 | shades * 0x010101)[values], dtype=np.uint32)
    rows, columns = shown.shape
    # A copy: the image itself only looks at the array's memory.
    return QImage(shown.data, columns, rows, 4 * columns, QImage.Format.Format_RGB32).copy()


def _labels(places: Mapping[str, QPointF]) -> list[tuple[str, QPointF]]:
    """Return what is written where: keypoints that lie together have one label."""
    labels: list[tuple[str, QPointF]] = []
    for name, place in places.items():
        for number, (names, other) in enumerate(labels):
            if abs(other.x() - place.x()) < _TOGETHER_PX and abs(other.y() - place.y()) < _TOGETHER_PX:
                labels[number] = (f"{names} {name}", other)
                break
        else:
            labels.append((name, place))
    return labels


def _paint_text(painter: QPainter, place: QPointF, text: str, color: QColor) -> None:
    """Write with the left end of its base line at a place, readable on any ground."""
    metrics = painter.fontMetrics()
    ground = QRectF(
        place.x() - 2, place.y() - metrics.ascent(), metrics.horizontalAdvance(text) + 4, metrics.height()
    )
    painter.fillRect(ground, _SHADE)
    painter.setPen(color)
    painter.drawText(place, text)


def _paint_banner(painter: QPainter, banner: QRectF, ground: QColor, words: str) -> None:
    font = painter.font()
    font.setBold(True)
    painter.setFont(font)
    painter.fillRect(banner, ground)
    painter.setPen(QColor("#ffffff"))
    shown = painter.fontMetrics().elidedText(words, Qt.TextElideMode.ElideRight, int(banner.width()) - 16)
    painter.drawText(banner, Qt.AlignmentFlag.AlignCenter, shown)


def _warning(frame: LiveFrame) -> str:
    unseen = [keypoint.name for keypoint in frame.keypoints if keypoint.state == "unplaced"]
    outside = [keypoint.name for keypoint in frame.keypoints if keypoint.state == "out_of_view"]
    parts = []
    if unseen:
        parts.append(f"Not seen: {', '.join(unseen)}")
    if outside:
        parts.append(f"Outside the volume: {', '.join(outside)}")
    return ".  ".join(parts)
