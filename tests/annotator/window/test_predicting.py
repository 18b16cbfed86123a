"""A person loads a checkpoint, lets it predict, looks at what it says, and starts an annotation from it."""

import json
import pickle
import shutil
import signal
import sys

import pytest
from PySide6.QtCore import QItemSelectionModel, Qt
from PySide6.QtWidgets import QFileDialog, QLabel, QPushButton, QToolButton, QTreeView

from annotations.documents.record import changed
from annotations.documents.study import ViewingRules, load_study, save_study
from annotations.prediction import inference_child
from annotations.prediction.shipped import shipped_checkpoint
from annotator.dialogs.checkpoint_dialog import CheckpointDialog
from annotator.dialogs.error_dialog import ErrorDialog
from annotator.dialogs.exports.unjudged_dialog import UnjudgedDialog
from annotator.session import Session
from tests.annotations.prediction.tiny_networks import DESCRIPTION, redescribed, rewritten, save_tiny
from tests.annotator.predicted_study import IDS, NAME
from tests.annotator.redrawn import redrawn

LONG_MS = 20_000


@pytest.fixture
def folder(tmp_path, predicted_study):
    return shutil.copytree(predicted_study, tmp_path / "study")


def at_study(qtbot, make_window, session, person_at, folder, name):
    session.set_annotator_name(name)
    session.identifying.confirm(folder, name)
    person = person_at(make_window(session))
    person.window.open_path(folder)
    qtbot.waitUntil(lambda: session.volume is not None, timeout=LONG_MS)
    qtbot.waitUntil(lambda: not session.jobs.running, timeout=LONG_MS)
    person.window.slices[2].setFocus()
    return person


@pytest.fixture
def reviewer(qtbot, make_window, empty_session, person_at, folder):
    """Somebody who only reviews, at the first volume of the study."""
    return at_study(qtbot, make_window, empty_session, person_at, folder, "rita")


def settle(qtbot, session):
    qtbot.waitUntil(lambda: not session.jobs.running, timeout=LONG_MS)


def use_shipped(person):
    person.action("shipped_checkpoint").trigger()
    person.click(person.dialog(CheckpointDialog), "checkpoint_use")


def load_by_menu(person, path, monkeypatch):
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_asked: (str(path), ""))
    person.action("load_checkpoint").trigger()


def path_of(folder, volume_id):
    return folder / "predictions" / NAME / f"{volume_id}.json"


