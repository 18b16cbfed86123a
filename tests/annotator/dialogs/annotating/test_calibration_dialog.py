"""What was measured is shown beside what is nominal; only a new name makes a new specification."""

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QLabel, QLineEdit, QPlainTextEdit, QPushButton, QTableWidget
from pytestqt.qtbot import QtBot

from annotations.errors import UserError
from annotations.fitting.calibration import Calibration, LinkMeasures, Measured
from annotations.geometry.tool_library import shipped_tools
from annotator.dialogs.annotating.calibration_dialog import CalibrationDialog
from annotator.looks.labels import Heading
from annotator.session.agreement.calibrating import ToolCalibration

MEASURED = Calibration(
    {
        "link0": LinkMeasures(length=Measured(11_234.56, 45.67, 12), width=Measured(3950.0, None, 1)),
        "link1": LinkMeasures(),
        "link2": LinkMeasures(height=Measured(1900.0, 10.0, 3)),
    },
    12,
)


WELL_MEASURED = Calibration({"link0": LinkMeasures(length=Measured(11_234.56, 45.67, 5))}, 5)


@pytest.fixture
def make(qtbot: QtBot) -> Callable[..., CalibrationDialog]:
    def make(
        calibration: Calibration = MEASURED, *, is_study: bool = True, is_own: bool = False
    ) -> CalibrationDialog:
        found = ToolCalibration(
            shipped_tools()["magnetic-forceps"],
            calibration,
            Path("/studies/pilot/tools"),
            is_study,
            is_own,
            frozenset({"magnetic-forceps", "needle"}),
        )
        dialog = CalibrationDialog(found)
        qtbot.addWidget(dialog)
        with qtbot.waitActive(dialog):
            dialog.show()
            dialog.activateWindow()
        return dialog

    return make


def rows(dialog: CalibrationDialog) -> list[tuple[str, ...]]:
    table = dialog.findChild(QTableWidget, "calibration_table")
    return [
        tuple(table.item(row, column).text() for column in range(table.columnCount()))
        for row in range(table.rowCount())
    ]


def said(dialog: CalibrationDialog) -> str:
    return " ".join(label.text() for label in dialog.findChildren(QLabel))


def ok(dialog: CalibrationDialog) -> QPushButton:
    found = dialog.findChild(QPushButton, "calibration_ok")
    assert isinstance(found, QPushButton)
    return found


def retype(qtbot: QtBot, dialog: CalibrationDialog, text: str) -> None:
    field = dialog.findChild(QLineEdit, "calibration_name")
    field.selectAll()
    qtbot.keyClick(field, Qt.Key.Key_Delete)
    qtbot.keyClicks(field, text)


def test_each_link_shows_nominal_median_spread_and_number(make: Callable[..., CalibrationDialog]) -> None:
    dialog = make()
    assert rows(dialog) == [
        ("link0", "length", "11000.0", "11234.6", "45.7", "12"),
        ("link0", "diameter", "4000.0", "3950.0", "—", "1"),
        ("link1", "length", "5000.0", "—", "—", "0"),
        ("link1", "diameter", "4000.0", "—", "—", "0"),
        ("link2", "length", "6000.0", "—", "—", "0"),
        ("link2", "width", "4000.0", "—", "—", "0"),
        ("link2", "height", "2000.0", "1900.0", "10.0", "3"),
    ]
    assert "measured in 12 finished annotations" in said(dialog)
    assert dialog.findChild(QPlainTextEdit, "calibration_skipped") is None


def test_a_new_name_is_suggested_and_taken(qtbot: QtBot, make: Callable[..., CalibrationDialog]) -> None:
    dialog = make(WELL_MEASURED)
    assert dialog.name == "magnetic-forceps-calibrated"
    assert ok(dialog).isEnabled()
    retype(qtbot, dialog, " ours-2026 ")
    assert dialog.name == "ours-2026"
    qtbot.keyClick(dialog, Qt.Key.Key_Return)
    assert dialog.result() == QDialog.DialogCode.Accepted


@pytest.mark.parametrize(
    ("name", "problem"),
    [("magnetic-forceps", "already"), ("needle", "already"), ("a b", "letters, digits"), ("", "letters")],
)
def test_a_name_that_cannot_be_is_refused_with_a_reason(
    qtbot: QtBot, make: Callable[..., CalibrationDialog], name: str, problem: str
) -> None:
    dialog = make()
    retype(qtbot, dialog, name)
    assert problem in dialog.findChild(QLabel, "calibration_problem").text()
    assert not ok(dialog).isEnabled()


def test_who_uses_the_new_tool_is_said(make: Callable[..., CalibrationDialog]) -> None:
    assert "once study.toml names it" in said(make())
    assert "Edit ▸ Tool…" in said(make(is_study=False))
    assert "stay as they are" in said(make())


def test_nothing_measured_writes_nothing(make: Callable[..., CalibrationDialog]) -> None:
    dialog = make(Calibration({}, 0))
    assert "No finished annotation measures magnetic-forceps" in said(dialog)
    assert "Finish some annotations by clicks" in dialog.findChild(QLabel, "calibration_problem").text()
    assert not ok(dialog).isEnabled()
    assert {row[3] for row in rows(dialog)} == {"—"}


def test_figures_of_few_measurements_are_cautioned_against(
    qtbot: QtBot, make: Callable[..., CalibrationDialog]
) -> None:
    dialog = make()
    caution = dialog.findChild(QLabel, "calibration_caution")
    assert caution.isVisible()
    assert "fewer than 5 measurements: link0 diameter, link2 height." in caution.text()
    # Return writes nothing; who means it still can.
    assert not ok(dialog).isDefault()
    assert ok(dialog).isEnabled()
    qtbot.keyClick(dialog, Qt.Key.Key_Return)
    assert dialog.result() == QDialog.DialogCode.Rejected


def test_figures_of_enough_measurements_need_no_caution(make: Callable[..., CalibrationDialog]) -> None:
    dialog = make(WELL_MEASURED)
    assert not dialog.findChild(QLabel, "calibration_caution").isVisible()
    assert ok(dialog).isDefault()


def test_one_annotation_is_spoken_of_as_one(make: Callable[..., CalibrationDialog]) -> None:
    measures = {"link0": LinkMeasures(length=Measured(11_234.56, None, 1))}
    dialog = make(Calibration(measures, 1))
    assert dialog.findChild(Heading).text() == "magnetic-forceps, measured in 1 finished annotation"


def test_a_low_screen_keeps_the_buttons(make: Callable[..., CalibrationDialog]) -> None:
    dialog = make()
    dialog.resize(dialog.minimumSizeHint())
    line = dialog.fontMetrics().height()
    assert dialog.height() < 30 * line
    assert dialog.rect().contains(ok(dialog).mapTo(dialog, ok(dialog).rect().bottomRight()))


def test_what_was_left_out_is_listed_with_its_reason(make: Callable[..., CalibrationDialog]) -> None:
    skipped = (UserError("it is not valid JSON", where="a.json"), UserError("another tool", where="b.json"))
    dialog = make(Calibration({}, 1, skipped))
    assert "2 files were left out" in said(dialog)
    text = dialog.findChild(QPlainTextEdit, "calibration_skipped").toPlainText()
    assert "a.json" in text
    assert "another tool" in text
    assert "1 file was left out" in said(make(Calibration({}, 1, skipped[:1])))


def test_it_says_where_only_ones_own_annotations_count(make: Callable[..., CalibrationDialog]) -> None:
    assert "in 12 finished annotations of your own" in said(make(is_own=True))
    assert "of your own" not in said(make())
