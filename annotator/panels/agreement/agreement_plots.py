"""The plots of a comparison, drawn in the background as the report has them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QRect, Qt, Slot
from PySide6.QtGui import QFont, QFontMetrics, QImage, QPainter, QPixmap, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QComboBox, QLabel, QScrollArea, QVBoxLayout, QWidget

from annotations.agreement.results import Agreement
from annotations.documents.record import Method
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.session import Session
from annotator.session.jobs import Job

if TYPE_CHECKING:
    from annotations.agreement.report.contents import Photo, Plot

PLOTS = {
    "annotators": "Per annotator: deviation",
    "bias": "Per annotator: bias",
    "keypoints": "Per keypoint",
    "bland_altman": "Bland–Altman",
    "volumes": "Spread over the volumes",
    "statistics": "The three statistics",
    "worst": "Worst volumes",
}
_LEAST_DPI = 96
_CAPTION_LETTER_IN = 0.125
_ANY_HEIGHT_PX = 10_000
# Of its size on paper: smaller, its letters could not be read.
_LEAST_SHARE = 0.55
_DRAWING = "Drawing…"
_NONE = "There is nothing to draw: it needs volumes that two annotators have done."


class AgreementPlots(QWidget):
    """One plot at a time, on white as on paper, in an area that scrolls."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._result: Agreement | None = None
        self._method: Method = "keypoints"
        self._drawn: object = None
        self._job: Job | None = None
        self._choice = named(QComboBox(), "agreement_plot", title="Which plot")
        for name, title in PLOTS.items():
            self._choice.addItem(title, name)
        self._choice.currentIndexChanged.connect(self._on_choice_current_index_changed)
        self._picture = named(QLabel(), "agreement_plot_picture")
        self._picture.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
        self._image: QImage | None = None
        self._scroll = named(QScrollArea(), "agreement_plot_scroll", title="Plot")
        self._scroll.setWidget(self._picture)
        self._scroll.setWidgetResizable(True)
        # Else a picture that just fits would come and go with its scroll bar.
        self._scroll.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
        self._caption = WrappedText(name="agreement_plot_caption")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 4, 0, 0)
        layout.addWidget(self._choice)
        layout.addWidget(self._scroll, 1)
        layout.addWidget(self._caption)

    def show_result(self, result: Agreement | None, method: Method) -> None:
        """Draw the chosen plot of a result, once it is seen."""
        self._result, self._method = result, method
        # Pictures of volumes would tell what they are.
        worst = self._choice.findData("worst")
        if self._session.agreeing.is_blind and worst >= 0:
            self._choice.removeItem(worst)
        self._draw()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._draw()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._draw()

    @Slot()
    def _on_choice_current_index_changed(self) -> None:
        self._draw()

    def _draw(self) -> None:
        wanted = (self._result, self._method, self._choice.currentData(), self.devicePixelRatioF())
        if not self.isVisible() or wanted == self._drawn:
            return
        self._drawn = wanted
        if self._job is not None:
            self._session.jobs.cancel(self._job)
            self._job = None
        self._picture.clear()
        self._image = None
        result, method, kind, ratio = self._result, self._method, self._choice.currentData(), wanted[3]
        folder = self._session.agreeing.folder
        if result is None or method not in result.methods or folder is None:
            self._caption.setText(_NONE)
            return
        self._caption.setText(_DRAWING)

        def work(_progress: Callable[[float], None], cancelled: Callable[[], bool]) -> "_Drawn":
            return _drawn(_plots(result, method, kind, folder, cancelled), _LEAST_DPI * ratio)

        self._job = self._session.jobs.start(
            f"Drawing “{PLOTS[kind]}”",
            work,
            done=self._on_job_done,
            failed=self._on_job_failed,
            shown=False,
        )

    def _on_job_done(self, drawn: "_Drawn") -> None:
        self._job = None
        image, caption = drawn
        self._caption.setText(caption or _NONE)
        if image is not None:
            self._picture.setAccessibleDescription(caption)
        self._image = image
        self._fit()

    def _fit(self) -> None:
        """Show the picture as wide as the panel, but never so small that it cannot be read."""
        if self._image is None:
            return
        ratio = self.devicePixelRatioF()
        room_px = round(self._scroll.viewport().width() * ratio)
        width_px = min(self._image.width(), max(room_px, round(_LEAST_SHARE * self._image.width())))
        if self._picture.pixmap().width() == width_px:
            return
        fitted = self._image.scaledToWidth(width_px, Qt.TransformationMode.SmoothTransformation)
        fitted.setDevicePixelRatio(ratio)
        self._picture.setPixmap(QPixmap.fromImage(fitted))

    def _on_job_failed(self, error: Exception) -> None:
        self._job = None
        self._caption.setText("")
        raise error


_Drawn = tuple[QImage | None, str]


def _plots(
    result: Agreement, method: Method, kind: str, folder: Path, cancelled: Callable[[], bool]
) -> "Sequence[Plot | Photo]":
    # Late: half a second that only those wait for who look at plots.
    from annotations.agreement.report import plots
    from annotations.agreement.report.bland_altman_plot import bland_altman_plot
    from annotations.agreement.report.thumbnails import thumbnails

    match kind:
        case "annotators":
            return (plots.deviation_plot(result, method),)
        case "bias":
            return (plots.bias_plot(result, method),)
        case "keypoints":
            return (plots.keypoints_plot(result, method),)
        case "volumes":
            return (plots.volumes_plot(result),)
        case "statistics":
            return (plots.statistics_plot(result),)
        case "bland_altman":
            plot = bland_altman_plot(result, method)
            return (plot,) if plot is not None else ()
        case _:
            return thumbnails(result, method, folder, lambda _share: None, cancelled)


def _drawn(plots: "Sequence[Plot | Photo]", dpi: float) -> _Drawn:
    """Return plots as one picture, and what they say; several have their captions above them."""
    if not plots:
        return None, ""
    pages = [_page(plot, dpi) for plot in plots]
    if len(plots) == 1:
        return pages[0], plots[0].caption
    width = max(page.width() for page in pages)
    font = QFont()
    font.setPixelSize(round(_CAPTION_LETTER_IN * dpi))
    margin_px = round(_CAPTION_LETTER_IN * dpi / 2)
    wrapped = Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap
    room = QRect(0, 0, width - 2 * margin_px, _ANY_HEIGHT_PX)
    heights_px = [
        QFontMetrics(font).boundingRect(room, wrapped, plot.caption).height() + 2 * margin_px
        for plot in plots
    ]
    height_px = sum(page.height() for page in pages) + sum(heights_px)
    image, top = QImage(width, height_px, QImage.Format.Format_RGB32), 0
    image.fill(Qt.GlobalColor.white)
    with QPainter(image) as painter:
        painter.setFont(font)
        painter.setPen(Qt.GlobalColor.black)
        for plot, page, caption_px in zip(plots, pages, heights_px, strict=True):
            area = QRect(margin_px, top + margin_px, room.width(), caption_px - 2 * margin_px)
            painter.drawText(area, wrapped, plot.caption)
            painter.drawImage(0, top + caption_px, page)
            top += page.height() + caption_px
    return image, f"{len(plots)} volumes, the worst first."


def _page(shown: "Plot | Photo", dpi: float) -> QImage:
    from annotations.agreement.report.contents import Photo
    from annotations.agreement.report.pictures import picture_bytes

    png = shown.png if isinstance(shown, Photo) else picture_bytes(shown.size_in, shown.draw, "png")
    width_px = round(shown.size_in[0] * dpi)
    return QImage.fromData(png).scaledToWidth(width_px, Qt.TransformationMode.SmoothTransformation)
