"""The tool's pose and the distances between its keypoints, live: they move with a drag."""

from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from annotator.looks.folding import Folding, scrolling_column
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.distance_tables import DistanceMatrix, LinkTable
from annotator.panels.pose_readout import PoseReadout, Reading, pose_readout
from annotator.session import Session
from annotator.session.view import View

_NO_SIGN = (
    "Angles are unsigned: a sign needs the hinge axis, which keypoints alone do not give. "
    "Orientation is a direction; roll about the shaft is not in it."
)
_ROLL_ONLY = "Orientation is a direction; roll about the shaft is not in it."


class PosePanel(QWidget):
    """Position, direction and angles of the tool; lengths of its links; distances of all pairs."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._readout: PoseReadout | None = None
        self._rows: list[tuple[QLabel, WrappedText]] = []
        self.setObjectName("pose_panel")
        self.setAccessibleName("Pose")

        self._nothing = WrappedText("Open a volume to see the pose of its tool.", name="pose_nothing")
        self._targets = QGridLayout()
        self._targets.setColumnStretch(1, 1)
        self._targets.setHorizontalSpacing(12)
        self._note = WrappedText(name="pose_note")
        self._note.set_color(lambda colors: colors.muted)
        self._copy = named(QPushButton("&Copy as table"), "pose_copy")
        self._copy.setToolTip("Copy pose, lengths and distances as tab-separated text, for a spreadsheet")
        self._copy.clicked.connect(self._on_copy_clicked)
        self._links = LinkTable()
        self._pairs = DistanceMatrix()

        copy_row = QHBoxLayout()
        copy_row.addWidget(self._copy)
        copy_row.addStretch(1)
        pose = QWidget()
        pose_layout = QVBoxLayout(pose)
        pose_layout.setContentsMargins(8, 0, 0, 4)
        pose_layout.addLayout(self._targets)
        pose_layout.addWidget(self._note)
        pose_layout.addLayout(copy_row)
        self._sections = [
            Folding("Pose", pose, name="pose_unfold", unfolded=True),
            Folding("Links / mm", self._links, name="links_unfold", unfolded=True),
            Folding("Distances / mm", self._pairs, name="distances_unfold", unfolded=False),
        ]
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(scrolling_column([self._nothing, *self._sections], "pose_scroll"))

        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._draw()

    def copy_to_clipboard(self) -> None:
        """Copy everything as a tab-separated table."""
        if self._readout is not None:
            QGuiApplication.clipboard().setText(self._readout.table())
            self._session.post_message("Pose and distances are on the clipboard")

    @Slot()
    def _on_copy_clicked(self) -> None:
        self.copy_to_clipboard()

    @Slot(object, object)
    def _on_session_document_changed(self, before: object, after: object) -> None:
        self._draw()

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.preview != after.preview:
            self._draw()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._draw()

    def _draw(self) -> None:
        tool = self._session.tool
        readout = None if tool is None else pose_readout(self._session.shown_positions_um(), tool)
        if readout == self._readout and self._readout is not None:
            return
        self._readout = readout
        self._nothing.setVisible(readout is None)
        for section in self._sections:
            section.setVisible(readout is not None)
        if readout is None or tool is None:
            return
        self._fit_rows(len(readout.targets))
        for (title, value), reading in zip(self._rows, readout.targets, strict=True):
            self._show(title, value, reading)
        self._note.setText(_NO_SIGN if tool.targets.angles else _ROLL_ONLY)
        self._links.show_readout(readout)
        self._pairs.show_readout(readout)

    def _fit_rows(self, count: int) -> None:
        while len(self._rows) > count:
            for label in self._rows.pop():
                self._targets.removeWidget(label)
                label.deleteLater()
        while len(self._rows) < count:
            row = len(self._rows)
            title, value = QLabel(), WrappedText()
            self._targets.addWidget(title, row, 0, Qt.AlignmentFlag.AlignTop)
            self._targets.addWidget(value, row, 1)
            self._rows.append((title, value))

    def _show(self, title: QLabel, value: WrappedText, reading: Reading) -> None:
        title.setText(reading.title)
        value.setObjectName(f"pose_{reading.name}")
        value.setAccessibleName(reading.title)
        value.setText("\n".join(reading.texts) or reading.missing)
        value.set_color((lambda colors: colors.muted) if reading.missing else None)
