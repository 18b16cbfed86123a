import errno
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings

from annotations import __version__
from annotations.documents import files
from annotations.documents.annotation import Annotation, BoxAnnotation, without_stamps
from annotations.documents.edits import place_keypoint, set_status
from annotations.documents.files import (
    ChangedOnDisk,
    DocumentError,
    annotation_bytes,
    backup_path,
    completed,
    file_identity,
    load_annotation,
    parse_annotation,
    save_annotation,
    ships,
    tool_of,
)
from annotations.documents.record import changed
from annotations.documents.write_guard import GUARD_NAME
from annotations.durable_files import SaveError
from annotations.geometry.tool import ToolError, ToolSpecification

HERE_UM = (9345.8, 9865.5, 2184.0)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "annotations" / "v001.keypoints.json"


@pytest.fixture
def saved(document: Annotation, path: Path) -> tuple[Annotation, str]:
    return save_annotation(document, path, expected="")


def files_beside(path: Path) -> list[Path]:
    return sorted(each for each in path.parent.iterdir() if each.name != GUARD_NAME)


def test_the_example_of_the_format_is_read(example: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "example.json"
    path.write_text(json.dumps(example), encoding="utf-8")
    document, _ = load_annotation(path)
    assert document.positions_um == {"k0": (9345.8, 9865.5, 2184.0)}
    assert document.keypoint("k0").source == "clicked"
    assert document.volume.shape == (1096, 1936, 1152)
    written = json.loads(annotation_bytes(document))
    assert {name: written[name] for name in example} == example


@given(document=...)
def test_a_file_holds_the_whole_document(document: Annotation) -> None:
    assert parse_annotation(annotation_bytes(document), "x") == document


@given(document=...)
@settings(max_examples=25)
def test_what_is_saved_is_what_is_loaded(document: Annotation) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "v001.json"
        written, identity = save_annotation(document, path, expected="")
        loaded, found = load_annotation(path)
        assert (loaded, found) == (written, identity)
        assert without_stamps(loaded) == without_stamps(document)


def test_a_file_is_read_by_people_line_by_line(document: Annotation) -> None:
    placed = place_keypoint(document, "k1", HERE_UM, "clicked")
    assert annotation_bytes(changed(placed, annotator="Ännchen")).decode() == (
        '{"schema": "oct-annotation/1",\n'
        ' "volume": {"path": "../volumes/v001.npy", "shape": [1096, 1936, 1152], "dtype": "uint8",'
        f' "spacing_um": [15.9, 13.5, 9.4], "fingerprint": "{"0" * 64}"}},\n'
        ' "tool": "magnetic-forceps",\n'
        f' "tool_fingerprint": "{placed.tool_fingerprint}",\n'
        ' "annotator": "Ännchen",\n'
        ' "method": "keypoints",\n'
        ' "status": "in_progress",\n'
        ' "keypoints": [\n'
        '  {"name": "k0", "state": "unplaced", "certainty": "sure"},\n'
        '  {"name": "k1", "state": "placed", "position_um": [9345.8, 9865.5, 2184.0],'
        ' "certainty": "sure", "source": "clicked"},\n'
        '  {"name": "k2", "state": "unplaced", "certainty": "sure"},\n'
        '  {"name": "k3", "state": "unplaced", "certainty": "sure"},\n'
        '  {"name": "k4", "state": "unplaced", "certainty": "sure"},\n'
        '  {"name": "k5", "state": "unplaced", "certainty": "sure"}\n'
        " ],\n"
        ' "boxes": [],\n'
        ' "created": "2026-11-22T05:00:00Z",\n'
        ' "modified": "2026-11-22T05:00:00Z",\n'
        ' "active_seconds": 0.0,\n'
        f' "program": "{__version__}"}}\n'
    )


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-310, 123456789.123456789, 2**53 + 2.0, -0.0])
def test_numbers_are_written_as_short_as_they_can_be_read_back(document: Annotation, value: float) -> None:
    content = annotation_bytes(place_keypoint(document, "k0", (value, 0.0, 0.0), "typed"))
    assert f"[{value!r}, 0.0, 0.0]".encode() in content
    assert parse_annotation(content, "x").positions_um["k0"][0].hex() == value.hex()


