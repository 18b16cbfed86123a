"""Verdicts and their notes: recorded at once, lost by nothing, told when they are old."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from annotations.durable_files import SaveError
from annotations.prediction.verdicts import verdict_file
from annotations.prediction.verdicts.verdict_file import load_verdicts, record_verdict
from annotations.prediction.verdicts.verdicts import verdict_on
from annotator.panels.predictions.predictions_panel import PredictionsPanel
from annotator.session import Session
from tests.annotator.panels.predictions.panel_reading import (
    button,
    cells,
    choose,
    note,
    opened,
    volumes,
    words,
)
from tests.annotator.redrawn import redrawn
from tests.annotator.reviewed_study import FAR, FIRST, NEAR, SECOND, annotation_of, compute, review

LEFT = Qt.MouseButton.LeftButton


def test_a_verdict_is_recorded_changed_and_taken_back(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    for name in ("model_wrong", "annotation_wrong"):
        qtbot.mouseClick(button(panel, f"verdict_{name}"), LEFT)

        kept = load_verdicts(folder, "first", FIRST.sha256, "rita")
        assert kept is not None
        (said,) = kept.verdicts
        assert (said.volume, said.verdict, said.annotator) == ("v001", name, "anna")
        assert [
            each
            for each in ("model_wrong", "annotation_wrong")
            if button(panel, f"verdict_{each}").isChecked()
        ] == [name]
    assert "annotation" in cells(panel, "verdict")
    choose(panel, "errors_kind", "No verdict")
    assert volumes(panel) == [FAR, NEAR]
    choose(panel, "errors_kind", "All")

    qtbot.mouseClick(button(panel, "verdict_annotation_wrong"), LEFT)

    kept = load_verdicts(folder, "first", FIRST.sha256, "rita")
    assert kept is not None
    assert kept.verdicts == ()
    assert cells(panel, "verdict") == ["", "", ""]


def said_on(folder: Path, volume: str) -> str:
    """Return the note that is kept with a verdict of rita's."""
    kept = load_verdicts(folder, "first", FIRST.sha256, "rita")
    said = kept.on(volume) if kept is not None else None
    return "" if said is None else said.note


def test_a_note_is_kept_with_the_verdict(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    assert not note(panel).isEnabled()
    qtbot.mouseClick(button(panel, "verdict_model_wrong"), LEFT)
    assert note(panel).isEnabled()

    qtbot.keyClicks(note(panel), "k5 is in")
    qtbot.waitUntil(lambda: "k5 is in" in said_on(folder, "v001"))
    qtbot.keyClicks(note(panel), " the shadow")
    # It is not lost by going on without leaving the field.
    rita.reviewing.step(1)
    opened(qtbot, rita, FAR)

    assert said_on(folder, "v001") == "k5 is in the shadow"
    assert note(panel).text() == ""
    text = redrawn(panel).findChild(QLineEdit, "errors_filter")
    assert isinstance(text, QLineEdit)
    text.setText("shadow")
    assert volumes(panel) == ["v001"]


def test_a_note_that_cannot_be_written_stays_in_the_field(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    review(qtbot, rita)
    qtbot.mouseClick(button(panel, "verdict_model_wrong"), LEFT)

    def full(*_args: object, **_fields: object) -> None:
        raise SaveError("the disk is full", where=folder)

    with monkeypatch.context() as patched:
        patched.setattr(verdict_file, "record_verdict", full)
        with qtbot.waitSignal(rita.error_raised):
            qtbot.keyClicks(note(panel), "a long thought")
    assert note(panel).text() == "a long thought"
    assert said_on(folder, "v001") == ""

    qtbot.keyClicks(note(panel), " more")
    qtbot.waitUntil(lambda: said_on(folder, "v001") == "a long thought more")


def test_a_note_goes_to_the_verdict_for_which_it_was_typed(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita, SECOND, FIRST)
    qtbot.mouseClick(button(panel, "verdict_model_wrong"), LEFT)
    qtbot.keyClicks(note(panel), "of the first")

    rita.predicting.choose(SECOND.sha256)

    assert said_on(folder, "v001") == "of the first"
    assert note(panel).text() == ""


def test_a_verdict_on_what_was_changed_since_is_marked_and_given_anew(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    qtbot.mouseClick(button(panel, "verdict_annotation_wrong"), LEFT)
    path = annotation_of(folder, "v001")
    path.write_text(path.read_text().replace("[8", "[9", 1))

    compute(qtbot, rita)

    assert cells(panel, "verdict")[volumes(panel).index("v001")] == "annotation*"
    qtbot.mouseClick(button(panel, "verdict_annotation_wrong"), LEFT)
    assert cells(panel, "verdict")[volumes(panel).index("v001")] == "annotation"


def test_what_other_reviewers_say_is_shown(
    qtbot: QtBot, rita: Session, panel: PredictionsPanel, folder: Path
) -> None:
    review(qtbot, rita)
    row, found = rita.reviewing.row_of("v001"), rita.reviewing.table
    assert row is not None
    assert found is not None
    assert found.checkpoint is not None
    record_verdict(
        folder, "first", FIRST.sha256, "rob", verdict_on(row, found.checkpoint, "both_wrong", "look again")
    )

    compute(qtbot, rita)

    assert cells(panel, "verdict")[volumes(panel).index("v001")] == "(both)"
    assert words(panel, "verdict_words") == "Wrong, says rob: both – look again"
