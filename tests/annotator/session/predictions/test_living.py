"""The session's live view: what it is kept from, and what it asks only once."""

import os
import sys

import numpy as np
import pytest

from annotations.documents import permission
from annotations.documents.files import load_annotation
from annotations.documents.queue import queue
from annotations.documents.study import ViewingRules, load_study
from annotator.session.predictions import kept_volumes
from annotator.session.predictions.living import Playback
from tests.annotations.prediction.tiny_networks import save_tiny
from tests.annotator.blind_study import IDS, annotate, write_study
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

    assert len(told) == 3
    # Nor are they once the own work is done: they would have names.
    assert all("who know them by their numbers" in error.problem for error in told)
    assert not empty_session.living.is_running
    assert empty_session.living.refusal(tmp_path / "elsewhere") == ""


def test_a_blind_study_that_is_opened_meanwhile_ends_it(qtbot, empty_session, told, tmp_path):
    study = write_study(tmp_path / "study")
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    empty_session.set_annotator_name("rita")
    empty_session.living.start(study, None, keeps=False)
    assert empty_session.living.is_running

    empty_session.set_annotator_name("anna")
    open_and_wait(qtbot, empty_session, study)

    assert not empty_session.living.is_running
    assert len(told) == 1


def links_to(volumes, folder, link):
    """Make a folder in which each of the volumes is met by another name."""
    folder.mkdir()
    for number, path in enumerate(sorted(volumes.rglob("*.npy"))):
        link(path, folder / f"{number}.npy")
    return folder


# Others ask for no right.
LINKS = [os.link] if sys.platform == "win32" else [os.symlink, os.link]


@pytest.mark.parametrize("is_open", [True, False])
@pytest.mark.parametrize("link", LINKS)
def test_links_to_volumes_of_a_blind_study_are_kept_from_view(qtbot, empty_session, tmp_path, is_open, link):
    study = write_study(tmp_path / "study")
    links = links_to(study / "volumes", tmp_path / "links", link)
    if is_open:
        open_and_wait(qtbot, empty_session, study)
    else:
        empty_session.set_annotator_name("anna")
    # A file with a second name of equal rights lies in no study, as far as anybody can tell.
    is_told = is_open or link is os.symlink
    assert bool(empty_session.living.refusal(links)) == is_told


def test_a_blind_study_keeps_its_volumes_from_view_though_another_one_is_open(
    qtbot, empty_session, told, tmp_path
):
    study, other = write_study(tmp_path / "study"), write_study(tmp_path / "other", blind=False)
    empty_session.set_annotator_name("anna")
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    assert empty_session.living.refusal(study / "volumes" / "left side")
    open_and_wait(qtbot, empty_session, other)
    empty_session.living.start(study / "volumes" / "left side", Playback(), keeps=False)
    assert not empty_session.living.is_running
    assert "kept from you" in told[-1].problem


def test_volumes_of_a_study_are_for_those_who_may_see_predictions_of_them(empty_session, tmp_path):
    study = write_study(tmp_path / "study", blind=False, repeats=False)
    volumes = study / "volumes" / "left side"
    empty_session.set_annotator_name("anna")
    assert empty_session.living.refusal(volumes)
    for name in IDS:
        annotate(study, "anna", name)
    assert empty_session.living.refusal(volumes) == ""
    empty_session.set_annotator_name("rita")
    assert empty_session.living.refusal(volumes) == ""


@pytest.mark.parametrize("is_open", [True, False])
@pytest.mark.parametrize(("others", "words"), [("when_done", "until your own work"), ("never", "all who")])
def test_it_is_said_whether_they_are_ever_shown(qtbot, empty_session, tmp_path, is_open, others, words):
    study = write_study(tmp_path / "study", blind=False, viewing=ViewingRules(others=others))
    empty_session.set_annotator_name("anna")
    if is_open:
        open_and_wait(qtbot, empty_session, study)
    refusal = empty_session.living.refusal(study / "volumes" / "left side")
    assert words in refusal
    assert ("until" in refusal) == (others == "when_done")


def test_where_volumes_come_again_every_file_is_read_once(empty_session, tmp_path, monkeypatch):
    study = write_study(tmp_path / "study", blind=False)
    paths = [
        annotate(study, "anna", each.volume.id, repeat=each.repeat)
        for each in queue(load_study(study), "anna", "keypoints")
    ]
    empty_session.set_annotator_name("anna")
    read = []
    monkeypatch.setattr(permission, "load_annotation", lambda at: read.append(at) or load_annotation(at))
    assert empty_session.living.refusal(study / "volumes" / "left side") == ""
    assert sorted(read) == sorted(paths)


def test_whoever_would_be_asked_who_they_are_says_so_first(empty_session, tmp_path):
    study = write_study(tmp_path / "study")
    volumes = study / "volumes" / "left side"
    empty_session.set_annotator_name("Anna")
    empty_session.identifying.is_asked = True
    assert "does not name Anna" in empty_session.living.refusal(volumes)
    empty_session.identifying.confirm(study, "Anna")
    assert empty_session.living.refusal(volumes) == ""


def test_a_study_that_cannot_be_read_keeps_its_volumes_from_view(empty_session, tmp_path):
    study = write_study(tmp_path / "study")
    (study / "study.toml").write_text("title = ")
    assert "cannot be read" in empty_session.living.refusal(study / "volumes" / "left side")


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege")
def test_a_volume_that_is_linked_to_meanwhile_ends_it_unnamed(qtbot, empty_session, told, tmp_path):
    study = write_study(tmp_path / "study")
    empty_session.set_annotator_name("anna")
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    incoming = tmp_path / "incoming"
    incoming.mkdir()
    living = empty_session.living
    living.start(incoming, None, keeps=False)
    qtbot.waitUntil(lambda: living.is_ready, timeout=30_000)
    with qtbot.waitSignal(living.kept_from_view, timeout=30_000):
        (incoming / "porcine-liver.npy").symlink_to(study / "volumes" / "left side" / "porcine-liver.npy")
    assert not living.is_running
    assert not any("porcine" in str(error) for error in told)


def test_what_a_run_that_has_ended_left_is_withdrawn_as_well(qtbot, empty_session, told, tmp_path):
    study = write_study(tmp_path / "study")
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    empty_session.set_annotator_name("rita")
    empty_session.living.start(study, None, keeps=False)
    empty_session.living.stop()
    empty_session.set_annotator_name("anna")
    with qtbot.waitSignal(empty_session.living.kept_from_view):
        open_and_wait(qtbot, empty_session, study)


def test_what_has_been_left_is_not_looked_at_again(qtbot, empty_session, tmp_path, monkeypatch):
    study, other = write_study(tmp_path / "study"), write_study(tmp_path / "other", blind=False)
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    empty_session.set_annotator_name("rita")
    living = empty_session.living
    living.start(study / "volumes" / "left side", None, keeps=False)
    listed = []
    monkeypatch.setattr(kept_volumes, "volume_paths", lambda folder: listed.append(folder) or [])
    living.stop()
    open_and_wait(qtbot, empty_session, other)
    assert listed
    listed.clear()
    living.leave()
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.open_item((empty_session.current_index + 1) % len(empty_session.items))
    assert listed == []


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
