"""The page about checkpoints says what they are: its description loads, and its program runs."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from onnx import helper, numpy_helper
from pydantic import BaseModel

from annotations.documents.record import changed
from annotations.prediction.checkpoint import METADATA_KEY, save_checkpoint
from annotations.prediction.checkpoint_description import (
    CheckpointDescription,
    ErrorSummary,
    TrainingOrigin,
    TrainingSummary,
)
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.prediction.onnx_graph import IR_VERSIONS, OPERATORS, OPSETS
from annotations.prediction.predictor import Predictor
from annotations.prediction.runtime import Runtime
from annotations.volumes import open_volume
from annotations.volumes.sampling import Sampling
from tests.annotations.prediction.tiny_networks import DESCRIPTION, SAMPLING, convolution, network

PAGE = (Path(__file__).parents[3] / "docs" / "checkpoints.md").read_text(encoding="utf-8")
MODELS = (CheckpointDescription, TrainingSummary, TrainingOrigin, ErrorSummary, Sampling, HeatmapConvention)
SPACING_UM = (200.0, 90.0, 24.0)


def block(language: str) -> str:
    [found] = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return str(found)


def fields_of(model: type[BaseModel]) -> Iterator[str]:
    for name, field in model.model_fields.items():
        yield field.alias or name


def test_the_description_on_the_page_loads() -> None:
    fields = json.loads(block("json"))

    description = CheckpointDescription.model_validate(fields)

    assert set(fields) == set(fields_of(CheckpointDescription))
    for name, model in (
        ("sampling", Sampling),
        ("heatmaps", HeatmapConvention),
        ("training", TrainingSummary),
    ):
        assert set(fields[name]) == set(fields_of(model))
    assert description.input_shape == (1, 1, 32, 160, 96)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_the_page_names_every_field(model: type[BaseModel]) -> None:
    assert [name for name in fields_of(model) if f"`{name}`" not in PAGE] == []


def test_the_page_says_what_is_let_through() -> None:
    assert f"`{METADATA_KEY}`" in PAGE
    assert f"IR versions other than {IR_VERSIONS[0]} to {IR_VERSIONS[-1]}" in PAGE
    assert f"opsets other than {OPSETS[0]} to {OPSETS[-1]}" in PAGE
    [listed] = re.findall(r"operators other than (.*?): none", PAGE, re.DOTALL)
    assert set(re.findall(r"[A-Z]\w+", listed)) == OPERATORS


@pytest.mark.parametrize(
    ("convention", "is_averaged", "depth_axis", "shape"),
    [
        (HeatmapConvention(), True, 2, (18, 22, 34)),
        (HeatmapConvention(shrink=0.8), False, 2, (18, 22, 34)),
        (HeatmapConvention(target="one-hot", decoding="argmax"), True, 2, (9, 30, 21)),
        (
            HeatmapConvention(target="gaussian", decoding="soft-argmax", temperature=10.0, shrink=0.9),
            True,
            0,
            (40, 22, 30),
        ),
    ],
    ids=[
        "integral",
        "shrunk, of single voxels",
        "argmax of a small volume",
        "soft-argmax, depth along axis 0",
    ],
)
def test_the_program_on_the_page_finds_what_this_program_finds(
    tmp_path: Path,
    convention: HeatmapConvention,
    is_averaged: bool,
    depth_axis: int,
    shape: tuple[int, int, int],
) -> None:
    sampling = Sampling.model_validate(
        SAMPLING.model_dump() | {"depth_axis": depth_axis, "is_averaged": is_averaged}
    )
    shift = numpy_helper.from_array(np.array([0.5, -9.0], dtype=np.float32).reshape(1, 2, 1, 1, 1), "shift")
    # The second keypoint is nowhere.
    model = network(
        [convolution("halved"), helper.make_node("Add", ["halved", "shift"], ["heatmaps"])], [shift]
    )
    checkpoint = save_checkpoint(
        tmp_path / "c.onnx",
        changed(DESCRIPTION, sampling=sampling, heatmaps=convention),
        model.SerializeToString(),
    )
    array = np.random.default_rng(2).integers(0, 256, shape, dtype=np.uint8)
    np.save(tmp_path / "v.npy", array)
    (tmp_path / "v.npy.volume.toml").write_text(
        f'schema = "oct-volume/1"\nspacing_um = {list(SPACING_UM)}\ndepth_axis = {depth_axis}\n'
    )
    (tmp_path / "run.py").write_text(block("python"), encoding="utf-8")

    done = subprocess.run(
        [sys.executable, "run.py", "c.onnx", "v.npy", *map(str, SPACING_UM)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == 0, done.stderr
    (first, *numbers), second = (line.split() for line in done.stdout.splitlines())
    with open_volume(tmp_path / "v.npy") as volume:
        predicted = Predictor(checkpoint, Runtime(checkpoint, threads=1)).predict(volume, SPACING_UM)
    assert (first, *second) == ("tip", "shaft", "nowhere")
    np.testing.assert_allclose([float(number) for number in numbers], predicted.positions_um[0], atol=0.1)
    assert np.isnan(predicted.positions_um[1]).all()