def test_a_volumes_name_that_is_no_unicode_survives(document: Annotation) -> None:
    strange = os.fsdecode(b"../volumes/Gr\xfc\xdfe.npy")
    kept = changed(document, volume=changed(document.volume, path=strange))
    assert parse_annotation(annotation_bytes(kept), "x").volume.path == strange


def test_saving_stamps_the_file_alone(document: Annotation, path: Path) -> None:
    written, _ = save_annotation(changed(document, active_seconds=12.5), path, expected="")
    assert written.modified > document.modified
    assert (written.active_seconds, written.program, written.created) == (12.5, __version__, document.created)
    again, _ = save_annotation(written, path, expected="", overwrite=True)
    assert again.active_seconds == 12.5


def test_the_previous_version_is_kept(document: Annotation, path: Path) -> None:
    _, identity = save_annotation(document, path, expected="")
    assert not backup_path(path).exists()
    first = path.read_bytes()
    save_annotation(set_status(document, "done"), path, expected=identity)
    assert backup_path(path).read_bytes() == first
    assert load_annotation(path)[0].status == "done"
    assert load_annotation(backup_path(path))[0].status == "in_progress"


def test_a_file_that_another_program_changed_is_not_overwritten(
    document: Annotation, path: Path, saved: tuple[Annotation, str]
) -> None:
    _, identity = saved
    theirs = annotation_bytes(set_status(document, "done"))
    path.write_bytes(theirs)
    with pytest.raises(ChangedOnDisk, match="another program has changed it"):
        save_annotation(document, path, expected=identity)
    assert path.read_bytes() == theirs
    assert files_beside(path) == [path]


def test_a_version_of_another_program_that_is_overwritten_stays_for_good(
    document: Annotation, path: Path, saved: tuple[Annotation, str]
) -> None:
    identity = saved[1]
    overwritten = []
    for keypoint in ("k0", "k5"):
        theirs = annotation_bytes(place_keypoint(document, keypoint, HERE_UM, "clicked"))
        overwritten.append(theirs)
        path.write_bytes(theirs)
        written, identity = save_annotation(document, path, expected=identity, overwrite=True)
        assert backup_path(path).read_bytes() == theirs
        # Saved again, as autosave does seconds later: their version is no longer the ordinary backup.
        for _ in range(2):
            _, identity = save_annotation(written, path, expected=identity)
        assert backup_path(path).read_bytes() != theirs
    kept = sorted(path.parent.glob("*.theirs.bak"))
    assert [each.read_bytes() for each in kept] == overwritten
    assert all(each.name.startswith(f"{path.name}.20") for each in kept)
    assert files_beside(path) == sorted([path, backup_path(path), *kept])


def test_overwriting_what_came_from_here_or_is_gone_keeps_no_other_version(
    document: Annotation, path: Path, saved: tuple[Annotation, str]
) -> None:
    _, identity = save_annotation(document, path, expected=saved[1], overwrite=True)
    path.unlink()
    save_annotation(document, path, expected=identity, overwrite=True)
    assert files_beside(path) == [path, backup_path(path)]


