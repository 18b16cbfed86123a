"""Opening through the session: spacing asked once, datasets chosen, and every wrong input a clear error."""

import json
import shutil
import threading
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import Annotation
from annotations.fitting.pose_fit import ToolFit, fit_document
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification
from annotations.volumes import Cancelled, Level, Volume, averaged_level, read_sidecar, sidecar_path
from annotator.session import Session
from annotator.session.editing import tool_body
from annotator.session.options import SessionOptions
from annotator.session.volumes import level_loader, opening
from annotator.session.volumes.spacing_answer import SpacingAnswer
from tests.annotator.conftest import write_volume


def open_and_wait(qtbot: QtBot, session: Session, path: Path) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(path)


def error_of(qtbot: QtBot, session: Session, path: Path) -> str:
    """Open what cannot be opened, and return what the person is told."""
    with qtbot.waitSignal(session.error_raised) as raised:
        session.open_path(path)
    return str(raised.args[0])


@pytest.fixture
def bare_volume(tmp_path: Path) -> Path:
    """A volume whose spacing nothing says."""
    path = tmp_path / "bare.npy"
    np.save(path, np.arange(60, dtype=np.uint16).reshape(3, 4, 5))
    return path


def test_an_unknown_spacing_is_asked_once_and_remembered(
    qtbot: QtBot, empty_session: Session, bare_volume: Path
) -> None:
    with qtbot.waitSignal(empty_session.spacing_requested) as asked:
        empty_session.open_path(bare_volume)
    volume, offered_um = asked.args
    assert volume.path == bare_volume
    assert offered_um == (15.9, 13.5, 9.4)
    assert empty_session.volume is None
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.provide_spacing(bare_volume, SpacingAnswer((10.0, 20.0, 30.0)))
    assert empty_session.spacing_um == (10.0, 20.0, 30.0)
    sidecar = read_sidecar(bare_volume)
    assert sidecar is not None
    assert sidecar.spacing_um == (10.0, 20.0, 30.0)
    with qtbot.assertNotEmitted(empty_session.spacing_requested):
        open_and_wait(qtbot, empty_session, bare_volume)


