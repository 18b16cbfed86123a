"""What `load_annotation` refuses, and with which line: each row of the tables is a test."""

import errno
import os
from pathlib import Path

import pytest

from annotations.documents.annotation import Annotation
from annotations.documents.edits import place_keypoint
from annotations.documents.files import DocumentError, annotation_bytes, load_annotation, parse_annotation

# As a person or another program may have laid it out; the table below spoils it in one place a row.
EXAMPLE = """{"schema": "oct-annotation/1",
 "volume": {"path": "../volumes/v001.npy", "shape": [1096, 1936, 1152], "dtype": "uint8",
            "spacing_um": [15.9, 13.5, 9.4], "fingerprint": "…"},
 "tool": "magnetic-forceps", "annotator": "anna", "method": "keypoints", "status": "in_progress",
 "keypoints": [{"name": "k0", "state": "placed", "position_um": [9345.8, 9865.5, 2184.0],
                "certainty": "sure", "source": "clicked"},
               {"name": "k1", "state": "unplaced"}],
 "boxes": [],
 "created": "2026-11-22T05:00:00Z", "modified": "2026-11-22T05:03:10Z", "program": "0.1.0"}
"""


@pytest.mark.parametrize(
    ("right", "wrong", "line", "problem"),
    [
        ('"state": "placed"', '"state": "plcaed"', 5, "keypoints.0.state: Input should be 'placed', 'occlu"),
        ('"state": "placed", ', "", 5, "keypoints.0: keypoint 'k0' is unplaced but has a position_um"),
        ('"state": "unplaced"', '"state": "occluded"', 7, "'k1' is occluded but has no position_um"),
        ('"certainty": "sure"', '"certainty": 1', 6, "keypoints.0.certainty: Input should be 'sure' or"),
        ('"source": "clicked"', '"sauce": "clicked"', 6, "the field 'keypoints.0.sauce' is unknown"),
        ('"name": "k1", ', "", 7, "the field 'keypoints.1.name' is missing"),
        ('"name": "k1"', '"name": "k0"', 7, "keypoint 'k0' stands more than once"),
        ('"name": "k1"', '"name": "k1",\n "name": "k2"', 8, "the field 'name' stands twice in one object"),
        ('"boxes": []', '"boxes": [],\n "tool": "needle"', 9, "the field 'tool' stands twice in one object"),
        ('"boxes": []', '"boxes": {}', 8, "boxes: Input should be a valid tuple"),
        ('"boxes": []', '"boxs": []', 8, "the field 'boxs' is unknown"),
        ('"boxes": []', '"schema_id": "oct-annotation/1"', 8, "the field 'schema_id' is unknown"),
        (
            "9345.8",
            '"9345.8"',
            5,
            "keypoints.0.position_um.0: Input should be a valid number, found '9345.8'",
        ),
        ("9345.8", "true", 5, "keypoints.0.position_um.0: Input should be a valid number, found True"),
        ("9345.8", "null", 5, "keypoints.0.position_um.0: Input should be a valid number, found None"),
        ("9345.8", "NaN", 5, "NaN is not a number"),
        ("9345.8", "1e999", 5, "keypoints.0.position_um.0: Input should be a finite number, found inf"),
        ("9345.8, ", "", 5, "the field 'keypoints.0.position_um.2' is missing"),
        ("[15.9, 13.5", "[0, 13.5", 3, "volume.spacing_um.0: Input should be greater than 0, found 0"),
        (
            "[15.9, 13.5",
            "[15.9, -13.5",
            3,
            "volume.spacing_um.1: Input should be greater than 0, found -13.5",
        ),
        ("1936, 1152", "1936.5, 1152", 2, "volume.shape.1: Input should be a valid integer, found 1936.5"),
        ("1936, 1152]", "1936]", 2, "the field 'volume.shape.2' is missing"),
        ('"../volumes/v001.npy"', '""', 2, "volume.path: a path is not empty"),
        ('"keypoints", "status"', '"points", "status"', 4, "method: Input should be 'keypoints' or 'boxes'"),
        ('"annotator": "anna", ', "", 1, "the field 'annotator' is missing"),
        ("2026-11-22T05:00:00Z", "22.11.2026", 9, "created: a time is written like 2026-11-22T05:00:00Z"),
        ("05:00:00Z", "05:00:00", 9, "created: a time must say its zone"),
        ('"program": "0.1.0"}', '"program": "0.1.0"', 10, "the file is truncated"),
        ('"status": "in_progress",', '"status": "in_progress"', 5, "it is not valid JSON (Expecting ',' del"),
    ],
)
def test_a_wrong_file_is_refused_with_the_line(
    tmp_path: Path, right: str, wrong: str, line: int, problem: str
) -> None:
    assert EXAMPLE.count(right) == 1
    path = tmp_path / "wrong.json"
    content = EXAMPLE.replace(right, wrong).encode()
    path.write_bytes(content)
    with pytest.raises(DocumentError) as refused:
        load_annotation(path)
    assert str(refused.value).startswith(f"{path}, line {line}: ")
    assert problem in str(refused.value)
    assert refused.value.remedy
    assert path.read_bytes() == content


