"""Keypoints and boxes have files of their own: changing the method saves the one and opens the other."""

import errno
import json
import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QTimer
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation
from annotations.documents.recovery import find_recoveries
from annotations.documents.study import Study, StudyVolume, save_study
from annotations.geometry.boxes import Box
from annotations.volumes import sidecar_path
from annotator.session import Session
from annotator.session.jobs import Job
from annotator.session.options import SessionOptions

BOX = Box((100.0, 200.0, 300.0), (11_000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))


def open_and_wait(qtbot: QtBot, session: Session, path: Path) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(path)
    qtbot.waitUntil(lambda: not session.jobs.running)


def switch(qtbot: QtBot, session: Session, method: str) -> None:
    with qtbot.waitSignal(session.volume_changed):
        session.set_method(method)  # type: ignore[arg-type]
    assert session.method == method
    assert session.document is not None
    assert session.document.method == method


def test_what_was_placed_is_saved_and_found_again(qtbot: QtBot, session: Session, volume_path: Path) -> None:
    session.place((1.0, 2.0, 3.0))
    path = session.annotation_path
    assert path is not None
    assert session.unsaved
    switch(qtbot, session, "boxes")
    assert load_annotation(path)[0].positions_um == {"k0": (1.0, 2.0, 3.0)}
    assert session.annotation_path == path.with_name("v001.npy.boxes.json")
    assert session.view.active_part == "link0"
    assert session.undo_stack.count == 0
    session.type_box("link0", BOX)
    switch(qtbot, session, "keypoints")
    assert session.document.positions_um == {"k0": (1.0, 2.0, 3.0)}  # type: ignore[union-attr]
    switch(qtbot, session, "boxes")
    assert session.document.placed_boxes == {"link0": BOX}  # type: ignore[union-attr]
    assert session.volume is not None
    assert session.volume.path == volume_path


def test_the_method_holds_for_every_volume_of_a_folder(
    qtbot: QtBot, empty_session: Session, volume_path: Path
) -> None:
    second = volume_path.with_name("v002.npy")
    shutil.copy(volume_path, second)
    shutil.copy(sidecar_path(volume_path), sidecar_path(second))
    open_and_wait(qtbot, empty_session, volume_path.parent)
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.next_volume()
    switch(qtbot, empty_session, "boxes")
    assert empty_session.current_index == 1, "the same volume"
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.previous_volume()
    assert empty_session.document is not None
    assert empty_session.document.method == "boxes"


def test_a_study_of_both_methods_offers_both(qtbot: QtBot, empty_session: Session, volume_path: Path) -> None:
    volume = StudyVolume(id="first", path="v001.npy")
    study = Study(title="Pilot", tool="magnetic-forceps", methods=("boxes", "keypoints"), volumes=(volume,))
    save_study(study, volume_path.parent)
    open_and_wait(qtbot, empty_session, volume_path.parent)
    assert empty_session.method == "keypoints", "the last choice is one of the study's methods"
    switch(qtbot, empty_session, "boxes")
    assert empty_session.annotation_path is not None
    assert empty_session.annotation_path.name == "first.boxes.json"


def test_a_single_annotation_changes_its_method_and_comes_back(
    qtbot: QtBot, session: Session, tmp_path: Path
) -> None:
    session.place((1.0, 2.0, 3.0))
    mine = tmp_path / "mine.json"
    assert session.save_as(mine)
    open_and_wait(qtbot, session, mine)
    switch(qtbot, session, "boxes")
    assert session.annotation_path == tmp_path / "mine.boxes.json"
    switch(qtbot, session, "keypoints")
    assert session.annotation_path == mine


def test_the_method_is_kept_for_what_is_opened_next(
    qtbot: QtBot, empty_session: Session, volume_path: Path
) -> None:
    empty_session.set_method("boxes")
    assert empty_session.method == "boxes"
    open_and_wait(qtbot, empty_session, volume_path)
    assert empty_session.document is not None
    assert empty_session.document.method == "boxes"
    document = empty_session.document
    empty_session.set_method("boxes")
    assert empty_session.document is document


def test_going_on_in_the_middle_of_a_change_keeps_both_wishes(
    qtbot: QtBot, empty_session: Session, volume_path: Path
) -> None:
    for name in ("v002.npy", "v003.npy"):
        shutil.copy(volume_path, volume_path.with_name(name))
        shutil.copy(sidecar_path(volume_path), sidecar_path(volume_path.with_name(name)))
    session = empty_session
    open_and_wait(qtbot, session, volume_path.parent)
    session.set_method("boxes")
    session.next_volume()
    qtbot.waitUntil(lambda: session.current_index == 1 and session.method == "boxes")
    # The other way round: the file of the method is being opened by then.
    presses: list[str] = []

    def press_next(job: Job) -> None:
        if job.title.startswith("Opening") and not presses:
            presses.append(job.title)
            QTimer.singleShot(0, session.next_volume)

    session.jobs.job_changed.connect(press_next)
    session.set_method("keypoints")
    qtbot.waitUntil(lambda: session.current_index == 2 and session.method == "keypoints")
    session.set_method("boxes")
    session.close_volume()
    qtbot.waitUntil(lambda: session.method == "boxes" and not session.jobs.running)
    assert session.volume is None, "what was closed stays closed"


