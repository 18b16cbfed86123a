import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from annotations.agreement.report import exporting
from annotations.cli import main
from annotations.documents.edits import place_keypoint, relabel, set_status
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.record import changed
from annotations.documents.study import annotation_path, load_study, save_study


@pytest.fixture
def annotated(study: Path) -> Path:
    """The study of two volumes, annotated by two people: ben 30 µm further along x than anna."""
    described = load_study(study)
    save_study(changed(described, annotators=("anna", "ben")), study)
    for volume in described.volumes:
        truth, _ = load_annotation(annotation_path(study, "truth", volume.id, "keypoints"))
        for name, shift_um in (("anna", 0.0), ("ben", 30.0)):
            document = changed(truth, annotator=name, status="in_progress")
            for keypoint, position_um in truth.positions_um.items():
                moved = tuple((np.asarray(position_um) + np.array([shift_um, 0, 0])).tolist())
                document = place_keypoint(document, keypoint, moved, "clicked")
            path = annotation_path(study, name, volume.id, "keypoints")
            save_annotation(set_status(document, "done"), path, expected="")
    return study


def test_the_published_table_is_printed(annotated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["agreement", str(annotated)]) == 0

    captured = capsys.readouterr()
    assert captured.err == ""
    words = captured.out.split()
    assert words[words.index("Position") :][:3] == ["Position", "(µm)", "15.0"]
    assert "2 annotators; by keypoints 4 annotations of 2 volumes" in captured.out
    assert "'truth': 2 files, no point placed by a person (synthesized)" in captured.out


