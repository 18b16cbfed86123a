"""The plots of errors, drawn in the background; each point opens its volume."""

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import Qt, QTimer, Slot
from PySide6.QtGui import QImage, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QComboBox, QScrollArea, QVBoxLayout, QWidget

from annotations.prediction.error_table import ErrorTable
from annotations.prediction.report.error_plots import ErrorPlot, error_plots
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.plot_picture import DrawnPlot, PlotPicture
from annotator.session import Session
from annotator.session.jobs import Job
from annotator.session.review import Review

_DPI = 96
# Narrower or wider, its letters would be on top of each other, or lost.
_LEAST_WIDTH_IN, _MOST_WIDTH_IN = 3.2, 8.0
_HEIGHT_SHARE = 0.75
_RESIZES_AFTER_MS = 200
_DRAWING = "Drawing…"
_NOTHING = "There is nothing to draw: no volume has both a prediction and an annotation that speaks for it."
_HOW = "A click on a point opens its volume; the ring is around the open one."


class ErrorPlotsPage(QWidget):
    """One plot at a time, of all the checkpoints that are loaded, on white as on paper."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("error_plots_page")
        self._session = session
        self._plots: tuple[ErrorPlot, ...] = ()
        self._reviewed: Review | None = None
        self._drawn: object = None
        self._job: Job | None = None
        self._choice = named(QComboBox(), "error_plot", title="Which plot")
        self._choice.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self._choice.currentIndexChanged.connect(self._on_choice_current_index_changed)
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
        layout.addWidget(self._choice)
        layout.addWidget(self._scroll, 1)
        layout.addWidget(self._caption)

    def draw(self) -> None:
        """Offer the plots of what was computed last, and mark the open volume."""
        review = self._session.reviewing.review
        if review is not self._reviewed:
            self._reviewed = review
            tables = _tables(review)
            self._plots = error_plots(tables, review.material.tool) if review is not None and tables else ()
            self._offer()
            self._draw_plot()
        self._picture.mark_open(self._session.reviewing.open_volume)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._draw_plot()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._resized.start()

    def _offer(self) -> None:
        chosen = self._choice.currentData()
        self._choice.blockSignals(True)
        self._choice.clear()
        for plot in self._plots:
            self._choice.addItem(plot.title, plot.key)
        self._choice.setCurrentIndex(max(self._choice.findData(chosen), 0))
        self._choice.blockSignals(False)
        self._choice.setVisible(bool(self._plots))

    @Slot(int)
    def _on_choice_current_index_changed(self, _: int) -> None:
        self._draw_plot()

    @Slot()
    def _draw_plot(self) -> None:
        place, ratio = self._choice.currentIndex(), self.devicePixelRatioF()
        width_in = float(np.clip(self._scroll.viewport().width() / _DPI, _LEAST_WIDTH_IN, _MOST_WIDTH_IN))
        wanted = (self._reviewed, place, width_in, ratio)
        if not self.isVisible() or wanted == self._drawn:
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
            lambda _progress, _cancelled: _drawn(plot, width_in, ratio),
            done=lambda drawn: self._show(plot, drawn),
            failed=self._on_job_failed,
            shown=False,
        )

    def _show(self, plot: ErrorPlot, drawn: DrawnPlot) -> None:
        self._job = None
        label = self._session.reviewing.volume_label
        self._picture.show_plot(drawn, tuple(label(volume) for volume in drawn.volumes))
        self._picture.setAccessibleDescription(plot.caption)
        self._caption.setText(f"{plot.caption} {_HOW}" if drawn.volumes else plot.caption)

    def _on_job_failed(self, error: Exception) -> None:
        self._job = None
        self._caption.setText("")
        raise error


def _tables(review: Review | None) -> Sequence[ErrorTable]:
    """Return the tables that have anything to draw, that of each checkpoint."""
    tables = () if review is None else review.material.tables
    return tuple(table for table in tables if table.rows)


def _drawn(plot: ErrorPlot, width_in: float, ratio: float) -> DrawnPlot:
    """Draw a plot, and find out where its points have come to be."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # late: half a second
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, _HEIGHT_SHARE * width_in), dpi=_DPI * ratio)
    canvas = FigureCanvasAgg(figure)
    plotted = plot.draw(figure)
    canvas.draw()
    width_px, height_px = canvas.get_width_height()
    image = QImage(canvas.buffer_rgba(), width_px, height_px, QImage.Format.Format_RGBA8888).copy()
    image.setDevicePixelRatio(ratio)
    points_px, volumes, values = [], [], []
    for points in plotted:
        right_up = points.axes.transData.transform(np.column_stack((points.x, points.y)))
        for number, (right, up) in enumerate(right_up):
            if np.isfinite((right, up)).all() and points.axes.bbox.contains(right, up):
                points_px.append((right / ratio, (height_px - up) / ratio))
                volumes.append(points.volumes[number])
                values.append(f"{points.y[number]:.3g} at {points.x[number]:.3g}")
    return DrawnPlot(image, np.array(points_px).reshape(-1, 2), tuple(volumes), tuple(values))
