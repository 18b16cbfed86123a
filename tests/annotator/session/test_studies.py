"""Studies are made, changed and checked in the background, and what is open stays open meanwhile."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.seen_volumes import FoundVolume
from annotations.documents.study import STUDY_FILE, load_study, save_study
from annotations.documents.study_building import with_annotators, with_rules, with_volumes
from annotations.errors import UserError
from annotator.session import Session
from annotator.session.studies import StudyProposal, StudyReport
from tests.annotator.conftest import open_and_wait, write_volume


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three volumes, one of them in a folder of its own."""
    folder = tmp_path / "series"
    (folder / "day2").mkdir(parents=True)
    for seed, name in enumerate(("a.npy", "b.npy", "day2/c.npy")):
        write_volume(folder / name, seed)
    return folder


def propose(qtbot: QtBot, session: Session, folder: Path) -> StudyProposal:
    with qtbot.waitSignal(session.studies.proposed) as proposed:
        session.studies.propose(folder)
    return proposed.args[0]


@pytest.fixture
def opened(qtbot: QtBot, empty_session: Session, folder: Path) -> Session:
    """A session with a study of the three volumes open, made by it."""
    proposal = propose(qtbot, empty_session, folder)
    paths = [each.path for each in proposal.found]
    study = with_rules(
        proposal.study_in(folder, paths), title="Series", annotators=("anna", "ben"), order="listed"
    )
    with qtbot.waitSignal(empty_session.studies.created):
        empty_session.studies.create(study, folder, proposal.tools[study.tool])
    open_and_wait(qtbot, empty_session, folder)
    return empty_session


