import logging
from pathlib import Path

import pytest

from annotations import demo
from annotations.demo import make_demo_study
from annotations.documents.checks import Finding, check_file
from annotations.documents.files import load_annotation
from annotations.documents.permission import permission
from annotations.documents.study import load_study
from annotations.documents.study_checks import check_study
from annotations.durable_files import SaveError
from annotations.errors import Cancelled, UserError
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.prediction.prediction_file import load_prediction
from annotations.prediction.runtime import Runtime
from tests.annotations.prediction.known_keypoints import COARSE, described, heatmaps_of, save_knowing


@pytest.fixture(autouse=True)
def small_demo(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo, "_SHAPE", (22, 39, 23))
    monkeypatch.setattr(demo, "shipped_checkpoint", lambda _tool: None)


@pytest.fixture
def shipped(empty_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkpoint that ships, and knows the first volume; beside a demo study without predictions."""
    first = make_demo_study(empty_folder / "known") / "annotations" / "truth" / "v001.keypoints.json"
    document, _ = load_annotation(first)
    description = described(COARSE, HeatmapConvention(sigma_voxel=(0.5, 0.5, 0.5)), name="magnetic-forceps")
    heatmaps = heatmaps_of(description, document.positions_um, document.volume.spacing_um)
    path = save_knowing(empty_folder / "shipped.onnx", description, heatmaps).path
    monkeypatch.setattr(demo, "shipped_checkpoint", lambda tool: {"magnetic-forceps": path}[tool])
    return path


def findings(folder: Path) -> list[Finding]:
    return [finding for _, finding in check_study(folder)]


def test_the_demo_study_opens_and_is_sound(empty_folder: Path) -> None:
    folder = make_demo_study(empty_folder / "data" / "demo")

    study = load_study(folder)
    assert len(study.volumes) == 5
    assert study.annotators == ("truth", "demo")
    assert permission(study, folder, "demo", study.volumes[0].id).may_see
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


def test_the_shipped_checkpoint_predicts_each_volume(shipped: Path, empty_folder: Path) -> None:
    shares: list[float] = []

    folder = make_demo_study(empty_folder / "demo", shares.append)

    study = load_study(folder)
    # Nothing more is to be said than of a demo study without predictions.
    assert findings(folder) == findings(empty_folder / "known")
    for volume in study.volumes:
        path = folder / "predictions" / "magnetic-forceps" / f"{volume.id}.json"
        prediction = load_prediction(path)
        assert (path.parent / prediction.volume.path).resolve() == folder / volume.path
        truth, _ = load_annotation(folder / "annotations" / "truth" / f"{volume.id}.keypoints.json")
        assert prediction.volume.fingerprint == truth.volume.fingerprint
        if volume.id == "v001":
            for name, position_um in prediction.positions_um.items():
                assert position_um == pytest.approx(truth.positions_um[name], abs=30)
    assert shares == sorted(shares)
    assert shares[-1] == 1


def test_predictions_can_be_cancelled_too(shipped: Path, empty_folder: Path) -> None:
    shares: list[float] = []

    with pytest.raises(Cancelled):
        make_demo_study(empty_folder / "demo", shares.append, lambda: shares[-1:] > [0.85])

    assert shares[-1] < 1
    assert not (empty_folder / "demo").exists()


def test_without_a_runtime_the_demo_has_no_predictions(
    shipped: Path, empty_folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refuse(_checkpoint: object) -> Runtime:
        raise UserError("OpenVINO, which runs networks, cannot be loaded")

    monkeypatch.setattr(demo, "Runtime", refuse)

    with caplog.at_level(logging.WARNING):
        folder = make_demo_study(empty_folder / "demo")

    assert load_study(folder).volumes
    assert not (folder / "predictions").exists()
    assert "OpenVINO" in caplog.text


def test_a_checkpoint_that_is_damaged_is_no_reason_to_have_no_demo(shipped: Path, empty_folder: Path) -> None:
    shipped.write_bytes(b"PK")

    folder = make_demo_study(empty_folder / "demo")

    assert load_study(folder).volumes
    assert not (folder / "predictions").exists()
