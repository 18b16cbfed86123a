"""Which volumes the checkpoint in use has predicted: looked for anew where it may be otherwise."""

from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.record import changed
from annotations.documents.study import load_study, save_study
from annotations.prediction import prediction_file
from annotator.session import Session
from tests.annotator.conftest import open_and_wait
from tests.annotator.reviewed_study import FIRST, SECOND, write_reviewed


def test_marks_of_another_checkpoint_go_at_once_and_a_failed_look_is_repeated(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_and_wait(qtbot, empty_session, write_reviewed(tmp_path / "study"))
    marks, predicting = empty_session.predicted_volumes, empty_session.predicting
    with qtbot.waitSignal(marks.changed):
        predicting.load(FIRST)

    def lost(*_: object) -> tuple[()]:
        raise OSError("the share does not answer")

    with monkeypatch.context() as patched:
        patched.setattr(prediction_file, "predicted_volumes", lost)
        predicting.load(SECOND)
        assert not marks.is_any
        qtbot.waitUntil(lambda: not empty_session.jobs.running)
    with qtbot.waitSignal(marks.changed):
        predicting.choose(SECOND.sha256)
        predicting.checkpoints_changed.emit()

    assert all(marks.has(item) for item in empty_session.items)


def test_a_volume_that_is_found_later_is_looked_for(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_reviewed(tmp_path / "study")
    study = load_study(folder)
    save_study(changed(study, volumes=study.volumes[:2]), folder)
    open_and_wait(qtbot, empty_session, folder)
    with qtbot.waitSignal(empty_session.predicted_volumes.changed):
        empty_session.predicting.load(FIRST)

    save_study(study, folder)
    with qtbot.waitSignal(empty_session.predicted_volumes.changed):
        empty_session.open_path(folder)

    assert [empty_session.predicted_volumes.has(item) for item in empty_session.items] == [True] * 3
