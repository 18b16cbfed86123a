"""Fields for numbers: a wish only where a person changed what is shown."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from annotator.panels.widgets.number_fields import NumberField, NumberFields


class Row(QWidget):
    """Two fields of a group, and another one to leave them for."""

    def __init__(self) -> None:
        super().__init__()
        self.elsewhere = QLineEdit()
        fields = [NumberField("first", "First"), NumberField("second", "Second", lowest=1.0)]
        layout = QHBoxLayout(self)
        for widget in (*fields, self.elsewhere):
            layout.addWidget(widget)
        self.group = NumberFields(fields, self)
        fields[0].show_number(1 / 3, 0.5)
        fields[1].show_number(20.0, 0.5)


@pytest.fixture
def row(qtbot: QtBot) -> Row:
    row = Row()
    qtbot.addWidget(row)
    with qtbot.waitActive(row):
        row.show()
        row.activateWindow()
    return row


@pytest.fixture
def fields(row: Row) -> NumberFields:
    return row.group


def wishes(fields: NumberFields) -> list[tuple[int, float]]:
    """Collect what is asked for from now on."""
    asked: list[tuple[int, float]] = []
    fields.number_requested.connect(lambda place, number: asked.append((place, number)))
    return asked


def test_showing_a_number_is_no_wish(fields: NumberFields) -> None:
    asked = wishes(fields)
    fields.fields[0].show_number(7.0, 2.0)
    fields.fields[0].show_nothing()
    assert asked == []


def test_a_lowest_value_asks_for_nothing_while_a_field_is_made(qtbot: QtBot) -> None:
    field = NumberField("length", "Length", lowest=5.0)
    qtbot.addWidget(field)
    with qtbot.assertNotEmitted(field.number_requested):
        field.show_number(12.0, 1.0)
    assert field.value() == 12.0


def test_only_another_number_is_a_wish(qtbot: QtBot, fields: NumberFields) -> None:
    asked = wishes(fields)
    first = fields.fields[0]
    first.setFocus()
    first.selectAll()
    qtbot.keyClicks(first, "0.33")
    qtbot.keyClick(first, Qt.Key.Key_Return)
    assert asked[-1:] != [(0, 0.33)]
    qtbot.keyClick(first, Qt.Key.Key_Up)
    assert asked[-1] == (0, 0.83)


def test_text_that_stands_for_the_number_stays_while_it_is_typed(qtbot: QtBot, fields: NumberFields) -> None:
    second = fields.fields[1]
    second.setFocus()
    second.selectAll()
    qtbot.keyClicks(second, "7")
    second.show_number(7.0, 0.5)
    assert second.text() == "7"
    second.show_number(7.0, 0.5, over_typing=True)
    assert second.text() == "7.00"


def test_a_group_settles_on_leaving_and_not_in_between(qtbot: QtBot, row: Row) -> None:
    first, second = row.group.fields
    first.setFocus()
    with qtbot.assertNotEmitted(row.group.settled):
        second.setFocus()
    with qtbot.waitSignal(row.group.settled):
        row.elsewhere.setFocus()


def test_stepping_settles_by_itself_and_typing_does_not(qtbot: QtBot, fields: NumberFields) -> None:
    first = fields.fields[0]
    first.setFocus()
    qtbot.keyClick(first, Qt.Key.Key_Up)
    assert fields.is_resting
    qtbot.keyClicks(first, "5")
    assert not fields.is_resting
    qtbot.keyClick(first, Qt.Key.Key_Down)
    with qtbot.waitSignal(fields.settled):
        pass


def test_a_negative_number_where_none_is_allowed_brings_the_last_one_back(
    qtbot: QtBot, fields: NumberFields
) -> None:
    asked = wishes(fields)
    field = fields.fields[1]
    field.selectAll()
    qtbot.keyClicks(field, "-5")
    assert field.text() == "-5"
    qtbot.keyClick(field, Qt.Key.Key_Return)
    assert field.value() == 20.0
    assert field.text() == "20.00"
    assert asked == []


def test_what_rounds_to_zero_has_no_sign(fields: NumberFields) -> None:
    fields.fields[0].show_number(-0.001, 0.5)
    assert fields.fields[0].text() == "0.00"