def test_recognised_mistakes_are_told_below_the_table(
    annotated: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = annotation_path(annotated, "anna", load_study(annotated).volumes[0].id, "keypoints")
    document, identity = load_annotation(path)
    save_annotation(relabel(document, {"k2": "k3", "k3": "k2"}), path, expected=identity)

    assert main(["agreement", str(annotated)]) == 0

    shown = capsys.readouterr().out
    assert shown.index("Volumes (n)") < shown.index("Recognised mistakes: ") < shown.index("without the ann")


def test_all_files_have_the_same_numbers(
    annotated: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    html, tables, numbers, pdf = (tmp_path / name for name in ("r.html", "csv", "r.json", "r.pdf"))

    files = ["--html", str(html), "--csv", str(tables), "--json", str(numbers), "--pdf", str(pdf)]
    code = main(["agreement", str(annotated), *files, "--seed", "4", "--resamples", "150"])

    assert code == 0
    assert set(capsys.readouterr().out.splitlines()) == set(map(str, (html, tables, numbers, pdf)))
    fields = json.loads(numbers.read_text("utf-8"))
    assert (fields["seed"], fields["resamples"]) == (4, 150)
    targets = fields["methods"]["keypoints"]["targets"]
    assert targets["position_um"]["published"]["mean"] == pytest.approx(15.0)
    assert targets["position_um"]["pairwise"]["mean"] == pytest.approx(30.0)
    published = targets["position_um"]["published"]
    row = f"keypoints,position_um,um,published,main,{published['mean']},"
    assert row in (tables / "targets.csv").read_text("utf-8")
    assert f"{published['mean']:.1f}" in html.read_text("utf-8")
    assert "seen along each axis" in html.read_text("utf-8")
    assert pdf.read_bytes().startswith(b"%PDF")


def test_a_moved_folder_without_volumes_is_compared(annotated: Path, tmp_path: Path) -> None:
    shutil.rmtree(annotated / "volumes")
    moved = shutil.move(annotated / "annotations", tmp_path / "elsewhere")
    html, numbers = tmp_path / "r.html", tmp_path / "r.json"

    assert main(["agreement", str(moved), "--html", str(html), "--json", str(numbers)]) == 0

    targets = json.loads(numbers.read_text("utf-8"))["methods"]["keypoints"]["targets"]
    assert targets["position_um"]["published"]["n"] == 2
    assert "not at hand" in html.read_text("utf-8")


def test_only_finished_work_counts_on_demand(
    annotated: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = annotation_path(annotated, "ben", "v001", "keypoints")
    document, identity = load_annotation(path)
    save_annotation(set_status(document, "in_progress"), path, expected=identity)
    numbers = tmp_path / "r.json"

    assert main(["agreement", str(annotated), "--done-only", "--json", str(numbers)]) == 0

    targets = json.loads(numbers.read_text("utf-8"))["methods"]["keypoints"]["targets"]
    assert targets["position_um"]["published"]["n"] == 1


def test_nothing_to_compare_is_said_and_still_written(
    annotated: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.rmtree(annotated / "annotations" / "ben")
    numbers = tmp_path / "r.json"

    assert main(["agreement", str(annotated), "--json", str(numbers)]) == 1

    assert "nothing could be compared" in capsys.readouterr().err
    figures = json.loads(numbers.read_text("utf-8"))["methods"]["keypoints"]["targets"]["theta1_deg"]
    assert figures["published"] == {"mean": None, "sd": None, "ci95": None, "n": 0}


def test_a_study_without_annotations_is_no_error_of_the_program(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.rmtree(study / "annotations")

    assert main(["agreement", str(study), "--html", str(tmp_path / "r.html")]) == 1

    assert "nothing could be compared" in capsys.readouterr().err
    assert "Nothing could be compared" in (tmp_path / "r.html").read_text("utf-8")


def test_a_folder_of_predictions_gives_figures_that_are_absent(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    numbers, tables = tmp_path / "r.json", tmp_path / "csv"
    files = ["--json", str(numbers), "--csv", str(tables), "--html", str(tmp_path / "r.html")]

    assert main(["agreement", str(study / "annotations"), *files]) == 1

    assert "no point placed by a person" in capsys.readouterr().err
    targets = json.loads(numbers.read_text("utf-8"))["methods"]["keypoints"]["targets"]
    absent = {"mean": None, "sd": None, "ci95": None, "n": 0}
    assert targets["position_um"] == {"published": absent, "leave_one_out": absent, "pairwise": absent}
    assert "keypoints,position_um,um,published,main,,,,,0" in (tables / "targets.csv").read_text("utf-8")


def test_a_folder_of_damaged_annotations_is_said_and_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in/v1.keypoints.json").write_text("{")
    numbers = tmp_path / "r.json"
    files = ["--json", str(numbers), "--html", str(tmp_path / "r.html"), "--pdf", str(tmp_path / "r.pdf")]

    assert main(["agreement", str(tmp_path / "in"), *files]) == 1
    assert main(["agreement", str(tmp_path / "in")]) == 1

    captured = capsys.readouterr()
    assert "v1.keypoints.json" in captured.err
    assert "Nothing could be compared" in captured.out
    assert json.loads(numbers.read_text("utf-8"))["methods"] == {}


def test_an_interrupted_export_leaves_the_old_files(
    annotated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_arguments: object) -> bytes:
        raise KeyboardInterrupt

    (tmp_path / "r.json").write_text("old")
    monkeypatch.setattr(exporting, "html_bytes", interrupt)

    code = main(
        ["agreement", str(annotated), "--json", str(tmp_path / "r.json"), "--html", str(tmp_path / "r.html")]
    )

    assert code == 130
    assert (tmp_path / "r.json").read_text() == "old"
    assert not (tmp_path / "r.html").exists()


@pytest.mark.parametrize("is_terminal", [True, False])
def test_progress_is_for_terminals(
    annotated: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    is_terminal: bool,
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: is_terminal)

    assert main(["agreement", str(annotated), "--json", str(tmp_path / "r.json")]) == 0

    err = capsys.readouterr().err
    assert (err.endswith("100%\n"), err.count("\n")) == ((True, 1) if is_terminal else (False, 0))


@pytest.mark.parametrize("wrong", [["--json"], ["--seed", "-1"], ["--resamples", "3"]])
def test_impossible_wishes_are_misuse(annotated: Path, wrong: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["agreement", str(annotated), *wrong])

    assert caught.value.code == 2


def test_an_absent_folder_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["agreement", str(tmp_path / "absent")]) == 1

    assert "absent" in capsys.readouterr().err
