"""From the demo study and the checkpoint that ships to errors, verdicts and a report, by a person's hands."""

import csv
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDockWidget, QLineEdit, QTreeView
from pytestqt.qtbot import QtBot

from annotations import demo
from annotations.demo import make_demo_study
from annotations.documents.record import changed
from annotations.prediction.checkpoint import load_checkpoint, save_checkpoint
from annotations.prediction.errors.error_table import ErrorsOfVolume
from annotations.prediction.errors.study_errors import kept_predictions, study_errors
from annotations.prediction.shipped import shipped_checkpoint
from annotations.prediction.verdicts.verdict_file import load_verdicts
from annotator.dialogs.checkpoint_dialog import CheckpointDialog
from annotator.dialogs.exports.errors_export_dialog import ErrorsExportDialog
from annotator.panels.predictions.predictions_panel import PredictionsPanel
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.window.main_window import MainWindow
from tests.annotator.conftest import open_and_wait
from tests.annotator.redrawn import redrawn
from tests.annotator.reviewed_study import FAR, LACKING, NEAR, review, write_reviewed
from tests.annotator.window.conftest import Person

NAME = "magnetic-forceps"
LONG_MS = 180_000


@pytest.fixture
def rita(qtbot: QtBot, options: SessionOptions) -> Iterator[Session]:
    """The session of somebody who annotates nothing; nothing is open yet."""
    session = Session(replace(options, annotator_name="rita"))
    yield session
    session.shut_down()


