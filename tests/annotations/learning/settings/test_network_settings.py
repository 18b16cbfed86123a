"""What a network is built from."""

import subprocess
import sys

import pytest
from pydantic import ValidationError

from annotations.learning.settings.network_settings import (
    NETWORK_KINDS,
    NetworkKind,
    NetworkSettings,
    scaled_channels,
)


def test_the_lean_network_is_the_default() -> None:
    assert NetworkSettings(keypoints=6, input_shape=(32, 160, 96)).kind == "lean"


@pytest.mark.parametrize("kind", NETWORK_KINDS)
def test_every_kind_takes_the_shape_that_it_is_meant_for(kind: NetworkKind) -> None:
    shape = (32, 160, 96) if kind == "lean" else (32, 144, 88)
    heatmaps = kind in ("lean", "v2v")
    settings = NetworkSettings(kind=kind, keypoints=6, outputs=0 if heatmaps else 8, input_shape=shape)
    assert settings.gives_heatmaps == heatmaps


def test_a_shape_that_cannot_be_halved_often_enough_is_refused_with_one_that_can() -> None:
    with pytest.raises(ValidationError, match=r"not \(28, 139, 83\); pad them to \(32, 160, 96\)"):
        NetworkSettings(keypoints=6, input_shape=(28, 139, 83))
    with pytest.raises(ValidationError, match=r"pad them to \(32, 144, 88\)"):
        NetworkSettings(kind="v2v", keypoints=6, input_shape=(28, 139, 83))


def test_a_shape_that_is_too_small_is_refused() -> None:
    with pytest.raises(ValidationError, match="at least"):
        NetworkSettings(kind="resnext3d", keypoints=6, outputs=8, input_shape=(8, 144, 88))


@pytest.mark.parametrize(
    ("kind", "outputs"), [("lean", 8), ("v2v", 1), ("v2v-regression", 0), ("resnext3d", 0)]
)
def test_outputs_that_the_kind_does_not_give_are_refused(kind: NetworkKind, outputs: int) -> None:
    with pytest.raises(ValidationError, match="outputs must be"):
        NetworkSettings(kind=kind, keypoints=6, outputs=outputs, input_shape=(32, 160, 96))


@pytest.mark.parametrize(
    "changes",
    [
        {"kind": "v3v"},
        {"keypoints": 0},
        {"dropout": 1.0},
        {"dropout": float("nan")},
        {"width": 0.0},
        {"input_shape": (0, 160, 96)},
        {"input_shape": (160, 96)},
        {"depth": 3},
    ],
)
def test_settings_that_make_no_network_are_refused(changes: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        NetworkSettings.model_validate({"keypoints": 6, "input_shape": (32, 160, 96)} | changes)


def test_settings_survive_being_written_as_json() -> None:
    settings = NetworkSettings(kind="v2v", keypoints=6, input_shape=(32, 144, 88), dropout=0.05, width=0.5)
    assert NetworkSettings.model_validate_json(settings.model_dump_json()) == settings


def test_channels_are_scaled_down_to_one() -> None:
    assert [scaled_channels(32, width) for width in (0.001, 0.25, 1.0, 1.5)] == [1, 8, 32, 48]


def test_settings_need_no_torch() -> None:
    code = "import sys; sys.modules['torch'] = None; import annotations.learning.settings.network_settings"
    subprocess.run([sys.executable, "-c", code], check=True)
