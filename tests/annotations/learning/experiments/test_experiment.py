"""Experiments with networks of a few weights."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.errors import UserError  # noqa: E402
from annotations.learning.experiments.experiment import ExperimentData, experiment_data, run_experiment  # noqa: E402
from annotations.learning.experiments.experiments import ExperimentSize, experiment, resized  # noqa: E402
from annotations.learning.training import training_folder  # noqa: E402
from tests.annotations.learning.tiny_training import TOOL, tiny_settings  # noqa: E402

torch.set_num_threads(1)

SIZE = ExperimentSize("test", 3, 2, 2, 3, 2, 1e-3, 1e-3, 0.1, tiny_settings().sampling)
HEADS = experiment("heads", SIZE)


@pytest.fixture(scope="module", autouse=True)
def _no_curves() -> Iterator[None]:
    """Drawing takes longer than all the rest."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training_folder, "curves_svg", lambda *_arguments: b"<svg/>")
        yield


@pytest.fixture(scope="module")
def data() -> ExperimentData:
    return experiment_data((), TOOL, HEADS, SIZE)


def test_volumes_that_stand_in_are_said_to(data: ExperimentData) -> None:
    assert (data.description.training, data.description.validation) == (3, 2)
    assert "stand in" in data.description.in_words


def rows_of(folder: Path, name: str = "heads") -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = json.loads((folder / f"{name}.json").read_text())["rows"]
    return rows


@pytest.fixture(scope="module")
def done(data: ExperimentData, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of an experiment that ran at once."""
    folder = tmp_path_factory.mktemp("done")
    assert run_experiment(HEADS, SIZE, data, TOOL, folder) is not None
    return folder


def test_every_row_is_trained_and_tabulated(done: Path) -> None:
    rows = rows_of(done)

    assert [row["result"]["key"] for row in rows] == ["v2v", "v2v-regression"]
    assert rows[1]["result"]["targets"]["theta1_deg"]["n"] == 2
    assert "(not done)" not in (done / "heads.md").read_text()
    assert (done / "trainings" / "v2v.training" / "log.csv").exists()


def test_what_is_done_is_not_trained_again(data: ExperimentData, done: Path) -> None:
    said: list[str] = []
    before = {path: path.read_bytes() for path in done.rglob("*") if path.is_file()}

    run_experiment(HEADS, SIZE, data, TOOL, done, said.append)

    assert [line.endswith("done before") for line in said] == [True, True]
    assert {path: path.read_bytes() for path in done.rglob("*") if path.is_file()} == before


def test_an_interrupted_experiment_goes_on_to_the_same_results(
    data: ExperimentData, done: Path, tmp_path: Path
) -> None:
    asked: list[None] = []

    def after_three_steps() -> bool:
        asked.append(None)
        return len(asked) == 3

    # One step an epoch: the first row is done by then, and the second has begun.
    assert run_experiment(HEADS, SIZE, data, TOOL, tmp_path, stopped=after_three_steps) is None
    assert [row["result"] is None for row in rows_of(tmp_path)] == [False, True]
    assert run_experiment(HEADS, SIZE, data, TOOL, tmp_path) is not None

    for first, second in zip(rows_of(done), rows_of(tmp_path), strict=True):
        assert first["result"]["targets"] == second["result"]["targets"]


def test_pre_trained_rows_see_synthetic_volumes_first(data: ExperimentData, tmp_path: Path) -> None:
    size = replace(SIZE, synthetic=20)
    networks = experiment("networks", size)
    [row] = [row for row in networks.rows if row.key == "v2v-pretrained"]
    at_once = row.settings.synthetic.model_copy(update={"workers": 0})
    row = replace(row, settings=row.settings.model_copy(update={"synthetic": at_once}))

    run_experiment(replace(networks, rows=(row,)), size, data, TOOL, tmp_path)

    [result] = [each["result"] for each in rows_of(tmp_path, "networks")]
    assert (result["synthetic_volumes"], result["epochs"]) == (20, 2)


def test_results_of_another_size_are_not_mixed_in(data: ExperimentData, done: Path) -> None:
    longer = resized(SIZE, epochs=3)

    with pytest.raises(UserError, match="other settings"):
        run_experiment(experiment("heads", longer), longer, data, TOOL, done)
