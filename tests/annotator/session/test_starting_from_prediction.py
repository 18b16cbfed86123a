"""An annotation that begins from a prediction: one edit, which nobody takes for a person's work."""

import signal
import subprocess
import sys

import pytest

from annotations.documents.recovery import find_recoveries
from annotations.documents.standing import standing
from tests.annotator.predicted_study import NAME, predict, settle
from tests.annotator.status_line import messages_of


class TestStarting:
    def test_it_is_one_edit_that_can_be_undone(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0])
        before = reviewing.document
        predicting.start_from_prediction()
        assert {standing(part) for part in reviewing.document.parts} == {"predicted"}
        assert reviewing.document.positions_um == predicting.prediction.positions_um
        assert reviewing.document.predicted_from.checkpoint == NAME
        assert reviewing.undo_stack.count == 1
        reviewing.undo()
        assert reviewing.document == before
        reviewing.redo()
        assert reviewing.document.predicted_from is not None

    def test_touching_a_keypoint_makes_it_the_persons_own(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0])
        predicting.start_from_prediction()
        reviewing.place((1000.0, 1000.0, 1000.0), "dragged", "k1")
        assert [part.source for part in reviewing.document.parts][:2] == ["predicted", "dragged"]

    def test_accepting_leaves_what_was_touched_and_is_undone_at_once(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0])
        predicting.start_from_prediction()
        reviewing.place((1000.0, 1000.0, 1000.0), "dragged", "k1")
        before = reviewing.document
        predicting.accept_predicted()
        after = reviewing.document
        assert after.part("k1") == before.part("k1")
        assert {part.source for part in after.parts} == {"adopted", "dragged"}
        assert after.part("k0").adopted_from == NAME
        assert after.positions_um == before.positions_um
        assert {standing(part) for part in after.parts} == {"counted"}
        reviewing.undo()
        assert reviewing.document == before

    def test_calling_one_placed_accepts_it_alone(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0])
        predicting.start_from_prediction()
        reviewing.set_state("k2", "placed")
        assert [part.source for part in reviewing.document.parts].count("adopted") == 1

    def test_the_time_is_counted(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0])
        before = reviewing.active_seconds
        qtbot.wait(150)
        predicting.start_from_prediction()
        assert reviewing.active_seconds > before

    def test_it_is_told_when_nothing_is_left_to_place(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0])
        predicting.start_from_prediction()
        said = messages_of(reviewing)
        predicting.start_from_prediction()
        assert said[-1].startswith("Nothing was placed")
        assert reviewing.undo_stack.count == 1

    def test_what_nobody_accepted_is_told_when_it_is_done(self, qtbot, reviewing, predicting):
        predict(qtbot, reviewing, [0])
        predicting.start_from_prediction()
        said = messages_of(reviewing)
        reviewing.set_status("done")
        assert "nobody has accepted or corrected k0, k1" in said[-1]


START_AND_DIE = """
import os, signal, sys, time
from pathlib import Path
from PySide6.QtCore import QCoreApplication
from annotations.prediction.checkpoint import load_checkpoint
from annotator.session import Session
from annotator.session.options import SessionOptions

folder, state, checkpoint = map(Path, sys.argv[1:])
application = QCoreApplication([])
options = SessionOptions("rita", recovery_folder=state / "recovery", level_cache_folder=state / "levels")
session = Session(options)
session.open_path(folder)
while session.volume is None:
    application.processEvents()
session.predicting.load(load_checkpoint(checkpoint))
while session.predicting.prediction is None:
    application.processEvents()
session.predicting.start_from_prediction()
assert session.undo_stack.count == 1
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kill -9 is POSIX")
def test_a_start_survives_kill_9_and_is_one_edit_then(
    qtbot, reviewing, predicting, folder, options, tmp_path
):
    predict(qtbot, reviewing, [0])
    asked = [str(folder), str(tmp_path / "dead"), str(predicting.current.path)]
    # A document has one window: this one gives it up.
    reviewing.close_volume()
    done = subprocess.run([sys.executable, "-c", START_AND_DIE, *asked], timeout=100, check=False)
    assert done.returncode == -signal.SIGKILL
    (recovery,) = find_recoveries(tmp_path / "dead" / "recovery")
    with qtbot.waitSignal(reviewing.volume_changed, check_params_cb=lambda: reviewing.volume is not None):
        reviewing.recover(recovery)
    assert {part.source for part in reviewing.document.parts} == {"predicted"}
    assert reviewing.document.predicted_from.checkpoint == NAME
    settle(qtbot, reviewing)
    reviewing.undo()
    assert not reviewing.document.positions_um