def test_an_answer_is_kept_elsewhere_where_the_folder_is_read_only(
    qtbot: QtBot, options: SessionOptions, bare_volume: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import annotations.durable_files as durable_files

    answers: dict[str, SpacingAnswer] = {}
    kept_by_fingerprint = SessionOptions(
        **{
            **vars(options),
            "remembered_spacing": answers.get,
            "remember_spacing": answers.__setitem__,
        }
    )
    session = Session(kept_by_fingerprint)
    replace = durable_files.os.replace

    def refuse_sidecars(source: Any, target: Any, **kwargs: Any) -> None:
        if Path(target) == sidecar_path(bare_volume):
            raise PermissionError(13, "Permission denied")
        replace(source, target, **kwargs)

    monkeypatch.setattr(durable_files.os, "replace", refuse_sidecars)
    with qtbot.waitSignal(session.spacing_requested):
        session.open_path(bare_volume)
    with qtbot.waitSignal(session.volume_changed):
        session.provide_spacing(bare_volume, SpacingAnswer((10.0, 20.0, 30.0), 1))
    assert list(answers.values()) == [SpacingAnswer((10.0, 20.0, 30.0), 1)]
    assert not sidecar_path(bare_volume).exists()
    with qtbot.assertNotEmitted(session.spacing_requested):
        open_and_wait(qtbot, session, bare_volume)
    assert session.spacing_um == (10.0, 20.0, 30.0)
    assert session.volume is not None
    assert session.volume.depth_axis == 1
    session.shut_down()


def test_one_answer_holds_for_the_whole_folder(
    qtbot: QtBot, empty_session: Session, bare_volume: Path
) -> None:
    shutil.copy(bare_volume, bare_volume.with_name("other.npy"))
    with qtbot.waitSignal(empty_session.spacing_requested):
        empty_session.open_path(bare_volume)
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.provide_spacing(bare_volume, SpacingAnswer((10.0, 20.0, 30.0), 0, "folder"))
    with qtbot.assertNotEmitted(empty_session.spacing_requested):
        open_and_wait(qtbot, empty_session, bare_volume.with_name("other.npy"))
    assert empty_session.spacing_um == (10.0, 20.0, 30.0)
    assert empty_session.volume is not None
    assert empty_session.volume.depth_axis == 0
    assert empty_session.spacing_note == "as answered for this folder"


def test_declining_to_answer_opens_nothing(qtbot: QtBot, empty_session: Session, bare_volume: Path) -> None:
    with qtbot.waitSignal(empty_session.spacing_requested):
        empty_session.open_path(bare_volume)
    empty_session.decline_opening(bare_volume)
    empty_session.provide_spacing(bare_volume, SpacingAnswer((1.0, 1.0, 1.0)))
    qtbot.waitUntil(lambda: not empty_session.jobs.running)
    assert empty_session.volume is None
    assert empty_session.current_index is None
    assert not sidecar_path(bare_volume).exists()


def test_one_of_several_datasets_is_chosen(qtbot: QtBot, empty_session: Session, tmp_path: Path) -> None:
    path = tmp_path / "several.h5"
    with h5py.File(path, "w") as file:
        for name in ("left", "right"):
            file[name] = np.full((3, 4, 5), len(name), np.uint8)
            file[name].attrs["spacing_um"] = (1.0, 2.0, 3.0)
    with qtbot.waitSignal(empty_session.dataset_requested) as asked:
        empty_session.open_path(path)
    assert [choice.name.strip("/") for choice in asked.args[1]] == ["left", "right"]
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.provide_dataset(path, asked.args[1][1].name)
    assert empty_session.volume is not None
    assert empty_session.volume.read((slice(0, 1),) * 3).item() == 5
    assert empty_session.document is not None
    assert empty_session.document.volume.dataset == asked.args[1][1].name


def edited(session: Session, change: Any) -> Path:
    """Save an annotation, change its JSON, and return its path, with nothing open any more."""
    session.place((100.0, 100.0, 100.0))
    session.save()
    path = session.annotation_path
    assert path is not None
    session.abandon()
    fields = json.loads(path.read_text())
    change(fields)
    path.write_text(json.dumps(fields))
    return path


def test_a_missing_volume_behind_an_annotation(qtbot: QtBot, session: Session, volume_path: Path) -> None:
    path = edited(session, lambda _fields: None)
    volume_path.unlink()
    before = path.read_bytes()
    said = error_of(qtbot, session, path)
    assert str(volume_path) in said
    assert path.read_bytes() == before
    assert session.volume is None


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda fields: fields["volume"].update(shape=[40, 60, 51]), "shape"),
        (lambda fields: fields["volume"].update(dtype="int16"), "int16"),
        (lambda fields: fields["keypoints"][0].update(name="k9"), "k9"),
        (lambda fields: fields["keypoints"][0].update(name="k1"), "more than once"),
        (lambda fields: fields.update(tool="tweezers"), "tweezers"),
        (lambda fields: fields["volume"].update(spacing_um=[15.9, 0.0, 9.4]), "spacing_um"),
        (lambda fields: fields["volume"].update(spacing_um=[15.9, -1.0, 9.4]), "spacing_um"),
        (lambda fields: fields.update(schema="oct-annotation/2"), "newer"),
        (lambda fields: fields.update(colour="red"), "colour"),
    ],
)
def test_an_annotation_that_does_not_fit_is_refused_and_untouched(
    qtbot: QtBot, session: Session, change: Any, says: str
) -> None:
    path = edited(session, change)
    before = path.read_bytes()
    said = error_of(qtbot, session, path)
    assert says in said
    assert str(path) in said
    assert path.read_bytes() == before
    assert session.document is None


def test_another_content_of_the_same_shape_opens_with_a_warning(
    qtbot: QtBot, session: Session, volume_path: Path
) -> None:
    path = edited(session, lambda _fields: None)
    np.save(volume_path, 255 - np.load(volume_path))
    said = error_of(qtbot, session, path)
    assert "fingerprint" in said
    assert session.document is not None
    assert session.document.positions_um == {"k0": (100.0, 100.0, 100.0)}


def test_the_annotation_keeps_its_spacing_when_the_volume_says_another(
    qtbot: QtBot, session: Session, volume_path: Path
) -> None:
    path = edited(session, lambda fields: fields["volume"].update(spacing_um=[10.0, 10.0, 10.0]))
    said = error_of(qtbot, session, path)
    assert "spacing" in said
    assert session.spacing_um == (10.0, 10.0, 10.0)
    assert session.spacing_note == "from the annotation"


