"""The shortcut sheet: everything there, found by typing."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QLineEdit, QPushButton, QTreeWidget
from pytestqt.qtbot import QtBot

from annotator.dialogs.shortcut_sheet import ShortcutSheet

ROWS = (
    ("File", "Open…", "Ctrl+O"),
    ("Edit", "Undo", "Ctrl+Z"),
    ("File", "Save", "Ctrl+S"),
    ("Slices", "Pan", "Middle drag"),
)


@pytest.fixture
def sheet(qtbot: QtBot) -> ShortcutSheet:
    sheet = ShortcutSheet(ROWS)
    qtbot.addWidget(sheet)
    with qtbot.waitActive(sheet):
        sheet.show()
        sheet.activateWindow()
    return sheet


def shown(sheet: ShortcutSheet) -> list[tuple[str, str, str]]:
    tree = sheet.findChild(QTreeWidget, "shortcut_tree")
    assert isinstance(tree, QTreeWidget)
    groups = [tree.topLevelItem(row) for row in range(tree.topLevelItemCount())]
    return [
        (group.text(0), group.child(row).text(0), group.child(row).text(1))
        for group in groups
        for row in range(group.childCount())
        if not group.isHidden() and not group.child(row).isHidden()
    ]


def search(sheet: ShortcutSheet) -> QLineEdit:
    found = sheet.findChild(QLineEdit, "shortcut_search")
    assert isinstance(found, QLineEdit)
    return found


def test_all_rows_stand_in_their_groups(sheet: ShortcutSheet) -> None:
    assert shown(sheet) == [ROWS[0], ROWS[2], ROWS[1], ROWS[3]]
    assert search(sheet).hasFocus()


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("undo", [ROWS[1]]),
        ("ctrl", [ROWS[0], ROWS[2], ROWS[1]]),
        ("file s", [ROWS[2]]),
        ("DRAG pan", [ROWS[3]]),
        ("nothing", []),
    ],
)
def test_typing_narrows_the_sheet(
    qtbot: QtBot, sheet: ShortcutSheet, typed: str, expected: list[tuple[str, str, str]]
) -> None:
    qtbot.keyClicks(search(sheet), typed)
    assert shown(sheet) == expected
    nothing = sheet.findChild(QLabel, "shortcut_nothing")
    assert isinstance(nothing, QLabel)
    assert nothing.isVisible() == (not expected)
    search(sheet).clear()
    assert len(shown(sheet)) == len(ROWS)


def test_it_closes(qtbot: QtBot, sheet: ShortcutSheet) -> None:
    button = sheet.findChild(QPushButton, "shortcut_close")
    assert isinstance(button, QPushButton)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert not sheet.isVisible()