def test_a_folder_is_looked_through_for_what_a_study_can_be_made_of(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    proposal = propose(qtbot, empty_session, folder)
    paths = [each.path for each in proposal.found]
    assert [path.name for path in paths] == ["a.npy", "b.npy", "c.npy"]
    assert "needle" in proposal.tools
    assert [volume.path for volume in proposal.study_in(folder, paths[1:]).volumes] == ["b.npy", "day2/c.npy"]
    assert proposal.study_in(folder.parent, paths).volumes[0].path == "series/a.npy"
    assert proposal.belongs_to == ""


def test_what_cannot_be_read_and_what_is_there_twice_is_told(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    (folder / "broken.npy").write_bytes(bytes(range(100)))
    (folder / "twin.npy").write_bytes((folder / "a.npy").read_bytes())
    by_name = {each.path.name: each for each in propose(qtbot, empty_session, folder).found}
    assert "no format" in by_name["broken.npy"].problem
    assert by_name["twin.npy"].same_as == folder / "a.npy"
    assert by_name["b.npy"] == FoundVolume(folder / "b.npy")


def test_volumes_of_another_study_are_told_by_its_title(
    qtbot: QtBot, opened: Session, folder: Path, tmp_path: Path
) -> None:
    assert propose(qtbot, opened, folder / "day2").belongs_to == "the study “Series”"
    # The open study may be kept elsewhere than its volumes.
    study = with_rules(load_study(folder), title="Far", volumes=())
    (folder / STUDY_FILE).unlink()
    far = tmp_path / "far"
    save_study(with_volumes(study, far, [folder / "a.npy"]).study, far)
    open_and_wait(qtbot, opened, far)
    assert propose(qtbot, opened, folder).belongs_to == "the study “Far”"


def test_no_study_is_made_of_volumes_by_those_who_are_blind_to_them(
    qtbot: QtBot, opened: Session, folder: Path
) -> None:
    save_study(with_rules(load_study(folder), blind=True), folder)
    with (
        qtbot.assertNotEmitted(opened.studies.proposed),
        qtbot.waitSignal(opened.error_raised) as raised,
    ):
        opened.studies.propose(folder / "day2")
    said = str(raised.args[0])
    assert "belong to the study “Series”, in which you annotate without knowing them by name" in said
    assert "npy" not in said


def test_a_folder_with_a_study_or_without_volumes_is_an_error(
    qtbot: QtBot, opened: Session, folder: Path, tmp_path: Path
) -> None:
    (tmp_path / "empty").mkdir()
    for where, said in ((folder, "is a study already"), (tmp_path / "empty", "there is no volume")):
        with qtbot.waitSignal(opened.error_raised) as raised:
            opened.studies.propose(where)
        assert said in str(raised.args[0])


def test_a_new_study_is_written_and_can_be_opened(opened: Session, folder: Path) -> None:
    assert opened.studies.study == load_study(folder)
    assert opened.studies.folder == folder
    assert [item.label for item in opened.items] == ["a", "b", "c"]


def test_a_study_that_came_into_being_meanwhile_is_not_overwritten(
    qtbot: QtBot, opened: Session, folder: Path
) -> None:
    written = (folder / STUDY_FILE).read_bytes()
    study = with_rules(load_study(folder), title="Mine")
    with (
        qtbot.assertNotEmitted(opened.error_raised),
        qtbot.waitSignal(opened.studies.create_failed) as raised,
    ):
        opened.studies.create(study, folder, opened.tools()[study.tool])
    assert "not overwritten" in str(raised.args[0])
    assert (folder / STUDY_FILE).read_bytes() == written


def test_after_a_change_the_list_is_read_anew_and_the_open_document_stays(
    qtbot: QtBot, opened: Session, folder: Path
) -> None:
    opened.open_item(1)
    qtbot.waitUntil(lambda: opened.current_index == 1 and not opened.jobs.running)
    opened.place((300.0, 300.0, 250.0))
    document = opened.document
    before = opened.studies.study
    new = write_volume(folder / "day2" / "d.npy", 9)
    after = with_annotators(with_volumes(before, folder, [new]).study, ["cara"])
    with qtbot.waitSignals([opened.studies.changed, opened.worklist_changed]):
        opened.studies.change(before, after)
    qtbot.waitUntil(lambda: len(opened.items) == 4)
    assert opened.document is document
    assert opened.undo_stack.can_undo
    assert opened.items[opened.current_index].label == "b"
    assert opened.studies.study == load_study(folder) == after
    assert (folder / "study.toml.bak").exists()


def test_nobody_cancels_what_writes_a_study(qtbot: QtBot, opened: Session) -> None:
    before = opened.studies.study
    with qtbot.waitSignal(opened.studies.changed):
        opened.studies.change(before, with_annotators(before, ["cara"]))
        assert [job.title for job in opened.jobs.running] == ["Changing the study"]
        assert opened.jobs.shown == ()


def test_what_somebody_else_changed_meanwhile_is_not_overwritten(
    qtbot: QtBot, opened: Session, folder: Path
) -> None:
    before = opened.studies.study
    theirs = with_annotators(before, ["dora"])
    save_study(theirs, folder)
    with (
        qtbot.assertNotEmitted(opened.error_raised),
        qtbot.waitSignal(opened.studies.change_failed) as raised,
    ):
        opened.studies.change(before, with_annotators(before, ["cara"]))
    assert "somebody has changed the study" in str(raised.args[0])
    assert raised.args[0].present == theirs
    assert load_study(folder) == theirs


def test_an_open_volume_that_left_the_study_stays_open(qtbot: QtBot, opened: Session) -> None:
    before, document = opened.studies.study, opened.document
    after = with_rules(before, volumes=before.volumes[1:])
    with qtbot.waitSignal(opened.message_posted) as said:
        opened.studies.change(before, after)
    qtbot.waitUntil(lambda: not opened.jobs.running)
    assert opened.document is document
    assert said.args


def test_volumes_to_add_are_looked_for_in_folders_and_among_files(
    qtbot: QtBot, opened: Session, folder: Path
) -> None:
    with qtbot.waitSignal(opened.studies.volumes_found) as found:
        opened.studies.find([folder / "day2", folder / "a.npy"])
    assert found.args == [(FoundVolume(folder / "day2" / "c.npy"), FoundVolume(folder / "a.npy"))]


def test_a_copy_of_a_volume_of_the_study_is_told(
    qtbot: QtBot, opened: Session, folder: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "copy.npy"
    copy.write_bytes((folder / "a.npy").read_bytes())
    with qtbot.waitSignal(opened.studies.volumes_found) as found:
        opened.studies.find([copy])
    assert found.args == [(FoundVolume(copy, same_as=folder / "a.npy"),)]


def test_a_search_that_fails_says_so_to_whoever_waits_for_it(
    qtbot: QtBot, opened: Session, tmp_path: Path
) -> None:
    with (
        qtbot.assertNotEmitted(opened.error_raised),
        qtbot.waitSignal(opened.studies.search_failed) as failed,
    ):
        opened.studies.find([tmp_path / "gone"])
    assert isinstance(failed.args[0], UserError)


def test_a_study_is_checked_with_what_its_tool_can_look_like(
    qtbot: QtBot, opened: Session, folder: Path
) -> None:
    np.save(folder / "b.npy", np.zeros((2, 2, 2), np.uint8))
    (folder / "day2" / "c.npy").unlink()
    with qtbot.waitSignal(opened.studies.checked) as checked:
        opened.studies.check()
    report: StudyReport = checked.args[0]
    assert (report.folder, report.study) == (folder, opened.studies.study)
    kinds = {finding.kind for _, finding in report.findings}
    assert {"missing", "volume"} <= kinds


def test_outside_a_study_there_is_nothing_to_change_or_check(session: Session) -> None:
    studies: Any = session.studies
    assert (studies.study, studies.folder, studies.is_kept_from_names) == (None, None, False)
    studies.check()
    assert not session.jobs.running
