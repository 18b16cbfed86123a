"""A study that is moved or renamed, closed or open: nothing is lost, and nothing is made in its old place."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation
from annotations.documents.locks import holder_of
from annotations.documents.recovery import find_recoveries
from annotations.documents.study import Study, StudyVolume, annotation_path, save_study
from annotations.volumes import sidecar_path
from annotator.session import Session
from annotator.session.options import SessionOptions

HERE_UM = (100.0, 110.0, 120.0)


def open_and_wait(qtbot: QtBot, session: Session, path: Path) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(path)
    qtbot.waitUntil(lambda: not session.jobs.running)


@pytest.fixture
def study_folder(tmp_path: Path, volume_path: Path) -> Path:
    """A blind study of anna's with one volume, which moves with it."""
    folder = tmp_path / "study"
    folder.mkdir()
    shutil.copy(volume_path, folder / "v001.npy")
    shutil.copy(sidecar_path(volume_path), sidecar_path(folder / "v001.npy"))
    volume = StudyVolume(id="v001", path="v001.npy")
    study = Study(title="Moved", tool="magnetic-forceps", annotators=("anna",), blind=True, volumes=(volume,))
    save_study(study, folder)
    return folder


@pytest.fixture
def moved(study_folder: Path) -> Path:
    """Where the study is moved to."""
    return study_folder.with_name("renamed")


@pytest.fixture
def open_session(qtbot: QtBot, empty_session: Session, study_folder: Path) -> Session:
    """A session with the study's volume open."""
    open_and_wait(qtbot, empty_session, study_folder)
    return empty_session


def test_a_study_that_was_moved_while_closed_goes_on_as_it_was(
    qtbot: QtBot, open_session: Session, study_folder: Path, moved: Path
) -> None:
    open_session.place(HERE_UM)
    assert open_session.close_volume()
    study_folder.rename(moved)
    open_and_wait(qtbot, open_session, moved)
    assert open_session.document is not None
    assert list(open_session.document.positions_um.values()) == [HERE_UM]
    assert open_session.read_only_reason == ""
    open_session.place((50.0, 60.0, 70.0))
    assert open_session.save()


def test_saving_makes_no_folder_where_the_study_was(
    qtbot: QtBot, open_session: Session, study_folder: Path, moved: Path
) -> None:
    open_session.place(HERE_UM)
    study_folder.rename(moved)
    with qtbot.waitSignal(open_session.error_raised) as raised:
        assert not open_session.save()
    assert "not there any more" in str(raised.args[0])
    assert not study_folder.exists()
    moved.rename(study_folder)
    assert open_session.save()


def test_neither_renewing_nor_giving_up_the_lock_makes_a_folder_where_the_study_was(
    qtbot: QtBot, open_session: Session, study_folder: Path, moved: Path
) -> None:
    study_folder.rename(moved)
    open_session._locks.renew()
    qtbot.waitUntil(lambda: not open_session._locks._is_renewing)
    assert open_session.close_volume()
    assert not study_folder.exists()


def test_a_study_that_was_moved_while_open_is_opened_in_its_new_place(
    qtbot: QtBot, open_session: Session, study_folder: Path, moved: Path
) -> None:
    study_folder.rename(moved)
    assert holder_of(annotation_path(moved, "anna", "v001", "keypoints")) is not None
    open_and_wait(qtbot, open_session, moved)
    assert open_session.read_only_reason == ""
    open_session.place(HERE_UM)
    assert open_session.save()


def test_edits_left_unsaved_in_the_old_place_are_recovered_in_the_new_one(
    qtbot: QtBot, open_session: Session, options: SessionOptions, study_folder: Path, moved: Path
) -> None:
    open_session.place(HERE_UM)
    open_session.abandon()
    study_folder.rename(moved)
    (recovery,) = find_recoveries(options.recovery_folder)
    assert list(open_session.recovery_names([recovery]).values()) == [
        "An annotation in study, which is not there any more"
    ]
    with qtbot.waitSignal(open_session.error_raised) as raised:
        other = Session(replace(options, annotator_name="anna"))
        other.error_raised.connect(open_session.error_raised)
        other.recover(recovery)
    assert "not there any more" in str(raised.args[0])
    assert "v001" not in str(raised.args[0])
    other.shut_down()
    open_and_wait(qtbot, open_session, moved)
    assert list(open_session.recovery_names([recovery]).values()) == ["Volume 1 of Moved"]
    with qtbot.waitSignal(open_session.volume_changed):
        open_session.recover(recovery)
    qtbot.waitUntil(lambda: not open_session.jobs.running)
    assert open_session.annotation_path == annotation_path(moved, "anna", "v001", "keypoints")
    assert open_session.save()
    saved, _ = load_annotation(annotation_path(moved, "anna", "v001", "keypoints"))
    assert list(saved.positions_um.values()) == [HERE_UM]
    assert find_recoveries(options.recovery_folder) == ()
    assert not study_folder.exists()