class TestLoading:
    def test_it_is_told_that_it_fits_and_it_is_taken_into_use(self, qtbot, reviewer, empty_session):
        person, predicting = reviewer, empty_session.predicting
        assert not person.action("predict_volume").isEnabled()
        person.press(Qt.Key.Key_L, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
        dialog = person.dialog(CheckpointDialog)
        assert dialog.findChild(QLabel, "checkpoint_fit").text() == "The tool and the volume that are open"
        assert predicting.current is None
        person.click(dialog, "checkpoint_use")
        assert predicting.current.description.name == NAME
        assert person.action("predict_volume").isEnabled()
        person.action("shipped_checkpoint").trigger()
        dialog = person.dialog(CheckpointDialog)
        again = dialog.findChild(QPushButton, "checkpoint_use")
        assert (again.text(), again.isEnabled()) == ("In use", False)
        person.click(dialog, "checkpoint_close")

    def test_one_for_another_tool_says_so_and_cannot_be_used(
        self, reviewer, empty_session, tmp_path, monkeypatch
    ):
        load_by_menu(reviewer, save_tiny(tmp_path / "tiny.onnx").path, monkeypatch)
        dialog = reviewer.dialog(CheckpointDialog)
        assert "'needle'" in dialog.findChild(QLabel, "checkpoint_fit").text()
        assert not dialog.findChild(QPushButton, "checkpoint_use").isEnabled()
        reviewer.click(dialog, "checkpoint_close")
        assert empty_session.predicting.checkpoints == ()

    def test_the_menu_file_leads_to_the_same_dialog(self, reviewer, empty_session):
        reviewer.window.open_path(shipped_checkpoint(NAME))
        reviewer.click(reviewer.dialog(CheckpointDialog), "checkpoint_use")
        assert empty_session.predicting.current is not None


def truncated(path):
    save_tiny(path)
    path.write_bytes(path.read_bytes()[:-40])


def pickled(path):
    path.write_bytes(pickle.dumps({"weights": [1, 2, 3]}))


def leading_elsewhere(path):
    def lead_elsewhere(model):
        (weights,) = model.graph.initializer
        weights.ClearField("raw_data")
        weights.data_location = weights.EXTERNAL
        weights.external_data.add(key="location", value="/etc/passwd")

    save_tiny(path)
    rewritten(path, lead_elsewhere)


def newer(path):
    save_tiny(path)
    redescribed(path, json.dumps({"schema": "oct-checkpoint/2"}))


def without_spacing(path):
    save_tiny(path)
    fields = DESCRIPTION.model_dump(mode="json")
    del fields["sampling"]["spacing_um"]
    redescribed(path, json.dumps(fields))


def of_other_keypoints(path):
    save_tiny(path)
    fields = DESCRIPTION.model_dump(mode="json")
    fields["keypoints"] = ["tip", "nowhere"]
    redescribed(path, json.dumps(fields))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (truncated, "truncated"),
        (pickled, "can hold code"),
        (leading_elsewhere, "in another file"),
        (newer, "newer program"),
        (without_spacing, "spacing_um"),
        (of_other_keypoints, "keypoint"),
    ],
)
def test_a_wrong_checkpoint_is_refused_with_its_reason_and_nothing_else_changes(
    reviewer, empty_session, checkpoint, tmp_path, monkeypatch, make, said
):
    session = empty_session
    session.predicting.load(checkpoint)
    make(tmp_path / "wrong.onnx")
    document, view = session.document, session.view
    load_by_menu(reviewer, tmp_path / "wrong.onnx", monkeypatch)
    dialog = reviewer.dialog(ErrorDialog)
    texts = " ".join(label.text() for label in dialog.findChildren(QLabel))
    assert said in texts
    assert "wrong.onnx" in texts
    assert dialog.findChild(QLabel, "error_remedy").text()
    reviewer.click(dialog, "error_close")
    assert session.predicting.checkpoints == (checkpoint,)
    assert (session.document, session.view) == (document, view)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="a system that kills is POSIX")
def test_where_the_memory_is_full_a_dialog_says_so_and_nothing_else_changes(
    qtbot, reviewer, empty_session, folder, monkeypatch
):
    use_shipped(reviewer)
    dying = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    monkeypatch.setattr(inference_child, "_COMMAND", (sys.executable, "-c", dying))
    document, view = empty_session.document, empty_session.view
    reviewer.action("predict_volume").trigger()
    dialog = reviewer.dialog(ErrorDialog)
    assert "the memory is full" in dialog.findChild(QLabel, "error_problem").text()
    reviewer.click(dialog, "error_close")
    assert (empty_session.document, empty_session.view) == (document, view)
    assert not (folder / "predictions").exists()
    assert reviewer.action("predict_volume").isEnabled()