@pytest.fixture
def small_demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The demo study of smaller volumes, in which nothing is predicted yet."""
    monkeypatch.setattr(demo, "_SHAPE", (60, 150, 90))
    monkeypatch.setattr(demo, "shipped_checkpoint", lambda _tool: None)
    return make_demo_study(tmp_path / "demo")


@pytest.fixture
def ritas(
    qtbot: QtBot,
    make_window: Callable[..., MainWindow],
    person_at: Callable[[MainWindow], Person],
    rita: Session,
) -> Person:
    """The same person at a window."""
    return person_at(make_window(rita))


def open_study(qtbot: QtBot, session: Session, folder: Path) -> None:
    # Else a person who is not named in it is asked who they are.
    session.identifying.confirm(folder, session.person)
    open_and_wait(qtbot, session, folder)


def at_rest(qtbot: QtBot, session: Session) -> None:
    qtbot.waitUntil(lambda: not session.jobs.running, timeout=LONG_MS)


def opened(qtbot: QtBot, session: Session, volume: str) -> None:
    qtbot.waitUntil(
        lambda: session.reviewing.open_volume == volume and not session.jobs.running, timeout=LONG_MS
    )


def rows(session: Session) -> Sequence[ErrorsOfVolume]:
    table = session.reviewing.table
    return table.rows if table is not None else ()


def panel_of(window: MainWindow) -> PredictionsPanel:
    found = window.findChild(PredictionsPanel)
    assert isinstance(found, PredictionsPanel)
    return found


def test_from_the_demo_study_to_a_report(
    qtbot: QtBot, ritas: Person, rita: Session, small_demo: Path, tmp_path: Path
) -> None:
    open_study(qtbot, rita, small_demo)
    window, panel = ritas.window, panel_of(ritas.window)
    assert not panel.isVisible()
    ritas.action("panel_predictions").trigger()
    assert panel.isVisible()

    # Load what ships, and let it predict.
    ritas.click(panel, "predictions_shipped_checkpoint")
    ritas.click(ritas.dialog(CheckpointDialog), "checkpoint_use")
    at_rest(qtbot, rita)
    assert not ritas.action("export_errors").isEnabled()
    ritas.click(panel, "predictions_predict_study")
    assert rita.predicting.is_predicting
    qtbot.waitUntil(lambda: len(rows(rita)) == 5, timeout=LONG_MS)
    at_rest(qtbot, rita)

    # What the table shows is what the library computes of the files.
    predictions, unread = kept_predictions(small_demo, NAME, rita.predicting.checkpoints[0].sha256)
    expected = study_errors(small_demo, predictions, unjudged=unread)
    assert [row.targets for row in rows(rita)] == [row.targets for row in expected.rows]

    # A second one, beside it.
    path = shipped_checkpoint(NAME)
    assert path is not None
    shipped = load_checkpoint(path)
    copy = save_checkpoint(tmp_path / "copy.onnx", changed(shipped.description, name="copy"), shipped.model)
    rita.predicting.load(copy)
    ritas.action("predict_study").trigger()
    qtbot.waitUntil(lambda: len(rows(rita)) == 5, timeout=LONG_MS)
    at_rest(qtbot, rita)
    found = rita.reviewing.review
    assert found is not None
    assert found.is_paired
    assert found.material.paired is not None
    difference = found.material.paired.by_formulas.targets["position_mm"].differences[0].difference
    assert difference.mean == pytest.approx(0.0, abs=1e-9)

    # The worst one is first; from there the keys lead to the best.
    worst, second = rita.reviewing.order[:2]
    rita.reviewing.open(worst)
    opened(qtbot, rita, worst)
    ritas.action("next_worse").trigger()
    opened(qtbot, rita, second)
    assert "prediction" in rita.view.layers
    assert rita.predicting.shown is not None
    ritas.action("verdict_model_wrong").trigger()
    assert ritas.action("verdict_model_wrong").isChecked()
    kept = load_verdicts(small_demo, "copy", copy.sha256, "rita")
    assert kept is not None
    assert [(each.volume, each.verdict) for each in kept.verdicts] == [(second, "model_wrong")]

    # What is exported is what is shown.
    ritas.action("export_errors").trigger()
    dialog = ritas.dialog(ErrorsExportDialog)
    folder = dialog.findChild(QLineEdit, "errors_export_folder")
    assert isinstance(folder, QLineEdit)
    assert folder.text() == str(small_demo / "errors")
    folder.setText(str(tmp_path / "report"))
    with qtbot.waitSignal(rita.reporting.exported, timeout=LONG_MS):
        ritas.click(dialog, "errors_export_ok")
    report = tmp_path / "report"
    assert "<html" in (report / "errors.html").read_text()
    assert json.loads((report / "errors.json").read_text())
    assert "copy" in (report / "errors.txt").read_text()
    with (report / "errors-csv" / "verdicts.csv").open(newline="", encoding="utf-8-sig") as lines:
        (said,) = csv.DictReader(lines)
    assert second in said.values()
    assert "rita" in said.values()
    window.session.abandon()


def test_walking_keeps_the_camera_and_what_is_shown(
    qtbot: QtBot, ritas: Person, rita: Session, tmp_path: Path
) -> None:
    open_study(qtbot, rita, write_reviewed(tmp_path / "study"))
    scene = ritas.window.scene
    with qtbot.waitSignal(ritas.window.scene_prepared, timeout=LONG_MS):
        ritas.window.prepare_scene()
    review(qtbot, rita)
    rita.reviewing.open(FAR)
    opened(qtbot, rita, FAR)
    scene.look_from("+x")
    rita.toggle_layer("names")
    camera, layers = scene.camera, rita.view.layers
    assert camera is not None

    ritas.action("next_worse").trigger()

    opened(qtbot, rita, LACKING)
    assert scene.camera == camera
    assert rita.view.layers == layers
    ritas.action("next_worse").trigger()
    opened(qtbot, rita, NEAR)
    ritas.action("previous_worse").trigger()
    opened(qtbot, rita, LACKING)
    assert scene.camera == camera


def test_actions_are_there_for_those_who_can_use_them(
    qtbot: QtBot, ritas: Person, rita: Session, tmp_path: Path
) -> None:
    names = ("compute_errors", "next_worse", "verdict_both_wrong", "export_errors")
    open_study(qtbot, rita, write_reviewed(tmp_path / "study"))
    assert [ritas.action(name).isEnabled() for name in names] == [False] * 4
    dock = ritas.window.findChild(QDockWidget, "dock_predictions")
    assert isinstance(dock, QDockWidget)
    assert dock.isHidden()

    review(qtbot, rita)

    assert [ritas.action(name).isEnabled() for name in names] == [True] * 4
    ritas.action("verdict_both_wrong").trigger()
    assert ritas.action("verdict_both_wrong").isChecked()
    ritas.action("verdict_both_wrong").trigger()
    assert not ritas.action("verdict_both_wrong").isChecked()
    with qtbot.waitSignal(rita.reviewing.computed, timeout=LONG_MS):
        ritas.action("compute_errors").trigger()
    assert dock.isVisible()


def test_a_report_that_is_old_says_so_and_can_be_computed_first(
    qtbot: QtBot, ritas: Person, rita: Session, tmp_path: Path
) -> None:
    open_study(qtbot, rita, write_reviewed(tmp_path / "study"))
    review(qtbot, rita)
    rita.predicting.predicted.emit()
    ritas.action("export_errors").trigger()
    dialog = ritas.dialog(ErrorsExportDialog)

    with qtbot.waitSignal(rita.reviewing.computed, timeout=LONG_MS):
        ritas.click(dialog, "errors_export_again")

    assert not ritas.has_dialog()
    assert not (tmp_path / "study" / "errors").exists()
    at_rest(qtbot, rita)


def test_the_arrow_keys_walk_and_stay_in_the_list(
    qtbot: QtBot, ritas: Person, rita: Session, tmp_path: Path
) -> None:
    open_study(qtbot, rita, write_reviewed(tmp_path / "study"))
    ritas.action("panel_predictions").trigger()
    review(qtbot, rita)
    view = redrawn(ritas.window).findChild(QTreeView, "errors_list")
    assert isinstance(view, QTreeView)
    rita.reviewing.open(FAR)
    opened(qtbot, rita, FAR)
    view.setFocus()

    for expected in (LACKING, NEAR):
        ritas.press(Qt.Key.Key_Down)
        opened(qtbot, rita, expected)
        assert view.hasFocus()
