"""The guard of a folder: one program at a time, whatever becomes of the others."""

import subprocess
import sys
from pathlib import Path

import pytest

from annotations.documents import write_guard
from annotations.documents.annotation import Annotation
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.write_guard import GUARD_NAME, writing_beside
from annotations.durable_files import SaveError

SCRIPT = Path(__file__).with_name("sharing_process.py")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "annotations" / "v001.keypoints.json"


@pytest.fixture
def other(path: Path):
    """Another program in the middle of its writing in the folder; it is killed in the end."""
    with subprocess.Popen(
        [sys.executable, str(SCRIPT), "guard", str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        yield process
        process.kill()


def test_who_waits_for_long_is_told_and_nothing_is_written(
    path: Path, document: Annotation, other: subprocess.Popen[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(write_guard, "_PATIENCE_S", 0.1)
    with pytest.raises(SaveError, match="another program has been writing in its folder"):
        save_annotation(document, path, expected="")
    assert not path.exists()


def test_who_waits_a_little_goes_on_when_the_other_one_has_ended(
    path: Path, document: Annotation, other: subprocess.Popen[str]
) -> None:
    assert other.stdin is not None
    other.stdin.write("go on\n")
    other.stdin.flush()
    save_annotation(document, path, expected="")
    assert load_annotation(path)[0].annotator == document.annotator


def test_a_killed_program_keeps_nobody_waiting(
    path: Path, document: Annotation, other: subprocess.Popen[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # The system lets go of its locks a moment after the process is gone.
    monkeypatch.setattr(write_guard, "_PATIENCE_S", 1.0)
    other.kill()
    other.wait()
    save_annotation(document, path, expected="")
    assert path.exists()


def test_a_folder_is_tidied_away_only_when_nothing_is_left_in_it(path: Path) -> None:
    with writing_beside(path, tidied=[path.parent]):
        path.write_bytes(b"{}")
    assert sorted(each.name for each in path.parent.iterdir()) == [GUARD_NAME, path.name]
    with writing_beside(path, tidied=[path.parent]):
        path.unlink()
    assert not path.parent.exists()


def test_what_goes_wrong_inside_comes_out_and_lets_go(path: Path) -> None:
    with pytest.raises(ZeroDivisionError), writing_beside(path):
        raise ZeroDivisionError
    with writing_beside(path):
        pass


def test_a_folder_that_is_tidied_away_while_somebody_waits_is_made_again(
    path: Path, document: Annotation, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = write_guard.make_folder

    def made_and_tidied_away(folder: Path) -> None:
        made(folder)
        monkeypatch.undo()
        folder.rmdir()

    monkeypatch.setattr(write_guard, "make_folder", made_and_tidied_away)
    save_annotation(document, path, expected="")
    assert (path.parent / GUARD_NAME).exists()