@pytest.mark.parametrize("schema", ['"oct-annotation/2"', '"oct-annotation/1.1"'])
def test_a_newer_schema_asks_for_a_newer_program(schema: str) -> None:
    newer = EXAMPLE.replace('"oct-annotation/1"', schema).replace('"boxes": []', '"future": []')
    with pytest.raises(DocumentError, match="Open it with the newer version of the program that wrote it"):
        parse_annotation(newer.encode(), "newer.json")


@pytest.mark.parametrize(
    "text",
    ["[]", "5", "null", '"text"', "{}", '{"schema": 1}', '{"schema": "oct-tool/1"}', '{"schema": null}'],
)
def test_another_kind_of_file_is_refused(text: str) -> None:
    with pytest.raises(DocumentError, match="it is not an annotation file"):
        parse_annotation(text.encode(), "other.json")


@pytest.mark.parametrize(
    "content",
    [b"\x93NUMPY\x01\x00", EXAMPLE.encode("utf-16"), EXAMPLE.encode("latin-1", "replace") + b"\xe9"],
)
def test_what_is_no_text_is_refused(content: bytes) -> None:
    with pytest.raises(DocumentError, match="it is not text"):
        parse_annotation(content, "other.json")


def test_a_byte_order_mark_is_no_mistake() -> None:
    assert parse_annotation(EXAMPLE.encode("utf-8-sig"), "x") == parse_annotation(EXAMPLE.encode(), "x")


def test_a_file_that_is_cut_off_anywhere_is_refused(document: Annotation) -> None:
    content = annotation_bytes(place_keypoint(document, "k0", (9345.8, 9865.5, 2184.0), "clicked"))
    for length in range(len(content) - 1):
        with pytest.raises(DocumentError):
            parse_annotation(content[:length], "cut.json")
    # The last byte is only the end of the line.
    assert parse_annotation(content[:-1], "cut.json") == parse_annotation(content, "cut.json")


def test_an_absent_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match=os.strerror(errno.ENOENT)):
        load_annotation(tmp_path / "absent.json")


def test_a_path_that_no_file_can_have_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="could not be read"):
        load_annotation(tmp_path / "a\0b.json")


def test_a_folder_in_place_of_the_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="could not be read"):
        load_annotation(tmp_path)


def test_a_forbidden_file_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "v001.json"
    path.write_text(EXAMPLE, encoding="utf-8")

    def forbid(_: Path) -> bytes:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "read_bytes", forbid)
    with pytest.raises(DocumentError, match="Permission denied"):
        load_annotation(path)


def test_a_volume_taken_for_an_annotation_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "volume.npy"
    with path.open("wb") as stream:
        stream.truncate(2_400_000_000)
    with pytest.raises(DocumentError, match="too large for an annotation file"):
        load_annotation(path)
