"""The session's live view: what it is kept from, and what it asks only once."""

import numpy as np
import pytest

from annotator.session.predictions.living import Playback
from tests.annotations.prediction.tiny_networks import save_tiny
from tests.annotator.blind_study import write_study
from tests.annotator.conftest import open_and_wait


@pytest.fixture
def told(empty_session):
    errors = []
    empty_session.living.failed.connect(errors.append)
    return errors


def test_in_blind_work_predictions_of_the_studys_volumes_are_kept_from_view(
    qtbot, empty_session, told, tmp_path
):
    study = write_study(tmp_path / "study")
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    open_and_wait(qtbot, empty_session, study)
    assert empty_session.is_blind

    for folder in (study, study / "volumes", tmp_path):
        empty_session.living.start(folder, Playback(), keeps=False)

    assert [error.problem.partition(":")[0] for error in told] == [
        "In this study predictions are kept from you until your own work is done"
    ] * 3
    assert not empty_session.living.is_running
    assert empty_session.living.refusal(tmp_path / "elsewhere") == ""


def test_a_blind_study_that_is_opened_meanwhile_ends_it(qtbot, empty_session, told, tmp_path):
    study = write_study(tmp_path / "study")
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    empty_session.living.start(study, None, keeps=False)
    assert empty_session.living.is_running

    open_and_wait(qtbot, empty_session, study)

    assert not empty_session.living.is_running
    assert len(told) == 1


def test_without_a_checkpoint_nothing_starts(empty_session, told, tmp_path):
    empty_session.living.start(tmp_path, None, keeps=False)

    assert [error.problem for error in told] == ["Load a checkpoint first"]
    assert empty_session.living.statistics is None


def test_the_session_ends_it(qtbot, empty_session, tmp_path):
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    (tmp_path / "volumes").mkdir()
    np.save(tmp_path / "volumes" / "v1.npy", np.zeros((6, 20, 16), dtype=np.uint8))
    living = empty_session.living
    living.start(tmp_path / "volumes", Playback(), keeps=False)
    run = living._run

    empty_session.shut_down()

    assert not living.is_running
    assert not run.is_alive
