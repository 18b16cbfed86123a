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

from annotator.labels import WrappedText

Row = tuple[str, str, str]
"""Group, text of the action, shortcut as it is written in the menus."""


class ShortcutSheet(QDialog):
    """Lists actions by group; typing narrows the list to rows with all the words, in action, group or shortcut."""

    def __init__(self, rows: Sequence[Row], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("shortcut_sheet")
        self.setWindowTitle("Shortcuts")
        self.setSizeGripEnabled(True)

        self._search = QLineEdit(objectName="shortcut_search")
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
        groups: dict[str, QTreeWidgetItem] = {}
        for group, text, shortcut in rows:
            if group not in groups:
                parent_item = QTreeWidgetItem([group])
                font = parent_item.font(0)
                font.setBold(True)
                parent_item.setFont(0, font)
                self._tree.addTopLevelItem(parent_item)
                parent_item.setFirstColumnSpanned(True)
                groups[group] = parent_item
            groups[group].addChild(QTreeWidgetItem([text, shortcut]))
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

    @Slot(str)
    def _on_search_text_changed(self, text: str) -> None:
        words = text.casefold().split()
        found = False
        for index in range(self._tree.topLevelItemCount()):
            group = self._tree.topLevelItem(index)
            shown = 0
            for child_index in range(group.childCount()):
                child = group.child(child_index)
                row = f"{group.text(0)} {child.text(0)} {child.text(1)}".casefold()
                matches = all(word in row for word in words)
                child.setHidden(not matches)
                shown += matches
            group.setHidden(shown == 0)
            found = found or shown > 0
        self._nothing.setVisible(not found)