def test_next_and_previous_save_what_was_done(qtbot: QtBot, session: Session, volume_path: Path) -> None:
    shutil.copy(volume_path, volume_path.parent / "v002.npy")
    shutil.copy(sidecar_path(volume_path), sidecar_path(volume_path.parent / "v002.npy"))
    open_and_wait(qtbot, session, volume_path)
    session.place((1.0, 2.0, 3.0))
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.next_volume()
    assert session.current_index == 1
    assert session.items[0].status == "in_progress"
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.previous_volume()
    assert session.document is not None
    assert session.document.positions_um == {"k0": (1.0, 2.0, 3.0)}
    with qtbot.waitSignal(session.message_posted) as said:
        session.previous_volume()
    assert "no previous" in said.args[0]


def test_another_tool_for_an_untouched_document(qtbot: QtBot, session: Session) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.choose_tool("needle")
    assert session.document is not None
    assert [keypoint.name for keypoint in session.document.keypoints] == ["tip", "shaft"]
    session.place((1.0, 2.0, 3.0))
    with qtbot.waitSignal(session.message_posted) as said:
        session.choose_tool("magnetic-forceps")
    assert "stays with needle" in said.args[0]
    assert session.document.tool == "needle"


def test_a_bad_file_leaves_what_is_open(qtbot: QtBot, session: Session, tmp_path: Path) -> None:
    session.place((1.0, 2.0, 3.0))
    before, items, index = session.document, session.items, session.current_index
    bad = tmp_path / "bad.npy"
    bad.write_bytes(b"\x93NUMPY, and then nothing")
    assert str(bad) in error_of(qtbot, session, bad)
    assert session.document == before
    assert session.current_index == index
    assert [item.volume_path for item in session.items] == [item.volume_path for item in items]


def test_a_folder_whose_first_volume_is_bad_is_listed(qtbot: QtBot, session: Session, tmp_path: Path) -> None:
    folder = tmp_path / "mixed"
    folder.mkdir()
    (folder / "a.npy").write_bytes(b"")
    np.save(folder / "b.npy", np.zeros((3, 4, 5), np.uint8))
    error_of(qtbot, session, folder)
    assert [item.label for item in session.items] == ["a.npy", "b.npy"]
    assert session.volume is None


def test_what_was_edited_while_another_volume_was_read_is_saved(
    qtbot: QtBot, session: Session, volume_path: Path
) -> None:
    other = volume_path.with_name("v002.npy")
    shutil.copy(volume_path, other)
    shutil.copy(sidecar_path(volume_path), sidecar_path(other))
    path = session.annotation_path
    session.open_path(other)
    session.place((7.0, 8.0, 9.0))
    qtbot.waitUntil(lambda: session.volume is not None and session.volume.path == other)
    assert path is not None
    assert json.loads(path.read_text())["keypoints"][0]["position_um"] == [7.0, 8.0, 9.0]


