"""The plots of errors, drawn in the background; each point opens its volume."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QSignalBlocker, Qt, QTimer, Slot
from PySide6.QtGui import QColor, QImage, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QScrollArea, QVBoxLayout, QWidget

from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.report.error_plots import MEAN_KEYPOINT, ErrorPlot, error_plots, plot_targets
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.widgets.plot_picture import DrawnPlot, PlotPicture
from annotator.session import Session
from annotator.session.jobs import Job
from annotator.session.predictions.review import Review

_DPI = 96
# Narrower or wider, its letters would be on top of each other, or lost.
_LEAST_WIDTH_IN, _MOST_WIDTH_IN = 3.2, 8.0
_HEIGHT_SHARE = 0.6
_WHITE, _MIDDLE = 255, 128
_BY_ROWS = "by_keypoint"
_RESIZES_AFTER_MS = 200
_DRAWING = "Drawing…"
_NOTHING = "There is nothing to draw: no volume has both a prediction and an annotation that speaks for it."
_HOW = "A click on a point opens its volume; the ring is around the open one."


class ErrorPlotsPage(QWidget):
    """One plot at a time, of all the checkpoints that are loaded, light or dark as the theme is."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("error_plots_page")
        self._session = session
        self._plots: tuple[ErrorPlot, ...] = ()
        self._reviewed: Review | None = None
        self._drawn: object = None
        self._making: Job | None = None
        self._job: Job | None = None
        self._choice = named(QComboBox(), "error_plot", title="Which plot")
        self._choice.currentIndexChanged.connect(self._on_choice_current_index_changed)
        self._target = named(QComboBox(), "error_plot_target", title="Which error")
        self._target.setToolTip("Of what the errors are drawn against anything")
        self._target.currentIndexChanged.connect(self._on_target_current_index_changed)
        for choice in (self._choice, self._target):
            # Its longest entry must not keep the panel wide.
            choice.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self._picture = named(PlotPicture(), "error_plot_picture")
        self._picture.volume_requested.connect(session.reviewing.open)
        self._scroll = named(QScrollArea(), "error_plot_scroll", title="Plot")
        self._scroll.setWidget(self._picture)
        self._scroll.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignHCenter)
        # Else a picture that just fits would come and go with its scroll bar.
        self._scroll.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
        self._caption = WrappedText(name="error_plot_caption")
        self._resized = QTimer(self)
        self._resized.setSingleShot(True)
        self._resized.setInterval(_RESIZES_AFTER_MS)
        self._resized.timeout.connect(self._draw_plot)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 4, 0, 0)
        choices = QHBoxLayout()
        choices.addWidget(self._choice, 1)
        choices.addWidget(self._target, 1)
        layout.addLayout(choices)
        layout.addWidget(self._scroll, 1)
        layout.addWidget(self._caption)

    def draw(self) -> None:
        """Offer the plots of what was computed last, once they are seen, and mark the open volume."""
        review = self._session.reviewing.review
        if review is not self._reviewed and self.isVisible():
            self._reviewed = review
            _offer(self._target, plot_targets(_tables(review)))
            self._make_plots()
        self._picture.mark_open(self._session.reviewing.open_volume)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.draw()
        self._draw_plot()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._resized.start()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._resized.start()

    def _make_plots(self) -> None:
        review, tables = self._reviewed, _tables(self._reviewed)
        targets = (self._target.currentData() or MEAN_KEYPOINT,)
        for job in (self._making, self._job):
            if job is not None:
                self._session.jobs.cancel(job)
        self._making = self._job = None
        self._plots = ()
        if review is None or not tables:
            self._take_plots(())
            return
        tool = review.material.tool
        self._caption.setText(_DRAWING)
        # Half a second: captions are counted, and legends measured.
        self._making = self._session.jobs.start(
            "Preparing the plots of errors",
            lambda _progress, _cancelled: error_plots(tables, tool, targets),
            done=self._take_plots,
            failed=self._on_making_failed,
            cancelled=self._on_making_cancelled,
            shown=False,
        )

    def _take_plots(self, plots: tuple[ErrorPlot, ...]) -> None:
        self._making = None
        self._plots = plots
        _offer(self._choice, {plot.key: plot.title for plot in self._plots})
        for choice in (self._choice, self._target):
            choice.setVisible(bool(self._plots))
        self._drawn = None
        self._draw_plot()

    @Slot(int)
    def _on_target_current_index_changed(self, _: int) -> None:
        self._make_plots()

    @Slot(int)
    def _on_choice_current_index_changed(self, _: int) -> None:
        self._draw_plot()

    @Slot()
    def _draw_plot(self) -> None:
        place, ratio = self._choice.currentIndex(), self.devicePixelRatioF()
        room = self._scroll.viewport()
        width_in = float(np.clip(room.width() / _DPI, _LEAST_WIDTH_IN, _MOST_WIDTH_IN))
        # As high as looks well, and no higher than is seen at once.
        size_in = (width_in, min(_HEIGHT_SHARE * width_in, room.height() / _DPI))
        ground = self.palette().base().color()
        wanted = (self._reviewed, place, size_in, ratio, ground.rgb())
        if self._making is not None or not self.isVisible() or wanted == self._drawn:
            return
        self._drawn = wanted
        if self._job is not None:
            self._session.jobs.cancel(self._job)
            self._job = None
        if not 0 <= place < len(self._plots):
            self._picture.show_plot(None)
            self._caption.setText(_NOTHING)
            return
        plot = self._plots[place]
        self._caption.setText(_DRAWING)
        self._job = self._session.jobs.start(
            f"Drawing “{plot.title}”",
            lambda _progress, _cancelled: _drawn(plot, size_in, ratio, ground),
            done=lambda drawn: self._show(plot, drawn),
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
            shown=False,
        )

    def _show(self, plot: ErrorPlot, drawn: DrawnPlot) -> None:
        self._job = None
        label = self._session.reviewing.volume_label
        self._picture.show_plot(drawn, tuple(label(volume) for volume in drawn.volumes))
        self._picture.setAccessibleDescription(plot.caption)
        self._caption.setText(f"{plot.caption} {_HOW}" if drawn.volumes else plot.caption)

    def _on_making_failed(self, error: Exception) -> None:
        self._give_up_making()
        raise error

    def _on_making_cancelled(self) -> None:
        # By a person: where other plots take the place of some, that is no end.
        if self._making is not None and self._making.state == "cancelled":
            self._give_up_making()

    def _on_job_cancelled(self) -> None:
        if self._job is not None and self._job.state == "cancelled":
            self._job = self._drawn = None
            self._caption.setText("")

    def _give_up_making(self) -> None:
        # Whoever comes back has them made again.
        self._making = self._reviewed = None
        _offer(self._choice, {})
        self._caption.setText("")

    def _on_job_failed(self, error: Exception) -> None:
        self._job = None
        self._caption.setText("")
        raise error


