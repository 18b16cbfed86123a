"""Who sees whom while a volume is open, and what is written down of it where undo does not reach."""

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import Annotation
from annotations.documents.files import load_annotation
from annotations.documents.record import changed
from annotations.documents.recovery import find_recoveries
from annotations.documents.study import ViewingRules, load_study, save_study
from annotations.durable_files import SaveError
from annotations.geometry.boxes import Box
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.blind_study import annotate, write_study
from tests.annotator.conftest import open_and_wait

POSITION_UM = (100.0, 110.0, 120.0)


def place_of(session: Session, volume_id: str, repeat: int = 0) -> int:
    return next(
        index
        for index, item in enumerate(session.items)
        if (item.volume_id, item.repeat) == (volume_id, repeat)
    )


def go_to(qtbot: QtBot, session: Session, volume_id: str, repeat: int = 0) -> None:
    index = place_of(session, volume_id, repeat)
    if session.current_index != index:
        session.open_item(index)
        qtbot.waitUntil(lambda: session.current_index == index and not session.jobs.running)


def finish(session: Session) -> None:
    """Place something, if nothing is, and mark the document as done."""
    document = session.document
    assert document is not None
    if all(part.anchor_um is None for part in document.parts):
        if document.method == "keypoints":
            session.place(POSITION_UM)
        else:
            session.type_box("link0", Box(POSITION_UM, (900.0, 400.0, 400.0), (1.0, 0.0, 0.0, 0.0)))
    session.set_status("done")


def on_disk(session: Session) -> Annotation:
    assert session.annotation_path is not None
    return load_annotation(session.annotation_path)[0]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study in which ben has annotated the volume “first”, which is met once."""
    folder = write_study(tmp_path / "study", blind=False, repeats=False)
    annotate(folder, "ben", "first")
    return folder


@pytest.fixture
def annas(qtbot: QtBot, empty_session: Session, folder: Path) -> Session:
    """Anna's session with that volume open."""
    open_and_wait(qtbot, empty_session, folder)
    go_to(qtbot, empty_session, "first")
    return empty_session


def allow_looking(folder: Path) -> None:
    save_study(changed(load_study(folder), viewing=ViewingRules(may_look=True)), folder)


def test_outside_a_study_nothing_is_kept_from_anybody(session: Session) -> None:
    assert session.seeing.may_see_others()
    assert session.seeing.note_shown("annotations")
    assert session.viewings == ()


def test_others_are_seen_from_when_the_own_work_is_saved_as_done(qtbot: QtBot, annas: Session) -> None:
    assert not annas.seeing.may_see_others()
    assert "not done yet" in annas.seeing.permission.reason
    with qtbot.waitSignal(annas.seeing.permission_changed):
        finish(annas)
    assert annas.seeing.may_see_others()
    with qtbot.waitSignal(annas.seeing.permission_changed):
        annas.set_status("in_progress")
    assert not annas.seeing.may_see_others()


def test_an_undo_of_done_hides_the_others_at_once(annas: Session) -> None:
    finish(annas)
    assert annas.seeing.may_see_others()
    annas.undo()
    assert annas.unsaved
    assert not annas.seeing.may_see_others()


def test_another_pass_that_is_not_done_hides_them_too(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "repeated", blind=False)
    annotate(folder, "ben", "kidney_07")
    annotate(folder, "anna", "first")
    for repeat in (0, 1):
        annotate(folder, "anna", "porcine-liver", repeat=repeat)
    open_and_wait(qtbot, empty_session, folder)
    go_to(qtbot, empty_session, "kidney_07")
    finish(empty_session)
    assert not empty_session.seeing.may_see_others()
    go_to(qtbot, empty_session, "kidney_07", repeat=1)
    finish(empty_session)
    assert empty_session.seeing.may_see_others()


def test_what_is_shown_is_written_at_once_and_once(annas: Session) -> None:
    finish(annas)
    assert annas.seeing.note_shown("annotations")
    assert annas.seeing.note_shown("annotations")
    (viewing,) = on_disk(annas).viewings
    assert (viewing.shown, viewing.status) == ("annotations", "done")
    assert annas.seeing.note_shown("predictions")
    assert [each.shown for each in on_disk(annas).viewings] == ["annotations", "predictions"]
    assert on_disk(annas).is_blind
    annas.undo()
    annas.save()
    assert len(on_disk(annas).viewings) == 2