class TestPredicting:
    def test_the_open_volume_is_predicted_and_shown_by_a_key(self, qtbot, network, reviewer, empty_session):
        use_shipped(reviewer)
        reviewer.window.activateWindow()
        reviewer.window.slices[2].setFocus()
        qtbot.waitUntil(reviewer.window.isActiveWindow)
        reviewer.press(Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
        qtbot.waitUntil(lambda: empty_session.predicting.shown is not None, timeout=LONG_MS)
        assert reviewer.action("layer_prediction").isChecked()
        assert network.asked == ["v001.npy"]

    def test_the_selected_volumes_are_predicted(self, qtbot, network, reviewer, empty_session, folder):
        use_shipped(reviewer)
        # The open volume is selected in its turn.
        items = redrawn(reviewer.window).findChild(QTreeView, "worklist_list")
        rows = QItemSelectionModel.SelectionFlag.Select | QItemSelectionModel.SelectionFlag.Rows
        items.selectionModel().select(items.model().index(2, 0), rows)
        reviewer.action("predict_selection").trigger()
        qtbot.waitUntil(lambda: not empty_session.predicting.is_predicting, timeout=LONG_MS)
        assert network.asked == ["v001.npy", "v003.npy"]
        assert empty_session.current_index == 0

    def test_a_run_over_the_study_is_cancelled_where_its_progress_is_shown(
        self, qtbot, network, reviewer, empty_session, folder
    ):
        use_shipped(reviewer)
        network.fails = lambda _name: network.go_on.clear()
        reviewer.action("predict_study").trigger()
        qtbot.waitUntil(lambda: len(network.asked) == 2, timeout=LONG_MS)
        assert not reviewer.action("predict_study").isEnabled()
        cancel = reviewer.window.findChild(QToolButton, "jobs_cancel")
        qtbot.waitUntil(cancel.isVisible)
        reviewer.click(reviewer.window, "jobs_cancel")
        qtbot.waitUntil(lambda: not empty_session.predicting.is_predicting, timeout=LONG_MS)
        assert [path_of(folder, name).exists() for name in IDS] == [True, False, False]
        assert reviewer.action("predict_study").isEnabled()


class TestStarting:
    @pytest.fixture
    def started(self, qtbot, network, reviewer, empty_session):
        use_shipped(reviewer)
        reviewer.action("predict_volume").trigger()
        qtbot.waitUntil(lambda: empty_session.predicting.shown is not None, timeout=LONG_MS)
        assert not reviewer.action("accept_prediction").isEnabled()
        reviewer.action("start_from_prediction").trigger()
        return reviewer

    def test_accept_undo_and_redo(self, started, empty_session):
        def sources():
            return {part.source for part in empty_session.document.parts}

        assert sources() == {"predicted"}
        started.action("accept_prediction").trigger()
        assert sources() == {"adopted"}
        assert not started.action("accept_prediction").isEnabled()
        started.action("undo").trigger()
        assert sources() == {"predicted"}
        started.action("undo").trigger()
        assert sources() == {None}
        started.action("redo").trigger()
        assert sources() == {"predicted"}

    def test_the_key_that_says_placed_accepts_the_active_keypoint(self, started, empty_session):
        started.action("keypoint_2").trigger()
        started.action("state_placed").trigger()
        assert empty_session.document.part("k1").source == "adopted"
        assert empty_session.document.part("k0").source == "predicted"

    @pytest.mark.parametrize(
        ("answer", "status", "source"),
        [
            ("accept", "done", "adopted"),
            ("leave", "done", "predicted"),
            ("cancel", "in_progress", "predicted"),
        ],
    )
    def test_marking_as_done_asks_about_what_nobody_has_judged(
        self, started, empty_session, answer, status, source
    ):
        started.action("mark_done").trigger()
        dialog = started.dialog(UnjudgedDialog)
        assert "k0, k1" in dialog.findChild(QLabel, "unjudged_problem").text()
        started.click(dialog, f"unjudged_{answer}")
        assert empty_session.document.status == status
        assert {part.source for part in empty_session.document.parts} == {source}


class TestBlind:
    def test_an_annotator_whose_work_is_not_done_sees_and_starts_nothing(
        self, qtbot, network, make_window, empty_session, person_at, folder
    ):
        person = at_study(qtbot, make_window, empty_session, person_at, folder, "anna")
        use_shipped(person)
        person.action("predict_volume").trigger()
        qtbot.waitUntil(lambda: not empty_session.predicting.is_predicting, timeout=LONG_MS)
        settle(qtbot, empty_session)
        assert empty_session.predicting.prediction is not None
        action = person.action("start_from_prediction")
        assert not action.isEnabled()
        assert "not done yet" in action.toolTip()
        assert not person.action("layer_prediction").isChecked()

    def test_where_one_may_look_it_starts_nothing_either(
        self, qtbot, network, make_window, empty_session: Session, person_at, folder
    ):
        save_study(changed(load_study(folder), viewing=ViewingRules(may_look=True)), folder)
        person = at_study(qtbot, make_window, empty_session, person_at, folder, "anna")
        use_shipped(person)
        person.action("predict_volume").trigger()
        qtbot.waitUntil(lambda: empty_session.predicting.prediction is not None, timeout=LONG_MS)
        assert empty_session.seeing.look_anyway()
        settle(qtbot, empty_session)
        assert not person.action("start_from_prediction").isEnabled()
        assert "not done yet" in person.action("start_from_prediction").toolTip()
