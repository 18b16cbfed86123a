"""Every action and its shortcut, on one searchable sheet."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHeaderView,
    QLineEdit,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from annotator.looks.labels import WrappedText
from annotator.looks.naming import named

Row = tuple[str, str, str]
"""Group, text of the action, shortcut as it is written in the menus."""


class ShortcutSheet(QDialog):
    """Lists actions by group; typing narrows the list to rows with all the words."""

    def __init__(self, rows: Sequence[Row], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("shortcut_sheet")
        self.setWindowTitle("Shortcuts")
        self.setSizeGripEnabled(True)

        self._search = named(QLineEdit(), "shortcut_search")
        self._search.setAccessibleName("Search the shortcuts")
        self._search.setPlaceholderText("Search: place, undo, Ctrl …")
        self._search.setClearButtonEnabled(True)
        self._search.textChanged.connect(self._on_search_text_changed)

        self._tree = QTreeWidget()
        self._tree.setObjectName("shortcut_tree")
        self._tree.setAccessibleName("Shortcuts")
        self._tree.setHeaderLabels(["Action", "Shortcut"])
        self._tree.setAlternatingRowColors(True)
        self._tree.setSelectionMode(QTreeWidget.SelectionMode.NoSelection)
        self._tree.header().setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        self._tree.header().setSectionResizeMode(1, QHeaderView.ResizeMode.ResizeToContents)
        self._tree.header().setStretchLastSection(False)
        self._groups: list[tuple[QTreeWidgetItem, list[QTreeWidgetItem]]] = []
        for title in dict.fromkeys(group for group, _, _ in rows):
            children = [QTreeWidgetItem([text, shortcut]) for group, text, shortcut in rows if group == title]
            self._add_group(title, children)
        self._tree.expandAll()

        self._nothing = WrappedText("No action matches.", name="shortcut_nothing")
        self._nothing.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._nothing.setVisible(False)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        buttons.button(QDialogButtonBox.StandardButton.Close).setObjectName("shortcut_close")
        buttons.rejected.connect(self.reject)

        layout = QVBoxLayout(self)
        layout.addWidget(self._search)
        layout.addWidget(self._tree, 1)
        layout.addWidget(self._nothing)
        layout.addWidget(buttons)
        unit = self.fontMetrics().height()
        self.resize(unit * 34, unit * 40)
        self._search.setFocus()

    def _add_group(self, title: str, children: list[QTreeWidgetItem]) -> None:
        group = QTreeWidgetItem([title])
        font = group.font(0)
        font.setBold(True)
        group.setFont(0, font)
        self._tree.addTopLevelItem(group)
        group.addChildren(children)
        group.setFirstColumnSpanned(True)
        self._groups.append((group, children))

    @Slot(str)
    def _on_search_text_changed(self, text: str) -> None:
        words = text.casefold().split()
        found = False
        for group, children in self._groups:
            shown = 0
            for child in children:
                row = f"{group.text(0)} {child.text(0)} {child.text(1)}".casefold()
                matches = all(word in row for word in words)
                child.setHidden(not matches)
                shown += matches
            group.setHidden(shown == 0)
            found = found or shown > 0
        self._nothing.setVisible(not found)
