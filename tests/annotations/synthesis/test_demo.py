from pathlib import Path

import pytest

from annotations.documents.checks import check_file
from annotations.documents.study import load_study
from annotations.durable_files import SaveError
from annotations.errors import Cancelled
from annotations.synthesis import demo
from annotations.synthesis.demo import make_demo_study


@pytest.fixture(autouse=True)
def small_demo(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo, "_SHAPE", (22, 39, 23))


def test_the_demo_study_opens_and_is_sound(empty_folder: Path) -> None:
    folder = make_demo_study(empty_folder / "data" / "demo")

    study = load_study(folder)
    assert len(study.volumes) == 5
    assert study.annotators == ("truth", "demo")
    for volume in study.volumes:
        assert check_file(folder / "annotations" / "truth" / f"{volume.id}.keypoints.json") == ()
    assert not (folder / "annotations" / "demo").exists()
    assert list((empty_folder / "data").iterdir()) == [folder]


def test_the_demo_study_is_made_once(empty_folder: Path) -> None:
    folder = make_demo_study(empty_folder / "demo")
    mine = folder / "annotations" / "demo" / "v001.keypoints.json"
    mine.parent.mkdir()
    mine.write_text("mine")

    def fail(_share: float) -> None:
        pytest.fail("it was made again")

    assert make_demo_study(folder, fail) == folder
    assert mine.read_text() == "mine"


def test_cancelling_leaves_nothing_behind(empty_folder: Path) -> None:
    with pytest.raises(Cancelled):
        make_demo_study(empty_folder / "demo", cancelled=lambda: True)

    assert list(empty_folder.iterdir()) == []


def test_an_empty_folder_may_be_in_its_place(empty_folder: Path) -> None:
    (empty_folder / "demo").mkdir()

    make_demo_study(empty_folder / "demo")

    assert load_study(empty_folder / "demo").volumes


@pytest.mark.parametrize("inside", [None, "notes.txt"])
def test_what_is_in_its_place_is_left_alone(empty_folder: Path, inside: str | None) -> None:
    mine = empty_folder / "demo" if inside is None else empty_folder / "demo" / inside
    mine.parent.mkdir(exist_ok=True)
    mine.write_text("mine")

    with pytest.raises(SaveError, match="could not take its place"):
        make_demo_study(empty_folder / "demo")

    assert mine.read_text() == "mine"
    assert list(empty_folder.iterdir()) == [empty_folder / "demo"]


def test_two_processes_that_make_it_at_once_share_one(empty_folder: Path) -> None:
    folder = empty_folder / "demo"

    def made_meanwhile(share: float) -> None:
        if share == 1:
            folder.mkdir()
            (folder / "study.toml").write_text("the other's")

    assert make_demo_study(folder, made_meanwhile) == folder

    assert (folder / "study.toml").read_text() == "the other's"
    assert list(empty_folder.iterdir()) == [folder]
