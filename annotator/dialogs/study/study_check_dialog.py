"""What the check of a study has found, as a list from which each file can be opened."""

from pathlib import Path

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, Qt, Signal, Slot
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QHeaderView,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.study import annotation_name
from annotations.documents.study_checks import is_wrong
from annotations.documents.study_contents import Located
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named
from annotator.session.studies import StudyReport

_PATH = Qt.ItemDataRole.UserRole
_KINDS = {
    "study": "Study",
    "missing": "Missing",
    "orphan": "Orphaned",
    "name": "Name",
    "duplicate": "Twice",
    "consensus": "Consensus",
    "lock": "Lock",
    "stray": "Left over",
    "note": "Note",
    "file": "File",
    "tool": "Tool",
    "volume": "Volume",
    "shape": "Shape",
    "dtype": "Data type",
    "fingerprint": "Content",
    "spacing": "Spacing",
    "keypoint": "Keypoint",
    "box": "Box",
    "link": "Link",
    "original": "Original",
    "plausibility": "Plausibility",
}


class StudyCheckDialog(QDialog):
    """Shows findings; stays open beside the window while they are seen to.

    Attributes
    ----------
    folder : Path or None
        Of the study that was checked.

    Signals
    -------
    open_requested : Path
        Of the annotation that a finding is about.
    check_requested
    """

    open_requested = Signal(object)
    check_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.folder: Path | None = None
        self._findings: list[Located] = []
        self.setObjectName("study_check_dialog")
        self.setWindowTitle("Check of the study")
        self.setSizeGripEnabled(True)
        self._heading = Heading(name="study_check_heading")
        self._list = named(QTreeWidget(), "study_check_list", title="Findings")
        self._list.setHeaderLabels(["Kind", "Where", "What was found"])
        self._list.setRootIsDecorated(False)
        self._list.setAlternatingRowColors(True)
        self._list.setWordWrap(True)
        self._places = _Places(self._list)
        self._list.setItemDelegateForColumn(1, self._places)
        self._list.itemActivated.connect(self._on_list_item_activated)
        self._list.header().setSectionResizeMode(2, QHeaderView.ResizeMode.Stretch)
        self._list.currentItemChanged.connect(self._on_list_current_item_changed)
        self._whole = WrappedText(name="study_check_whole")
        self._notes = named(
            QCheckBox("Show &notes as well"),
            "study_check_notes",
            tooltip="Notes are about nothing wrong: flags, what was looked at, who has a file open",
        )
        self._notes.setChecked(True)
        self._notes.toggled.connect(self._on_notes_toggled)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        again = buttons.addButton("Check &again", QDialogButtonBox.ButtonRole.ActionRole)
        copy = buttons.addButton("&Copy", QDialogButtonBox.ButtonRole.ActionRole)
        named(again, "study_check_again").clicked.connect(self.check_requested)
        named(copy, "study_check_copy", tooltip="Copy the list as a table").clicked.connect(
            self._on_copy_clicked
        )
        named(buttons.button(QDialogButtonBox.StandardButton.Close), "study_check_close")
        buttons.rejected.connect(self.reject)
        below = QHBoxLayout()
        self._hint = WrappedText(name="study_check_hint")
        below.addWidget(self._hint, 1)
        below.addWidget(self._notes)
        layout = QVBoxLayout(self)
        layout.addWidget(self._heading)
        layout.addWidget(self._list, 1)
        layout.addWidget(self._whole)
        layout.addLayout(below)
        layout.addWidget(buttons)
        unit = self.fontMetrics().height()
        self.resize(56 * unit, 28 * unit)
        self._list.setFocus()

    def show_report(self, report: StudyReport) -> None:
        """Show what was found, in place of what was found before."""
        self.folder = report.folder
        self.setWindowTitle(f"Check of {report.study.title}")
        self._list.clear()
        # Notes come last: nobody has to see to them.
        self._findings = sorted(report.findings, key=lambda located: not is_wrong(located[1]))
        for path, finding in self._findings:
            where = _in_study(path, report.folder)
            item = QTreeWidgetItem([_KINDS.get(finding.kind, finding.kind), where, finding.problem])
            item.setToolTip(1, str(path or report.folder))
            item.setToolTip(2, finding.problem)
            item.setData(0, _PATH, path)
            item.setTextAlignment(0, Qt.AlignmentFlag.AlignTop)
            item.setTextAlignment(1, Qt.AlignmentFlag.AlignTop)
            self._list.addTopLevelItem(item)
        self._draw()
        for column in (0, 1):
            self._list.resizeColumnToContents(column)
        widest = 22 * self.fontMetrics().height()
        self._list.setColumnWidth(1, min(self._list.columnWidth(1), widest))
        first = next((item for item in self._items() if not item.isHidden()), None)
        if first is not None:
            self._list.setCurrentItem(first)

    def _items(self) -> list[QTreeWidgetItem]:
        rows = range(self._list.topLevelItemCount())
        return [item for row in rows if (item := self._list.topLevelItem(row)) is not None]

    def _draw(self) -> None:
        wrong = [is_wrong(finding) for _, finding in self._findings]
        for item, is_finding in zip(self._items(), wrong, strict=True):
            item.setHidden(not is_finding and not self._notes.isChecked())
        findings, notes = sum(wrong), len(wrong) - sum(wrong)
        said = f"{findings} finding{'s' if findings > 1 else ''}" if findings else "Nothing is wrong"
        also = f", {notes} note{'s' if notes > 1 else ''}" if notes else ""
        self._heading.setText(f"{said}{also}")

    @Slot(QTreeWidgetItem, int)
    def _on_list_item_activated(self, item: QTreeWidgetItem, _column: int) -> None:
        if _opens(item):
            self.open_requested.emit(item.data(0, _PATH))

    @Slot()
    def _on_list_current_item_changed(self) -> None:
        # In a row long sentences are cut off.
        item = self._list.currentItem()
        self._whole.setText(f"{item.toolTip(1)}\n{item.text(2)}" if item is not None else "")
        opens = item is not None and _opens(item)
        self._hint.setText("Return or a double click opens the annotation." if opens else "")

    @Slot()
    def _on_notes_toggled(self) -> None:
        self._draw()

    @Slot()
    def _on_copy_clicked(self) -> None:
        lines = [
            "\t".join(item.text(column) for column in range(3))
            for item in self._items()
            if not item.isHidden()
        ]
        QGuiApplication.clipboard().setText("\n".join(lines) + "\n")


class _Places(QStyledItemDelegate):
    """Draws where a finding is on one line: the file's name stays when there is no room for its folders."""

    def initStyleOption(
        self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        super().initStyleOption(option, index)
        # Wrapped text would lose its end.
        option.features &= ~QStyleOptionViewItem.ViewItemFeature.WrapText
        option.textElideMode = Qt.TextElideMode.ElideLeft


def _opens(item: QTreeWidgetItem) -> bool:
    path = item.data(0, _PATH)
    return isinstance(path, Path) and annotation_name(path) is not None and path.is_file()


def _in_study(path: Path | None, folder: Path) -> str:
    if path is None:
        return ""
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else str(path)