def test_on_a_full_disk_nothing_is_shown_however_often_it_is_asked_for(
    qtbot: QtBot, annas: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    finish(annas)

    def fail(*_: object, **__: object) -> None:
        raise SaveError("the disk is full")

    with monkeypatch.context() as full:
        full.setattr("annotator.session.documents.document_file.save_annotation", fail)
        for _ in range(2):
            with qtbot.waitSignal(annas.error_raised):
                assert not annas.seeing.note_shown("annotations")
    assert annas.viewings == ()
    assert not annas.unsaved
    assert annas.seeing.note_shown("annotations")
    assert [viewing.status for viewing in on_disk(annas).viewings] == ["done"]


def test_what_may_not_be_seen_is_not_noted_as_shown(annas: Session) -> None:
    assert not annas.seeing.note_shown("annotations")
    assert not annas.seeing.look_anyway()
    assert annas.viewings == ()


def test_looking_anyway_is_written_before_anything_is_shown_even_into_an_empty_document(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    allow_looking(folder)
    open_and_wait(qtbot, empty_session, folder)
    go_to(qtbot, empty_session, "first")
    assert not empty_session.seeing.may_see_others()
    assert empty_session.seeing.permission.may_look
    assert empty_session.seeing.look_anyway()
    assert empty_session.seeing.may_see_others()
    assert [viewing.status for viewing in on_disk(empty_session).viewings] == ["in_progress"]
    assert not on_disk(empty_session).is_blind
    go_to(qtbot, empty_session, "kidney_07")
    go_to(qtbot, empty_session, "first")
    assert not empty_session.seeing.may_see_others()
    assert len(empty_session.viewings) == 1


def test_whoever_looks_anyway_is_told_of_a_change_alone(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    allow_looking(folder)
    open_and_wait(qtbot, empty_session, folder)
    go_to(qtbot, empty_session, "first")
    assert empty_session.seeing.look_anyway()
    told: list[str] = []
    empty_session.seeing.permission_changed.connect(lambda: told.append(empty_session.seeing.work_refusal))
    for _ in range(2):
        empty_session.place(POSITION_UM)
        assert empty_session.save()
        empty_session.undo()
        assert empty_session.save()
    assert told == []
    # What is seen does not change, but the work may be shaped by it from now on.
    finish(empty_session)
    assert told == [""]


def test_what_was_seen_in_one_pass_is_known_in_the_next(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "repeated", blind=False)
    allow_looking(folder)
    open_and_wait(qtbot, empty_session, folder)
    go_to(qtbot, empty_session, "kidney_07")
    assert empty_session.seeing.look_anyway()
    go_to(qtbot, empty_session, "kidney_07", repeat=1)
    assert not empty_session.unsaved
    empty_session.place(POSITION_UM)
    empty_session.save()
    assert [viewing.status for viewing in on_disk(empty_session).viewings] == ["in_progress"]


@pytest.mark.parametrize("change", ["status", "edit", "undo"])
def test_any_change_of_finished_work_is_marked_and_stays_so(
    qtbot: QtBot, annas: Session, change: str
) -> None:
    annas.place(POSITION_UM)
    finish(annas)
    assert on_disk(annas).reopened is None
    changes = {
        "status": lambda: annas.set_status("in_progress"),
        "edit": lambda: annas.place((1.0, 2.0, 3.0)),
        "undo": annas.undo,
    }
    with qtbot.waitSignal(annas.message_posted, check_params_cb=lambda text: "reopened" in text):
        changes[change]()
    # Before anything is saved, and whatever is done about it.
    assert on_disk(annas).reopened is not None
    while annas.undo_stack.can_undo:
        annas.undo()
    annas.close_volume()
    assert load_annotation(annas.items[place_of(annas, "first")].annotation_path)[0].reopened is not None


def test_a_redo_is_a_change_as_well(qtbot: QtBot, empty_session: Session, folder: Path) -> None:
    open_and_wait(qtbot, empty_session, folder)
    go_to(qtbot, empty_session, "kidney_07")
    finish(empty_session)
    empty_session.place((1.0, 2.0, 3.0))
    empty_session.undo()
    assert on_disk(empty_session).reopened is None
    annotate(folder, "ben", "kidney_07")
    empty_session.redo()
    assert on_disk(empty_session).reopened is not None


def test_a_change_before_anybody_else_has_annotated_is_no_reopening(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    open_and_wait(qtbot, empty_session, folder)
    go_to(qtbot, empty_session, "kidney_07")
    finish(empty_session)
    empty_session.place(POSITION_UM)
    empty_session.save()
    assert on_disk(empty_session).reopened is None


def test_a_flag_is_no_change_of_what_was_found(annas: Session) -> None:
    finish(annas)
    annas.set_flag("look at the tip")
    annas.save()
    assert on_disk(annas).flag == "look at the tip"
    assert on_disk(annas).reopened is None


def test_boxes_are_reopened_too_by_somebody_who_could_see_the_others(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "both", blind=False, methods=("keypoints", "boxes"), repeats=False)
    for method in ("keypoints", "boxes"):
        annotate(folder, "ben", "first", method=method)
        annotate(folder, "anna", "first", method=method)
    open_and_wait(qtbot, empty_session, folder)
    go_to(qtbot, empty_session, "first")
    empty_session.set_status("in_progress")
    empty_session.set_method("boxes")
    qtbot.waitUntil(lambda: empty_session.method == "boxes" and not empty_session.jobs.running)
    # While the keypoints are in progress nothing can be seen, but it was to be seen before.
    assert not empty_session.seeing.may_see_others()
    empty_session.set_status("in_progress")
    assert on_disk(empty_session).reopened is not None


def test_a_file_that_cannot_be_written_gets_the_mark_with_the_next_save(
    annas: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    finish(annas)
    path = annas.annotation_path
    assert path is not None
    path.write_text(path.read_text() + "\n")
    annas.place(POSITION_UM)
    annas.undo()
    assert annas.undo_stack.is_clean
    assert annas.unsaved
    assert annas.save(overwrite=True)
    assert on_disk(annas).reopened is not None
    assert not annas.unsaved


SCRIPT = """
import os, sys
from pathlib import Path
from PySide6.QtCore import QCoreApplication, QTimer
from annotator.session import Session
from annotator.session.options import SessionOptions
root = Path(sys.argv[1])
app = QCoreApplication([])
session = Session(SessionOptions(
    annotator_name="anna", autosave_s=0.0, recovery_folder=root / "recovery",
    level_cache_folder=root / "levels", user_tool_folder=root / "tools",
))
def work():
    if session.volume is None:
        return
    index = next(i for i, item in enumerate(session.items) if item.volume_id == "first")
    if session.current_index != index:
        session.open_item(index)
        return
    session.place((1.0, 2.0, 3.0))
    session.set_status("done")
    session.place((100.0, 110.0, 120.0))
    session.undo()
    os.kill(os.getpid(), 9)
session.volume_changed.connect(lambda: QTimer.singleShot(0, work))
session.error_raised.connect(lambda error: sys.exit(str(error)))
session.open_path(root / "study")
app.exec()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kill -9 is POSIX")
@pytest.mark.parametrize("discards", [False, True])
def test_the_mark_survives_kill_9_whatever_becomes_of_the_recovery(
    qtbot: QtBot, empty_session: Session, options: SessionOptions, folder: Path, discards: bool
) -> None:
    ended = subprocess.run([sys.executable, "-c", SCRIPT, str(folder.parent)], check=False, timeout=120)
    assert ended.returncode == -9
    own = folder / "annotations" / "anna" / "first.keypoints.json"
    assert load_annotation(own)[0].reopened is not None
    for recovery in find_recoveries(options.recovery_folder):
        if discards:
            empty_session.discard_recovery(recovery)
        else:
            empty_session.recover(recovery)
            qtbot.waitUntil(lambda: empty_session.volume is not None and not empty_session.jobs.running)
            empty_session.save()
    assert load_annotation(own)[0].reopened is not None


def test_a_recovery_that_tells_of_more_than_the_file_is_offered_though_nothing_else_differs(
    annas: Session, options: SessionOptions, tmp_path: Path
) -> None:
    finish(annas)
    path = annas.annotation_path
    assert path is not None
    before = path.read_bytes()
    annas.place(POSITION_UM)
    annas.undo()
    # As if the mark had not reached the file before the program died.
    path.write_bytes(before)
    (journal,) = options.recovery_folder.glob("*.journal")
    (tmp_path / "dead").mkdir()
    shutil.copy(journal, tmp_path / "dead")
    (recovery,) = find_recoveries(tmp_path / "dead")
    assert recovery.document.reopened is not None


def test_a_reviewers_work_is_never_marked(qtbot: QtBot, options: SessionOptions, folder: Path) -> None:
    session = Session(replace(options, annotator_name="zoe"))
    told: list[str] = []
    session.message_posted.connect(told.append)
    open_and_wait(qtbot, session, folder)
    assert any("zoe is not among" in text for text in told)
    assert session.seeing.may_see_others()
    finish(session)
    session.place(POSITION_UM)
    session.save()
    assert on_disk(session).reopened is None
    session.shut_down()


def test_in_a_study_where_nobody_sees_the_others_nothing_is_a_reopening(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_study(tmp_path / "never", blind=False, viewing=ViewingRules(others="never"))
    annotate(folder, "ben", "first")
    open_and_wait(qtbot, empty_session, folder)
    go_to(qtbot, empty_session, "first")
    finish(empty_session)
    assert not empty_session.seeing.may_see_others()
    empty_session.place(POSITION_UM)
    empty_session.save()
    assert on_disk(empty_session).reopened is None