def test_what_is_annotated_is_fitted_by_the_thread_that_reads(
    qtbot: QtBot, session: Session, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_volume(volume_path.with_name("v002.npy"))
    assert session.tool is not None
    pose = ToolPose((100.0, 100.0, 100.0), (1.0, 0.0, 0.0, 0.0))
    for name, position_um in keypoints_um(pose, session.tool).items():
        session.place(position_um, keypoint=name)
    shown = session.tool_fit
    open_and_wait(qtbot, session, volume_path.with_name("v002.npy"))
    assert session.tool_fit is None

    threads: list[threading.Thread] = []

    def fit(document: Annotation, tool: ToolSpecification) -> ToolFit | None:
        threads.append(threading.current_thread())
        return fit_document(document, tool)

    monkeypatch.setattr(opening, "fit_document", fit)
    monkeypatch.delattr(tool_body, "fit_document")
    open_and_wait(qtbot, session, volume_path)
    assert len(threads) == 1
    assert threads[0] is not threading.main_thread()
    assert session.tool_fit is not None
    assert shown is not None
    assert session.tool_fit.pose == shown.pose
    assert session.settled_pose == shown.pose
    # It is not taken for that of what is edited.
    monkeypatch.setattr(tool_body, "fit_document", lambda *_, **__: None, raising=False)
    session.place((300.0, 100.0, 100.0), keypoint="k1")
    assert session.tool_fit is None


def test_two_presses_of_next_go_two_volumes_on(qtbot: QtBot, session: Session, volume_path: Path) -> None:
    for name in ("v002.npy", "v003.npy"):
        shutil.copy(volume_path, volume_path.with_name(name))
        shutil.copy(sidecar_path(volume_path), sidecar_path(volume_path.with_name(name)))
    open_and_wait(qtbot, session, volume_path)
    session.next_volume()
    session.next_volume()
    qtbot.waitUntil(lambda: session.current_index == 2)


def test_the_level_of_a_volume_that_was_left_is_given_up(
    qtbot: QtBot, empty_session: Session, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = volume_path.with_name("v002.npy")
    np.save(other, np.full_like(np.load(volume_path), 90))
    shutil.copy(sidecar_path(volume_path), sidecar_path(other))
    begun, given_up = threading.Event(), threading.Event()

    def average(volume: Volume, spacing_um: Vector, **options: Any) -> Level:
        if volume.path == volume_path:
            begun.set()
            while not options["cancelled"]():
                given_up.wait(0.001)
            given_up.set()
            raise Cancelled
        return averaged_level(volume, spacing_um, **options)

    monkeypatch.setattr(level_loader, "averaged_level", average)
    open_and_wait(qtbot, empty_session, volume_path)
    assert empty_session.slice_level is not None
    qtbot.waitUntil(begun.is_set)
    open_and_wait(qtbot, empty_session, other)
    qtbot.waitUntil(lambda: not empty_session.jobs.running)
    assert given_up.is_set()
    assert empty_session.slice_level.kind == "averaged"
    assert (empty_session.slice_level.data == 90).all()


def test_an_opening_takes_the_place_of_one_that_still_reads(
    qtbot: QtBot, empty_session: Session, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = volume_path.with_name("v002.npy")
    shutil.copy(volume_path, other)
    shutil.copy(sidecar_path(volume_path), sidecar_path(other))
    begun, go_on = threading.Event(), threading.Event()
    prepare = opening.prepare

    def slow(found: opening.Found, *rest: Any) -> opening.Opened:
        if found.volume.path == volume_path:
            begun.set()
            assert go_on.wait(30)
        return prepare(found, *rest)

    monkeypatch.setattr(opening, "prepare", slow)
    opened: list[Path] = []
    empty_session.volume_changed.connect(
        lambda: opened.append(empty_session.volume.path) if empty_session.volume is not None else None
    )
    empty_session.open_path(volume_path)
    qtbot.waitUntil(begun.is_set)
    open_and_wait(qtbot, empty_session, other)
    go_on.set()
    qtbot.waitUntil(lambda: not empty_session.jobs.running)
    assert opened == [other]


def test_done_says_what_is_missing(qtbot: QtBot, session: Session) -> None:
    session.place((1.0, 2.0, 3.0))
    with qtbot.waitSignal(session.message_posted) as said:
        session.set_status("done")
    assert said.args[0] == "Done and saved, though k1, k2, k3, k4, k5 have no position"


def test_done_says_what_the_check_has_found(qtbot: QtBot, session: Session) -> None:
    assert session.tool is not None
    pose = ToolPose((3000.0, 4000.0, 2000.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 40.0, "theta2": 25.0})
    swapped = {"k0": "k1", "k1": "k0"}
    for name, position_um in keypoints_um(pose, session.tool).items():
        session.place(position_um, keypoint=swapped.get(name, name))
    qtbot.waitUntil(lambda: session.has_looked_for_mistakes)
    (mistake,) = session.mistakes
    with qtbot.waitSignal(session.message_posted) as said:
        session.set_status("done")
    assert said.args[0] == f"Done and saved, though the check says: {mistake.text}"


def test_of_the_signals_of_another_volume_the_last_one_is_known(
    qtbot: QtBot, session: Session, volume_path: Path
) -> None:
    following: list[tuple[str, bool]] = []
    for name in (
        "volume_changed",
        "levels_changed",
        "view_changed",
        "save_state_changed",
        "worklist_changed",
    ):
        signal = getattr(session, name)
        signal.connect(lambda *_, name=name: following.append((name, session.more_follows)))
    write_volume(volume_path.with_name("v002.npy"))

    open_and_wait(qtbot, session, volume_path.with_name("v002.npy"))

    last = next(place for place, (_, more) in enumerate(following) if not more)
    assert following[last] == ("worklist_changed", False)
    assert {"volume_changed", "save_state_changed"} <= {name for name, _ in following[:last]}