def test_what_cannot_be_kept_is_not_overwritten(
    document: Annotation, path: Path, saved: tuple[Annotation, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    theirs = annotation_bytes(set_status(document, "done"))
    path.write_bytes(theirs)
    monkeypatch.setattr(files, "theirs_path", lambda path: path / "no folder" / "theirs.bak")
    with pytest.raises(SaveError):
        save_annotation(document, path, expected=saved[1], overwrite=True)
    assert path.read_bytes() == theirs
    assert files_beside(path) == [path]


def test_a_file_that_appeared_meanwhile_is_not_overwritten(
    document: Annotation, path: Path, saved: tuple[Annotation, str]
) -> None:
    with pytest.raises(ChangedOnDisk):
        save_annotation(document, path, expected="")


def test_a_file_that_vanished_meanwhile_is_noticed(
    document: Annotation, path: Path, saved: tuple[Annotation, str]
) -> None:
    path.unlink()
    with pytest.raises(ChangedOnDisk):
        save_annotation(document, path, expected=saved[1])
    assert file_identity(path) == ""


def test_a_touched_file_with_the_same_content_is_no_change(
    document: Annotation, path: Path, saved: tuple[Annotation, str]
) -> None:
    content = path.read_bytes()
    path.unlink()
    path.write_bytes(content)
    os.utime(path, (0, 0))
    save_annotation(set_status(document, "done"), path, expected=saved[1])
    assert load_annotation(path)[0].status == "done"


def test_a_full_disk_leaves_the_old_file(
    document: Annotation, path: Path, saved: tuple[Annotation, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = path.read_bytes()

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(SaveError, match="No space left on device"):
            save_annotation(set_status(document, "done"), path, expected=saved[1])
    assert files_beside(path) == [path]
    assert path.read_bytes() == before
    # With space again the same save succeeds: nobody has to say "overwrite".
    save_annotation(set_status(document, "done"), path, expected=saved[1])
    assert load_annotation(path)[0].status == "done"


def test_an_unreadable_file_is_not_overwritten_unseen(
    document: Annotation, path: Path, saved: tuple[Annotation, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def forbid(_: Path) -> bytes:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "read_bytes", forbid)
    with pytest.raises(SaveError, match="could not be compared"):
        save_annotation(document, path, expected=saved[1])


def test_loading_takes_well_under_five_milliseconds(document: Annotation, path: Path) -> None:
    placed = document
    for name in ("k0", "k1", "k2", "k3", "k4", "k5"):
        placed = place_keypoint(placed, name, HERE_UM, "clicked")
    save_annotation(placed, path, expected="")
    seconds = []
    for _ in range(20):
        begin = time.perf_counter()
        load_annotation(path)
        seconds.append(time.perf_counter() - begin)
    # The best of many, because other programs share the machine; it takes a twentieth of this.
    assert min(seconds) < 0.002


def test_a_shipped_tool_is_found_by_its_name(document: Annotation, forceps: ToolSpecification) -> None:
    assert tool_of(document) == forceps
    assert ships(forceps)


def test_a_tool_that_travels_needs_no_folder(
    probe: ToolSpecification,
    begin_document: Callable[..., Annotation],
    write_volume: Callable[..., Path],
    path: Path,
) -> None:
    volume_path = write_volume(path.parent.parent / "volumes" / "v001.npy")
    begun = begin_document(volume_path, path, probe, ships=ships(probe))
    save_annotation(begun, path, expected="")
    loaded, _ = load_annotation(path)
    assert not ships(probe)
    assert tool_of(loaded) == probe
    assert loaded.tool_fingerprint == probe.fingerprint


def test_another_version_of_a_tool_is_not_taken_for_it(document: Annotation) -> None:
    older = changed(document, tool_fingerprint="f" * 64)
    with pytest.raises(DocumentError, match="another version of the tool 'magnetic-forceps'"):
        tool_of(older)
    with pytest.raises(ToolError, match="no tool specification 'scissors'"):
        tool_of(changed(document, tool="scissors"))


def test_a_document_is_completed_in_the_tools_order(document: Annotation, forceps: ToolSpecification) -> None:
    placed = place_keypoint(document, "k0", HERE_UM, "clicked")
    partial = changed(placed, keypoints=placed.keypoints[:2])
    backwards = changed(partial, keypoints=partial.keypoints[::-1])
    whole = completed(backwards, forceps)
    assert [keypoint.name for keypoint in whole.keypoints] == ["k0", "k1", "k2", "k3", "k4", "k5"]
    assert whole.keypoint("k0") == partial.keypoint("k0")
    assert whole.keypoint("k5").state == "unplaced"
    assert completed(whole, forceps) is whole


def test_a_keypoint_that_the_tool_lacks_is_refused(document: Annotation, probe: ToolSpecification) -> None:
    with pytest.raises(
        DocumentError, match="keypoint 'k0' is unknown to the tool 'probe', which has tip, shaft"
    ):
        completed(document, probe)


def test_a_box_on_a_link_that_the_tool_lacks_is_refused(
    document: Annotation, forceps: ToolSpecification
) -> None:
    boxed = changed(document, boxes=(BoxAnnotation(link="link0"), BoxAnnotation(link="jaw")))
    with pytest.raises(DocumentError, match="link 'jaw' is unknown to the tool 'magnetic-forceps'"):
        completed(boxed, forceps)


def test_a_file_of_no_bytes_has_an_identity_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "empty.json").touch()
    assert file_identity(tmp_path / "empty.json") != file_identity(tmp_path / "absent.json") == ""
