"""Who annotates, and by which methods: names are typed above a table of those that are there."""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence

from PySide6.QtCore import QEvent, Qt, Signal, Slot
from PySide6.QtGui import QBrush, QKeyEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QHBoxLayout,
    QHeaderView,
    QLineEdit,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.record import Method
from annotations.documents.study import annotator_problems
from annotator.looks import theme
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named

_METHODS: tuple[Method, ...] = ("keypoints", "boxes")
_RETURNS = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
_ROWS_SHOWN = 4


class AnnotatorsTable(QWidget):
    """A table of annotators with a check mark per method; those who were there from the beginning stay.

    Attributes
    ----------
    entry : QLineEdit
        Where names are typed: several with commas between them.

    Signals
    -------
    changed
    """

    changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._fixed: Collection[str] = ()
        self._methods: tuple[Method, ...] = _METHODS
        self.entry = named(
            _NameEntry(),
            "study_new_annotator",
            title="Name of an annotator to add",
            tooltip="Type a name and press Return; several with commas between them",
        )
        self.entry.setPlaceholderText("Name, or several with commas")
        self.entry.names_entered.connect(self._on_entry_names_entered)
        self._add = named(QPushButton("&Add"), "study_add_annotator", tooltip="Add who is named on the left")
        self._remove = named(
            QPushButton("Re&move"),
            "study_remove_annotator",
            tooltip="Take out who is chosen in the table (Delete)",
        )
        for button in (self._add, self._remove):
            button.setAutoDefault(False)
        self._table = named(
            QTableWidget(0, 1 + len(_METHODS)), "study_annotators", title="Annotators and their methods"
        )
        self._table.setHorizontalHeaderLabels(["Annotator", "Keypoints", "Boxes"])
        self._table.verticalHeader().setVisible(False)
        self._table.setSelectionBehavior(QTableWidget.SelectionBehavior.SelectRows)
        self._table.setAlternatingRowColors(True)
        self._table.setTabKeyNavigation(False)
        header = self._table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        row = self._table.verticalHeader().defaultSectionSize()
        self._table.setMinimumHeight(header.sizeHint().height() + _ROWS_SHOWN * row)
        self._table.itemChanged.connect(self._on_table_item_changed)
        self._table.itemSelectionChanged.connect(self._on_table_item_selection_changed)
        delete = QShortcut(QKeySequence.StandardKey.Delete, self._table)
        delete.setContext(Qt.ShortcutContext.WidgetShortcut)
        delete.activated.connect(self._on_remove_clicked)
        self._staying = WrappedText(
            "Whoever is in the study already stays: what they have done is kept under their names.",
            name="study_staying",
        )
        self._add.clicked.connect(self.entry.enter_names)
        self._remove.clicked.connect(self._on_remove_clicked)
        self.entry.textChanged.connect(self._on_entry_text_changed)
        above = QHBoxLayout()
        above.addWidget(self.entry, 1)
        above.addWidget(self._add)
        above.addWidget(self._remove)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(above)
        layout.addWidget(self._table, 1)
        layout.addWidget(self._staying)
        self._staying.setVisible(False)
        self._draw_buttons()

    @property
    def names(self) -> tuple[str, ...]:
        """The annotators in their order."""
        return tuple(self._name(row) for row in range(self._table.rowCount()))

    @property
    def assignments(self) -> Mapping[str, tuple[Method, ...]]:
        """By which methods those annotators work who do not work by all of them."""
        return {
            self._name(row): methods
            for row in range(self._table.rowCount())
            if (methods := self._checked(row)) != self._methods
        }

    @property
    def problems(self) -> tuple[str, ...]:
        """Why some of the names cannot be; their rows are marked."""
        return tuple(dict.fromkeys(annotator_problems(self.names).values()))

    def show_people(
        self,
        names: Sequence[str],
        assignments: Mapping[str, Sequence[Method]],
        *,
        fixed: Collection[str] = (),
    ) -> None:
        """Begin with some annotators; ``fixed`` ones can be neither removed nor called otherwise."""
        self._fixed = fixed
        self._staying.setVisible(bool(fixed))
        for name in names:
            self._append(name, assignments.get(name, _METHODS))
        self._mark()
        self._draw_buttons()

    def set_methods(self, methods: Sequence[Method]) -> None:
        """Let annotators work by these methods; a single one needs no check marks."""
        self._methods = tuple(method for method in _METHODS if method in methods)
        for column, method in enumerate(_METHODS, start=1):
            self._table.setColumnHidden(column, method not in methods or len(methods) == 1)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._mark()

    def _mark(self) -> None:
        """Show which of the names cannot be."""
        problems = annotator_problems(self.names)
        was_blocked = self._table.blockSignals(True)
        for row in range(self._table.rowCount()):
            item = self._table.item(row, 0)
            if item is None:
                continue
            is_wrong = row in problems
            item.setForeground(theme.colors(self.palette()).error if is_wrong else QBrush())
            item.setToolTip(f"{problems[row]}." if is_wrong else self._why_fixed(item.text()))
        self._table.blockSignals(was_blocked)

    def _why_fixed(self, name: str) -> str:
        return "What this person has done is kept under the name: it stays" if name in self._fixed else ""

    def _announce(self) -> None:
        self._mark()
        self.changed.emit()

    def _append(self, name: str, methods: Iterable[Method]) -> None:
        was_blocked = self._table.blockSignals(True)
        row = self._table.rowCount()
        self._table.insertRow(row)
        item = QTableWidgetItem(name)
        if name in self._fixed:
            item.setFlags(item.flags() & ~Qt.ItemFlag.ItemIsEditable)
        self._table.setItem(row, 0, item)
        for column, method in enumerate(_METHODS, start=1):
            mark = QTableWidgetItem()
            mark.setFlags(Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsUserCheckable)
            mark.setFlags(mark.flags() | Qt.ItemFlag.ItemIsSelectable)
            mark.setCheckState(Qt.CheckState.Checked if method in methods else Qt.CheckState.Unchecked)
            mark.setToolTip(f"Whether {name} is to annotate by {method}")
            self._table.setItem(row, column, mark)
        self._table.blockSignals(was_blocked)

    def _name(self, row: int) -> str:
        item = self._table.item(row, 0)
        return item.text().strip() if item is not None else ""

    def _checked(self, row: int) -> tuple[Method, ...]:
        if len(self._methods) == 1:
            return self._methods
        return tuple(
            method
            for column, method in enumerate(_METHODS, start=1)
            if method in self._methods and self._is_checked(row, column)
        )

    def _is_checked(self, row: int, column: int) -> bool:
        item = self._table.item(row, column)
        return item is not None and item.checkState() == Qt.CheckState.Checked

    def _removable(self) -> list[int]:
        rows = {index.row() for index in self._table.selectedIndexes()}
        return sorted((row for row in rows if self._name(row) not in self._fixed), reverse=True)

    def _draw_buttons(self) -> None:
        self._add.setEnabled(bool(self.entry.text().strip()))
        self._remove.setEnabled(bool(self._removable()))

    @Slot(list)
    def _on_entry_names_entered(self, names: list[str]) -> None:
        for name in names:
            self._append(name, _METHODS)
        self._table.scrollToBottom()
        self._announce()

    @Slot()
    def _on_entry_text_changed(self) -> None:
        self._draw_buttons()

    @Slot()
    def _on_table_item_changed(self) -> None:
        self._announce()

    @Slot()
    def _on_table_item_selection_changed(self) -> None:
        self._draw_buttons()

    @Slot()
    def _on_remove_clicked(self) -> None:
        removable = self._removable()
        for row in removable:
            self._table.removeRow(row)
        if removable:
            self._announce()


class _NameEntry(QLineEdit):
    """A field in which Return enters the names that are typed, and only an empty one ends the dialog.

    Signals
    -------
    names_entered : list of str
    """

    names_entered = Signal(list)

    @Slot()
    def enter_names(self) -> None:
        """Take what is typed."""
        names = [name for part in re.split(r"[,;\n]", self.text()) if (name := part.strip())]
        if names:
            self.clear()
            self.names_entered.emit(names)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in _RETURNS and self.text().strip():
            self.enter_names()
            event.accept()
        else:
            super().keyPressEvent(event)