def test_what_cannot_be_saved_stays_open(
    qtbot: QtBot, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    session.place((1.0, 2.0, 3.0))
    document = session.document

    def fail(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("annotations.durable_files.os.fsync", fail)
    with qtbot.waitSignal(session.error_raised) as raised:
        session.set_method("boxes")
    assert "could not be written" in str(raised.args[0])
    qtbot.waitUntil(lambda: not session.jobs.running)
    assert session.document is document
    assert session.method == "keypoints"
    assert session.unsaved


def test_a_file_of_boxes_is_opened_as_it_is(qtbot: QtBot, boxes_session: Session) -> None:
    boxes_session.type_box("link1", BOX)
    boxes_session.set_certainty("link1", "unsure")
    assert boxes_session.save()
    path, saved = boxes_session.annotation_path, boxes_session.document
    assert path is not None
    assert saved is not None
    open_and_wait(qtbot, boxes_session, path)
    assert boxes_session.document is not None
    assert boxes_session.document.boxes == saved.boxes
    assert boxes_session.method == "boxes"
    assert [item.annotation_path for item in boxes_session.items] == [path]
    assert boxes_session.view.active_part == "link0", "the first that is not placed"


@pytest.mark.parametrize(
    ("field", "value", "opens"),
    [("spacing_um", [10.0, 10.0, 10.0], True), ("shape", [1, 2, 3], False), ("fingerprint", "0" * 64, True)],
)
def test_boxes_of_another_volume_are_refused_or_warned_of(
    qtbot: QtBot, boxes_session: Session, field: str, value: Any, opens: bool
) -> None:
    session = boxes_session
    session.type_box("link0", BOX)
    assert session.save()
    path = session.annotation_path
    assert path is not None
    session.close_volume()
    fields = json.loads(path.read_text())
    fields["volume"][field] = value
    path.write_text(json.dumps(fields))
    with qtbot.waitSignal(session.error_raised) as raised:
        session.open_path(path)
    assert str(path) in str(raised.args[0])
    assert (session.document is not None) == opens
    if session.document is not None:
        assert session.document.placed_boxes == {"link0": BOX}, "positions stay as they were made"


def test_edits_of_boxes_are_in_the_journal_and_recovered(
    qtbot: QtBot, boxes_session: Session, options: SessionOptions
) -> None:
    session = boxes_session
    session.type_box("link0", BOX)
    session.set_mode("place")
    session.activate("link0")
    session.drag_handle("center", (1.0, 2.0, 3.0))
    session.keep_draft()
    lost = session.document
    assert lost is not None
    session.abandon()
    (recovery,) = find_recoveries(options.recovery_folder)
    assert recovery.document.boxes == lost.boxes
    # A window that annotates by keypoints finds its way to the boxes.
    other = Session(options)
    with qtbot.waitSignal(other.volume_changed):
        other.recover(recovery)
    qtbot.waitUntil(lambda: other.unsaved)
    assert other.document is not None
    assert other.method == "boxes"
    assert other.document.boxes == lost.boxes
    other.undo_stack.undo()
    assert other.document.placed_boxes == {}
    assert {part.name for part in other.document.parts} == {"link0", "link1", "link2"}
    other.shut_down()


def test_boxes_are_saved_by_themselves(qtbot: QtBot, options: SessionOptions, volume_path: Path) -> None:
    session = Session(replace(options, method="boxes", autosave_s=0.05))
    open_and_wait(qtbot, session, volume_path)
    session.type_box("link2", replace(BOX, size_um=(6000.0, 4000.0, 2000.0)))
    qtbot.waitUntil(lambda: not session.unsaved)
    assert session.annotation_path is not None
    assert set(load_annotation(session.annotation_path)[0].placed_boxes) == {"link2"}
    session.shut_down()


def test_a_finished_document_of_boxes_says_what_is_missing(qtbot: QtBot, boxes_session: Session) -> None:
    boxes_session.type_box("link0", BOX)
    with qtbot.waitSignal(boxes_session.message_posted) as said:
        boxes_session.set_status("done")
    assert "link1, link2 have no position" in said.args[0]
