"""The offer to open the folder of a report, beside the words that say where it is."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QTimer, QUrl, Slot
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QToolButton, QWidget

from annotator.looks.naming import named
from annotator.session.agreement.report_writing import ReportWriting

# Longer than a message is shown: whoever waits for a report does something else meanwhile.
_OFFERED_MS = 60_000


class FolderOffer(QToolButton):
    """Comes when a report is written, whatever it is about, and goes when it is used or after a minute."""

    def __init__(self, reports: Sequence[ReportWriting], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        named(self, "open_report_folder").setText("Open Folder")
        self._folder = Path()
        self._gone = QTimer(self, singleShot=True, interval=_OFFERED_MS)
        self._gone.timeout.connect(self.hide)
        self.clicked.connect(self._on_clicked)
        for report in reports:
            report.exported.connect(self._on_report_exported)
        self.hide()

    @Slot(object)
    def _on_report_exported(self, paths: tuple[Path, ...]) -> None:
        self._folder = paths[0].parent
        self.setToolTip(f"Open {self._folder}, where the report is")
        self.show()
        self._gone.start()

    @Slot()
    def _on_clicked(self) -> None:
        self.hide()
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._folder)))
