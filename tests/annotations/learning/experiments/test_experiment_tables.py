"""The tables of experiments, and the results that they are made of."""

import csv
import json
from pathlib import Path

import pytest

from annotations.documents.record import changed, now
from annotations.errors import UserError
from annotations.learning.experiments.experiment_results import (
    DataDescription,
    RowResult,
    read_result,
    write_result,
)
from annotations.learning.experiments.experiment_tables import ExperimentTable
from annotations.learning.experiments.experiments import EXPERIMENT_SIZES, ExperimentRow, experiment
from annotations.prediction.errors.prediction_errors import ErrorFigures

SIZE = EXPERIMENT_SIZES["tiny"]
HEADS = experiment("heads", SIZE)
KEYPOINTS, REGRESSION = HEADS.rows
DATA = DataDescription(fingerprint="f", tool="t", training=24, validation=8)
TARGETS = ("position_mm", "orientation_deg", "theta1_deg", "theta2_deg")


def result_of(row: ExperimentRow, mean: float = 1.234, missing: int = 0) -> RowResult:
    figures = ErrorFigures(mean=mean, sd=0.5, median=1.0, p95=3.0, n=8 - missing, missing=missing)
    return RowResult(
        key=row.key,
        settings=row.settings.as_toml(),
        data=DATA,
        parameters=1234,
        synthetic_volumes=0,
        epochs=30,
        seconds=12.5,
        device="cpu",
        targets=dict.fromkeys(TARGETS, figures),
        far_share=0.25,
        created=now(),
    )


def table(*results: RowResult, data: DataDescription = DATA) -> ExperimentTable:
    return ExperimentTable(HEADS, SIZE, data, TARGETS, {each.key: each for each in results})


def test_each_row_stands_above_the_published_one() -> None:
    lines = table(result_of(KEYPOINTS)).as_markdown().splitlines()

    place = lines.index("|  | position (mm) | orientation (°) | θ1 (°) | θ2 (°) | keypoints over 2 mm |")
    assert lines[place + 2] == (
        "| V2V-PoseNet, keypoints by heatmaps | 1.23 ± 0.50 | 1.2 ± 0.5 | 1.2 ± 0.5 | 1.2 ± 0.5 | 25.0% |"
    )
    assert lines[place + 3] == "| *published* | *0.36 ± 0.17* | *2.9 ± 3.0* | *2.1 ± 2.1* | *2.6 ± 1.9* |  |"
    assert lines[place + 4].startswith("| V2V-PoseNet, direct regression (not done) | – |")
    assert lines[place + 5].startswith("| *published* | *4.90 ± 1.10* |")


def test_what_was_not_found_is_counted_beside_the_mean() -> None:
    assert "1.23 ± 0.50, not found in 3 of 8" in table(result_of(KEYPOINTS, missing=3)).as_markdown()


def test_the_caption_says_what_the_volumes_are_and_what_is_reduced() -> None:
    words = table().as_markdown()
    real = changed(DATA, studies=("Phantoms",))

    assert "Synthetic volumes stand in" in words
    assert "14 × 70 × 42 samples in place of 28 × 139 × 83" in words
    assert "Synthetic volumes stand in" not in table(data=real).as_markdown()
    assert "Annotated volumes of Phantoms: 24 volumes" in table(data=real).as_markdown()


def test_a_program_gets_one_row_a_run_with_its_settings() -> None:
    rows = list(csv.DictReader(table(result_of(REGRESSION)).as_csv().splitlines()))

    assert [row["key"] for row in rows] == ["v2v", "v2v-regression"]
    assert [row["done"] for row in rows] == ["False", "True"]
    assert float(rows[1]["theta2_deg_mean"]) == 1.234
    assert float(rows[1]["published_theta2_deg_mean"]) == 13.2
    assert rows[1]["settings.network.kind"] == "v2v-regression"
    assert rows[1]["device"] == "cpu"


def test_the_files_hold_the_same(tmp_path: Path) -> None:
    written = table(result_of(KEYPOINTS)).write(tmp_path / "new")

    assert [path.name for path in written] == ["heads.md", "heads.csv", "heads.json"]
    fields = json.loads(written[2].read_text())
    first, second = fields["rows"]
    assert first["result"]["targets"]["position_mm"]["mean"] == 1.234
    assert first["published"]["position_mm"] == [0.36, 0.17]
    assert second["result"] is None


def test_a_result_is_read_again_as_it_was(tmp_path: Path) -> None:
    result = result_of(KEYPOINTS)
    write_result(tmp_path, KEYPOINTS, result)

    assert read_result(tmp_path, KEYPOINTS, DATA) == result
    assert read_result(tmp_path, REGRESSION, DATA) is None


def test_a_result_of_other_settings_or_volumes_is_refused(tmp_path: Path) -> None:
    write_result(tmp_path, KEYPOINTS, result_of(KEYPOINTS))
    [other, _] = experiment("heads", SIZE, seed=1).rows

    with pytest.raises(UserError, match="other settings"):
        read_result(tmp_path, other, DATA)
    with pytest.raises(UserError, match="other volumes"):
        read_result(tmp_path, KEYPOINTS, changed(DATA, fingerprint="g"))


def test_a_result_that_is_damaged_is_refused(tmp_path: Path) -> None:
    write_result(tmp_path, KEYPOINTS, result_of(KEYPOINTS))
    [path] = tmp_path.rglob("*.json")
    path.write_text(path.read_text()[:40])

    with pytest.raises(UserError, match=r"v2v\.json"):
        read_result(tmp_path, KEYPOINTS, DATA)
