"""A reviewer's way through a study: rank, settle, take one, move one, accept, go on; then export."""

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLineEdit, QPlainTextEdit, QToolButton, QTreeView, QWidget
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation
from annotations.documents.study import CONSENSUS, annotation_path
from annotator.dialogs.exports.training_export_dialog import TrainingExportDialog
from annotator.dialogs.exports.training_report_dialog import TrainingReportDialog
from annotator.session import Session
from annotator.window.main_window import MainWindow
from tests.annotator.conftest import open_and_wait
from tests.annotator.settled_study import LATE_IMPORTS_MS, contents, position_um, write_settled_study
from tests.annotator.window.conftest import Person


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_settled_study(tmp_path / "study")


def open_as(qtbot: QtBot, session: Session, folder: Path, name: str) -> None:
    session.set_annotator_name(name)
    open_and_wait(qtbot, session, folder)


def at_rest(qtbot: QtBot, session: Session, volume_id: str) -> None:
    def is_there() -> bool:
        index = session.current_index
        return (
            index is not None
            and session.items[index].volume_id == volume_id
            and session.settling.consensus is not None
            and not session.jobs.running
        )

    qtbot.waitUntil(is_there)


def take(window: MainWindow, name: str, annotator: str) -> None:
    button = window.findChild(QToolButton, f"consensus_take_{name}")
    assert button is not None
    menu = button.menu()
    menu.aboutToShow.emit()
    next(action for action in menu.actions() if action.text().startswith(annotator)).trigger()


def test_a_reviewer_walks_from_the_worst_volume_to_the_next(
    qtbot: QtBot,
    make_window: Callable[..., MainWindow],
    empty_session: Session,
    person_at: Callable[[MainWindow], Person],
    folder: Path,
) -> None:
    session = empty_session
    open_as(qtbot, session, folder, "rita")
    window = make_window(session)
    reviewer = person_at(window)
    before = contents(folder)
    assert not reviewer.action("propose_consensus").isEnabled()

    reviewer.press(Qt.Key.Key_R, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier)
    qtbot.waitUntil(lambda: bool(session.settling.entries), timeout=LATE_IMPORTS_MS)
    ranks = window.findChild(QTreeView, "triage_list")
    assert ranks is not None
    qtbot.waitUntil(ranks.isVisible)
    ranks.setFocus()
    ranks.setCurrentIndex(ranks.model().index(0, 0))
    reviewer.press(Qt.Key.Key_Return)
    at_rest(qtbot, session, "v003")
    assert "v003.npy" in window.windowTitle()
    assert "Pilot: consensus" in window.windowTitle()
    # Everybody's points are drawn with it, in the scene and the slices.
    assert [other.annotator for other in session.others.drawn] == ["anna", "ben", "carl"]
    assert reviewer.action("propose_consensus").isEnabled()

    take(window, "k1", "ben")
    reviewer.press(Qt.Key.Key_P)
    session.look(crosshair_um=(300.0, 300.0, 200.0), active_part="k2")
    qtbot.waitUntil(lambda: reviewer.slice(2).viewport is not None)
    reviewer.click_slice(2, (400.0, 400.0, 200.0))
    reviewer.press(Qt.Key.Key_Escape)
    assert session.document is not None
    moved_um = session.document.positions_um["k2"]
    assert session.document.part("k2").source == "clicked"

    reviewer.click(window, "consensus_accept")
    at_rest(qtbot, session, "v001")
    settled, _ = load_annotation(annotation_path(folder, CONSENSUS, "v003", "keypoints"))
    assert settled.status == "done"
    assert settled.positions_um["k1"] == position_um(1, "ben")
    assert settled.positions_um["k2"] == moved_um
    assert settled.part("k1").adopted_from == "ben"
    assert contents(folder) == before

    reviewer.press(Qt.Key.Key_B, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier)
    qtbot.waitUntil(lambda: session.annotator_name == "rita")


def test_a_reviewer_exports_what_is_settled(
    qtbot: QtBot,
    make_window: Callable[..., MainWindow],
    empty_session: Session,
    person_at: Callable[[MainWindow], Person],
    folder: Path,
    tmp_path: Path,
) -> None:
    session = empty_session
    open_as(qtbot, session, folder, "rita")
    window = make_window(session)
    reviewer = person_at(window)
    session.settling.settle("v002")
    at_rest(qtbot, session, "v002")
    session.set_status("done")
    reviewer.action("export_targets").trigger()
    dialog = reviewer.dialog(TrainingExportDialog)
    line = dialog.findChild(QLineEdit, "training_export_path")
    assert line is not None
    line.setText(str(tmp_path / "targets.csv"))
    reviewer.click(dialog, "training_export_ok")
    report = reviewer.dialog(TrainingReportDialog)
    text = report.findChild(QPlainTextEdit, "training_report_text")
    assert text is not None
    assert "1 row by keypoints" in text.toPlainText()
    assert (tmp_path / "targets.csv").exists()
    reviewer.click(report, "training_report_close")


def test_an_annotator_has_none_of_it(
    qtbot: QtBot,
    make_window: Callable[..., MainWindow],
    empty_session: Session,
    person_at: Callable[[MainWindow], Person],
    folder: Path,
) -> None:
    open_as(qtbot, empty_session, folder, "anna")
    window = make_window(empty_session)
    annotator = person_at(window)
    for name in ("settle_consensus", "propose_consensus", "rank_volumes", "leave_consensus"):
        assert not annotator.action(name).isEnabled()
    for name in ("export_targets", "export_agreement"):
        action = annotator.action(name)
        assert not action.isEnabled()
        # The tooltip says why.
        assert "reviewers" in action.toolTip() or "your own work" in action.toolTip()
    assert not annotator.has_dialog()
    annotator.action("panel_consensus").trigger()
    reason = window.findChild(QWidget, "consensus_reason")
    assert reason is not None
    assert reason.isVisible()
