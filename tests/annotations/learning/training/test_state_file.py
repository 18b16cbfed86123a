"""Weights in a file of torch's, and the checkpoints that are made of them."""

import os
import pickle
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.learning.architectures.networks import build_network, parameter_count  # noqa: E402
from annotations.learning.architectures.pose_network import PoseNetwork  # noqa: E402
from annotations.learning.conversion import convert_state  # noqa: E402
from annotations.learning.settings.network_settings import NetworkSettings  # noqa: E402
from annotations.learning.training.state_file import StateError, read_state, write_state  # noqa: E402
from annotations.prediction.checkpoint import CheckpointError, load_checkpoint  # noqa: E402
from annotations.prediction.checkpoint_description import CheckpointDescription  # noqa: E402
from tests.annotations.learning.tiny_training import TOOL, tiny_settings  # noqa: E402

torch.set_num_threads(1)

NETWORK = tiny_settings().network_settings(keypoints=6, outputs=0)


class Hostile:
    """Makes a folder when it is unpickled."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.folder),)


def network() -> PoseNetwork:
    torch.manual_seed(3)
    built = build_network(NETWORK)
    # Statistics that a training would have left.
    built.train()(torch.rand(4, 1, *NETWORK.input_shape))
    return built.eval()


def description() -> CheckpointDescription:
    settings = tiny_settings()
    return CheckpointDescription(
        name="tiny",
        network="lean",
        parameters=parameter_count(network()),
        tool=TOOL,
        keypoints=TOOL.keypoint_names,
        sampling=settings.sampling,
        heatmaps=settings.heatmaps,
        created=datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC),
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_state(tmp_path / "best.pt", description(), NETWORK, network().state_dict())
    return tmp_path / "best.pt"


def test_a_network_is_the_same_after_being_written(path: Path) -> None:
    state = read_state(path)
    assert state.description == description()
    assert state.network.settings == NETWORK
    assert not state.network.training
    volume = torch.rand(1, 1, *NETWORK.input_shape)
    assert torch.equal(state.network(volume), network()(volume))


def test_a_checkpoint_computes_what_the_network_does(path: Path, tmp_path: Path) -> None:
    onnxruntime = pytest.importorskip("onnxruntime")
    convert_state(path, tmp_path / "c.onnx")

    checkpoint = load_checkpoint(tmp_path / "c.onnx")

    assert checkpoint.description == description()
    session = onnxruntime.InferenceSession(checkpoint.model, providers=["CPUExecutionProvider"])
    volume = torch.rand(1, 1, *NETWORK.input_shape)
    (heatmaps,) = session.run(None, {session.get_inputs()[0].name: volume.numpy()})
    with torch.no_grad():
        np.testing.assert_allclose(heatmaps, network()(volume).numpy(), atol=1e-4)


@pytest.mark.parametrize("protocol", ["torch", "pickle"])
def test_the_code_in_a_hostile_file_does_not_run(tmp_path: Path, protocol: str) -> None:
    path, made = tmp_path / "hostile.pt", tmp_path / "made"
    content = {"description": "{}", "network": "{}", "weights": Hostile(made)}
    if protocol == "torch":
        torch.save(content, path)
    else:
        path.write_bytes(pickle.dumps(content))

    with pytest.raises(StateError, match="more than tensors and plain values") as error:
        convert_state(path, tmp_path / "c.onnx")

    assert str(path) in str(error.value)
    assert not made.exists()
    assert not (tmp_path / "c.onnx").exists()
    # It would have run, had anybody let it.
    torch.load(path, weights_only=False) if protocol == "torch" else pickle.loads(path.read_bytes())
    assert made.exists()


def rewritten(path: Path, **changes: Any) -> Path:
    content = torch.load(path, weights_only=True) | changes
    torch.save({name: value for name, value in content.items() if value is not None}, path)
    return path


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"weights": None}, "it has no 'weights'"),
        ({"description": None}, "it has no 'description'"),
        ({"weights": [1, 2]}, "its weights are no tensors by name"),
        ({"weights": {"stem": "text"}}, "its weights are no tensors by name"),
        ({"description": "{}"}, "the field 'name' is missing"),
        ({"description": 3}, "JSON"),
        ({"network": "no JSON"}, "Invalid JSON"),
        ({"network": NETWORK.model_copy(update={"keypoints": 4}).model_dump_json()}, "other keypoints"),
        (
            {"network": NetworkSettings(keypoints=6, input_shape=(32, 32, 32)).model_dump_json()},
            "another input",
        ),
        (
            {"network": NETWORK.model_copy(update={"width": 0.5}).model_dump_json()},
            "its weights do not fit a 'lean' network: size mismatch for stem",
        ),
        ({"weights": {}}, "its weights do not fit a 'lean' network: Missing key"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(path: Path, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(StateError) as error:
        read_state(rewritten(path, **changes))
    assert said in str(error.value)
    # What a training has left is not told to be something else.
    assert ("is no network" in str(error.value)) == ("weights do not fit" not in said)
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no archive", b"\x80\x02}q\x00.", bytes(1000)])
def test_what_is_no_state_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.pt"
    path.write_bytes(content)
    with pytest.raises(StateError):
        read_state(path)


def test_a_truncated_state_is_refused(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1000])
    with pytest.raises(StateError, match="damaged"):
        read_state(path)


def test_an_absent_file_is_said_to_be_absent(tmp_path: Path) -> None:
    with pytest.raises(StateError, match="could not be read"):
        read_state(tmp_path / "absent.pt")
    with pytest.raises(StateError, match="could not be read"):
        read_state(tmp_path)


def test_a_network_that_gives_no_heatmaps_makes_no_checkpoint(tmp_path: Path) -> None:
    settings = NetworkSettings(
        kind="resnext3d", keypoints=6, outputs=8, input_shape=NETWORK.input_shape, width=0.125
    )
    weights = build_network(settings).state_dict()
    write_state(tmp_path / "best.pt", description(), settings, weights)
    with pytest.raises(CheckpointError):
        convert_state(tmp_path / "best.pt", tmp_path / "c.onnx")
