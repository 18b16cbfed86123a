import subprocess
import sys
from typing import get_args

from PySide6.QtGui import QKeySequence

from annotator.actions.action import When
from annotator.actions.mouse_gestures import GESTURES
from annotator.actions.table import ACTIONS, MENUS, TOOL_BAR, markdown, sheet_rows
from annotator.session.viewing.view import Layer, Pane


def test_every_action_has_a_shortcut_of_its_own():
    owners = {}
    for entry in ACTIONS:
        assert entry.shortcuts, f"{entry.name} has none"
        for shortcut in entry.shortcuts:
            sequence = QKeySequence(shortcut)
            assert sequence.count() == 1, f"{entry.name}: {shortcut!r} is no key"
            key = sequence[0].toCombined()
            assert key not in owners, f"{shortcut} belongs to {owners.get(key)} and to {entry.name}"
            owners[key] = entry.name


def test_shortcuts_are_spelt_as_qt_spells_them():
    for entry in ACTIONS:
        for shortcut in entry.shortcuts:
            assert QKeySequence(shortcut).toString(QKeySequence.SequenceFormat.PortableText) == shortcut


def test_every_action_is_in_a_menu_and_explains_itself():
    for entry in ACTIONS:
        assert entry.menu.split("/")[0] in MENUS
        assert entry.text
        assert entry.tooltip.endswith(".")
        assert entry.when in get_args(When)


def test_names_are_unique_and_those_of_the_tool_bar_are_among_them():
    names = [entry.name for entry in ACTIONS]
    assert len(names) == len(set(names))
    assert all(name in names for group in TOOL_BAR for name in group)


def test_every_layer_and_pane_has_an_action():
    names = {entry.name for entry in ACTIONS}
    assert {f"layer_{layer}" for layer in get_args(Layer)} <= names
    assert {f"show_{pane}" for pane in get_args(Pane)} <= names


def test_sheet_shows_every_action_and_gesture():
    rows = sheet_rows()
    assert all(all(cells) for cells in rows)
    texts = {text for _, text, _ in rows}
    for entry in ACTIONS:
        assert entry.text in texts or entry.name.startswith(("recent_", "keypoint_"))
    assert texts.issuperset(gesture.effect for gesture in GESTURES)
    assert ("File", "Save", "Ctrl+S") in rows
    assert ("Annotate › Keypoint or Link", "Keypoint or Link 1 to 9", "1 … 9") in rows


def test_page_of_shortcuts_names_every_key():
    page = markdown()
    for entry in ACTIONS:
        for key in entry.shortcuts:
            assert f"`{key}`" in page
    for gesture in GESTURES:
        assert gesture.effect in page


def test_page_is_printed_without_an_application():
    shown = subprocess.run(
        [sys.executable, "-m", "annotator.actions.table"],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert shown.stdout == markdown()
    assert shown.stderr == ""
