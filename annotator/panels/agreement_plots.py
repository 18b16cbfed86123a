"""The plots of a comparison, drawn in the background as the report has them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QRectF, Qt, Slot
from PySide6.QtGui import QFont, QImage, QPainter, QPixmap, QShowEvent
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
_CAPTION_IN, _CAPTION_LETTER_IN = 0.9, 0.125
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
        scroll = QScrollArea()
        scroll.setObjectName("agreement_plot_scroll")
        scroll.setWidget(self._picture)
        scroll.setWidgetResizable(True)
        self._caption = WrappedText(name="agreement_plot_caption")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 4, 0, 0)
        layout.addWidget(self._choice)
        layout.addWidget(scroll, 1)
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
            image.setDevicePixelRatio(self.devicePixelRatioF())
            self._picture.setPixmap(QPixmap.fromImage(image))
            self._picture.setAccessibleDescription(caption)

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
    caption_px = round(_CAPTION_IN * dpi)
    width = max(page.width() for page in pages)
    image = QImage(width, sum(page.height() + caption_px for page in pages), QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.white)
    font, top = QFont(), 0
    font.setPixelSize(round(_CAPTION_LETTER_IN * dpi))
    with QPainter(image) as painter:
        painter.setFont(font)
        painter.setPen(Qt.GlobalColor.black)
        for plot, page in zip(plots, pages, strict=True):
            area = QRectF(0, top, width, caption_px).adjusted(*[_CAPTION_LETTER_IN * dpi / 2] * 4)
            painter.drawText(area, Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap, plot.caption)
            painter.drawImage(0, top + caption_px, page)
            top += page.height() + caption_px
    return image, f"{len(plots)} volumes, the worst first."


def _page(shown: "Plot | Photo", dpi: float) -> QImage:
    from annotations.agreement.report.contents import Photo
    from annotations.agreement.report.pictures import picture_bytes

    png = shown.png if isinstance(shown, Photo) else picture_bytes(shown.size_in, shown.draw, "png")
    width_px = round(shown.size_in[0] * dpi)
    return QImage.fromData(png).scaledToWidth(width_px, Qt.TransformationMode.SmoothTransformation)