def _tables(review: Review | None) -> Sequence[ErrorTable]:
    """Return the tables that have anything to draw, that of each checkpoint."""
    tables = () if review is None else review.material.tables
    return tuple(table for table in tables if table.rows)


def _offer(choice: QComboBox, entries: Mapping[str, str]) -> None:
    """Offer entries by what they stand for, and keep the one that is chosen where it is among them."""
    chosen = choice.currentData()
    with QSignalBlocker(choice):
        choice.clear()
        for data, title in entries.items():
            choice.addItem(title, data)
        choice.setCurrentIndex(max(choice.findData(chosen), 0))


def _drawn(plot: ErrorPlot, size_in: tuple[float, float], ratio: float, ground: QColor) -> DrawnPlot:
    """Draw a plot, and find out where its points have come to be."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # late: half a second
    from matplotlib.figure import Figure

    width_in, height_in = size_in
    figure = Figure(figsize=(width_in, max(plot.size_in[1], height_in)), dpi=_DPI * ratio)
    canvas = FigureCanvasAgg(figure)
    plotted = plot.draw(figure)
    canvas.draw()
    width_px, height_px = canvas.get_width_height()
    pixels = np.array(canvas.buffer_rgba())
    if ground.lightness() < _MIDDLE:
        _darken(pixels, ground)
    image = QImage(pixels.data, width_px, height_px, QImage.Format.Format_RGBA8888).copy()
    image.setDevicePixelRatio(ratio)
    points_px, volumes, values = [], [], []
    for points in plotted:
        right_up = points.axes.transData.transform(np.column_stack((points.x, points.y)))
        for number, (right, up) in enumerate(right_up):
            if np.isfinite((right, up)).all() and points.axes.bbox.contains(right, up):
                points_px.append((right / ratio, (height_px - up) / ratio))
                volumes.append(points.volumes[number])
                # What is upwards has its unit in the title; a keypoint's row is no number.
                upwards = f"{points.axes.get_title()} {points.y[number]:.3g}"
                to_the_right = f"{points.axes.get_xlabel()} {points.x[number]:.3g}"
                values.append(to_the_right if plot.key == _BY_ROWS else f"{upwards}, {to_the_right}")
    return DrawnPlot(image, np.array(points_px).reshape(-1, 2), tuple(volumes), tuple(values))


def _darken(pixels: NDArray[np.uint8], ground: QColor) -> None:
    """Turn a drawing on white into one on a dark ground, in place: dark becomes light, of the same hue.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (H, W, 4)
        Red, green, blue and opacity.
    ground : QColor
        What white becomes.
    """
    colors = pixels[..., :3].astype(np.float32)
    # Lightness is the mean of the largest and the smallest of the three.
    colors += _WHITE - colors.max(axis=-1, keepdims=True) - colors.min(axis=-1, keepdims=True)
    lowest = np.array([ground.red(), ground.green(), ground.blue()], np.float32)
    pixels[..., :3] = (lowest + colors * (1 - lowest / _WHITE)).round().astype(np.uint8)
