import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from annotations.agreement.report import exporting, written_files
from annotations.agreement.report.csv_report import FILES
from annotations.agreement.report.exporting import export
from annotations.agreement.report.json_report import json_bytes, read_json, write_json
from annotations.agreement.results import Agreement
from annotations.durable_files import SaveError
from annotations.errors import Cancelled

NAMES = sorted(FILES)


def listing(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def out(tmp_path: Path) -> Path:
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


@pytest.fixture
def few(make: object) -> Agreement:
    """An agreement that is drawn quickly."""
    agreement: Agreement = make(  # type: ignore[operator]
        ("anna", "ben"),
        methods=("keypoints",),
        volumes=2,
        targets=("position_um",),
        components=("position_x_um",),
    )
    return agreement


def test_everything_that_was_asked_for_is_written(few: Agreement, out: Path) -> None:
    shares: list[float] = []

    written = export(
        few,
        out,
        html=out / "r.html",
        csv=out / "tables",
        json=out / "r.json",
        pdf=out / "r.pdf",
        progress=shares.append,
    )

    assert sorted(path.name for path in written) == listing(out) == ["r.html", "r.json", "r.pdf", "tables"]
    assert listing(out / "tables") == NAMES
    assert read_json(out / "r.json") == few
    assert (out / "r.html").read_bytes().startswith(b"<!DOCTYPE html>")
    assert (out / "r.pdf").read_bytes().startswith(b"%PDF")
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_the_same_agreement_gives_the_same_bytes(few: Agreement, out: Path) -> None:
    for name in ("first", "second"):
        export(few, out, html=out / f"{name}.html", pdf=out / f"{name}.pdf", json=out / f"{name}.json")

    for ending in ("html", "pdf", "json"):
        assert (out / f"first.{ending}").read_bytes() == (out / f"second.{ending}").read_bytes()


def test_nothing_is_written_unasked(few: Agreement, out: Path) -> None:
    assert export(few, out) == ()
    assert listing(out) == []


def test_an_earlier_export_is_replaced_as_a_whole(few: Agreement, empty: Agreement, out: Path) -> None:
    export(few, out, csv=out / "tables")
    before = (out / "tables" / "targets.csv").read_bytes()
    (out / "tables" / "pairs.csv").unlink()

    export(empty, out, csv=out / "tables")

    assert listing(out) == ["tables"]
    assert listing(out / "tables") == NAMES
    assert (out / "tables" / "targets.csv").read_bytes() != before


def test_a_folder_with_other_things_is_left_alone(few: Agreement, out: Path) -> None:
    (out / "thesis.tex").write_text("years of work")

    with pytest.raises(SaveError, match=r"thesis\.tex"):
        export(few, out, csv=out, json=out / "r.json")

    assert listing(out) == ["thesis.tex"]


def test_a_file_is_no_folder(few: Agreement, out: Path) -> None:
    (out / "tables").write_text("a file")

    with pytest.raises(SaveError, match="it is a file"):
        export(few, out, csv=out / "tables")

    assert (out / "tables").read_text() == "a file"


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES])
@pytest.mark.parametrize("function", ["fsync", "replace", "rename", "mkdir"])
def test_a_failing_export_leaves_the_old_files(
    few: Agreement,
    empty: Agreement,
    out: Path,
    monkeypatch: pytest.MonkeyPatch,
    function: str,
    number: int,
) -> None:
    export(few, out, csv=out / "tables", json=out / "r.json")
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}

    def refuse(*_arguments: object, **_options: object) -> None:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(os, function, refuse)
        with pytest.raises(SaveError, match=os.strerror(number)):
            export(empty, out, csv=out / "tables", json=out / "r.json")

    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_the_old_folder_comes_back_if_the_new_one_cannot_take_its_place(
    few: Agreement, empty: Agreement, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export(few, out, csv=out / "tables")
    before = (out / "tables" / "targets.csv").read_bytes()
    rename, calls = Path.rename, []

    def fail_once(path: Path, target: Path) -> Path:
        calls.append(target)
        if len(calls) == 2:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", fail_once)

    with pytest.raises(SaveError):
        export(empty, out, csv=out / "tables")

    assert len(calls) == 3
    assert listing(out) == ["tables"]
    assert (out / "tables" / "targets.csv").read_bytes() == before


KILLED = """
import os, signal, sys
from pathlib import Path
from annotations import durable_files
from annotations.agreement.report import exporting, written_files
from annotations.agreement.report.json_report import read_json

out, last = Path(sys.argv[1]), int(sys.argv[2])
written = 0

def replace(path, content, **options):
    global written
    if written == last:
        os.kill(os.getpid(), signal.SIGKILL)
    written += 1
    durable_files.replace_durably(path, content, **options)

written_files.replace_durably = replace
agreement = read_json(out / "new.json")
exporting.export(agreement, out, csv=out / "tables", json=out / "r.json")
"""


@pytest.mark.skipif(os.name == "nt", reason="there is no SIGKILL")
@pytest.mark.parametrize("files", [0, 5, len(FILES)])
def test_a_killed_export_leaves_no_half_file(few: Agreement, empty: Agreement, out: Path, files: int) -> None:
    export(few, out, csv=out / "tables", json=out / "r.json")
    old = {path.name: path.read_bytes() for path in (out / "tables").iterdir()}
    write_json(empty, out / "new.json")

    done = subprocess.run([sys.executable, "-c", KILLED, str(out), str(files)], check=False)

    assert done.returncode == -signal.SIGKILL
    assert (out / "r.json").read_bytes() == json_bytes(few)
    tables = {path.name: path.read_bytes() for path in (out / "tables").iterdir()}
    if files < len(FILES):
        assert tables == old
    else:
        # All of the new ones were there before the next file was begun.
        assert sorted(tables) == NAMES
        assert tables != old


def test_a_cancelled_export_writes_nothing(few: Agreement, out: Path) -> None:
    with pytest.raises(Cancelled):
        export(few, out, html=out / "r.html", json=out / "r.json", cancelled=lambda: True)
    with pytest.raises(Cancelled):
        export(few, out, csv=out / "tables", cancelled=lambda: True)

    assert listing(out) == []


def test_all_is_made_before_anything_is_written(
    few: Agreement, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_arguments: object) -> bytes:
        raise MemoryError

    monkeypatch.setattr(exporting, "pdf_bytes", fail)

    with pytest.raises(MemoryError):
        export(few, out, html=out / "r.html", csv=out / "tables", json=out / "r.json", pdf=out / "r.pdf")

    assert listing(out) == []


def test_where_nothing_can_be_written_it_is_said_before_anything_is_drawn(
    few: Agreement, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(**_where: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    def draw(*_args: object) -> None:
        pytest.fail("something was drawn")

    monkeypatch.setattr(written_files.tempfile, "TemporaryFile", refuse)
    monkeypatch.setattr(exporting, "thumbnails", draw)
    with pytest.raises(SaveError, match="Permission denied"):
        export(few, out, html=out / "new" / "r.html")
    assert listing(out) == []
