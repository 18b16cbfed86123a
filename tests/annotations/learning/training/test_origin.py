"""The network with whose weights a training begins."""

from pathlib import Path
from typing import Any

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.documents.record import changed  # noqa: E402
from annotations.errors import UserError  # noqa: E402
from annotations.geometry.tool_library import shipped_tools  # noqa: E402
from annotations.learning.architectures.networks import build_network  # noqa: E402
from annotations.learning.architectures.pose_network import PoseNetwork  # noqa: E402
from annotations.learning.conversion import convert_state  # noqa: E402
from annotations.learning.training.origin import Origin, read_origin  # noqa: E402
from annotations.learning.training.state_file import StateError, write_state  # noqa: E402
from annotations.prediction.checkpoint import CheckpointError, load_checkpoint  # noqa: E402
from annotations.prediction.checkpoint_description import CheckpointDescription, TrainingSummary  # noqa: E402
from tests.annotations.learning.tiny_training import TOOL, tiny_settings  # noqa: E402
from tests.annotations.prediction.known_keypoints import described, heatmaps_of, save_knowing  # noqa: E402

torch.set_num_threads(1)

SETTINGS = tiny_settings()
NETWORK = SETTINGS.network_settings(keypoints=6, outputs=0)


def network(seed: int = 3) -> PoseNetwork:
    torch.manual_seed(seed)
    built = build_network(NETWORK)
    # Statistics that a training would have left.
    built.train()(torch.rand(4, 1, *NETWORK.input_shape))
    return built.eval()


def description(**changes: Any) -> CheckpointDescription:
    fitting = described(SETTINGS.sampling, SETTINGS.heatmaps, name="earlier")
    return changed(fitting, network="lean", **changes)


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    write_state(tmp_path / "best.pt", description(), NETWORK, network().state_dict())
    return tmp_path / "best.pt"


def origin_of(path: Path, **changes: Any) -> Origin:
    """Return what is read of a training's weights whose description has other fields."""
    write_state(path, description(**changes), NETWORK, network().state_dict())
    return read_origin(path)


def test_a_network_gets_the_weights_that_a_training_left(weights: Path) -> None:
    filled = network(seed=4)
    read_origin(weights).fill(filled)
    for name, value in network().state_dict().items():
        assert torch.equal(filled.state_dict()[name], value)


@pytest.mark.parametrize(("half", "furthest"), [(False, 0.0), (True, 1e-3)])
def test_a_checkpoint_has_the_weights_of_its_training(
    weights: Path, tmp_path: Path, half: bool, furthest: float
) -> None:
    convert_state(weights, tmp_path / "c.onnx", half=half)
    filled = network(seed=4)

    origin = read_origin(tmp_path / "c.onnx")
    origin.fill(filled)

    for name, value in network().named_parameters():
        # Eleven bits of a number that is no larger than 4.
        assert (dict(filled.named_parameters())[name] - value).abs().max() <= 4 * furthest
    statistics = {name: value for name, value in network().named_buffers() if "running" in name}
    assert statistics
    for name, value in statistics.items():
        assert torch.equal(dict(filled.named_buffers())[name], value)
    assert (origin.sha256, origin.summary.name) == (load_checkpoint(origin.path).sha256, "earlier")


def test_the_checkpoint_that_ships_can_be_gone_on_with() -> None:
    origin = read_origin(Path("magnetic-forceps"))
    settings = tiny_settings(network={"width": 1.0}, heatmaps={"sigma_voxel": [0.6, 1.8, 2.6]})
    said: list[str] = []

    origin.check(settings, TOOL)
    origin.fill(build_network(settings.network_settings(keypoints=6, outputs=0)))
    origin.say_differences(settings, TOOL, said.append)

    assert any(
        line.startswith("the weights were learned with sampling.shape = (28, 139, 83)") for line in said
    )
    assert not any("tool" in line for line in said)


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"network": {"kind": "v2v"}}, "network.kind = 'lean'"),
        ({"heatmaps": {"target": "gaussian", "decoding": "soft-argmax"}}, "heatmaps.target = 'distribution'"),
        ({"validation": {"seed": 77}}, "Say another"),
    ],
)
def test_settings_that_do_not_fit_are_refused_with_what_to_say(
    tmp_path: Path, settings: dict[str, Any], field: str
) -> None:
    learned = TrainingSummary(settings=tiny_settings(synthetic={"seed": 77}).as_toml())
    origin = origin_of(tmp_path / "best.pt", training=learned)
    origin.check(SETTINGS, TOOL)
    with pytest.raises(UserError) as error:
        origin.check(tiny_settings(**settings), TOOL)
    assert field in error.value.remedy


def test_another_tools_keypoints_are_refused(weights: Path) -> None:
    with pytest.raises(
        UserError, match=r"finds the keypoints k0, k1, .* and 'needle' has tip, shaft"
    ) as error:
        read_origin(weights).check(SETTINGS, shipped_tools()["needle"])
    assert error.value.where == weights


def test_other_measures_of_a_tool_are_taken_and_said(weights: Path) -> None:
    said: list[str] = []
    calibrated = TOOL.model_copy(update={"title": "Calibrated"})
    origin = read_origin(weights)
    origin.check(SETTINGS, calibrated)
    origin.say_differences(SETTINGS, calibrated, said.append)
    assert said == ["the weights were learned for another version of the tool 'magnetic-forceps'"]


def test_a_network_of_another_width_is_refused(weights: Path) -> None:
    wider = build_network(tiny_settings(network={"width": 0.5}).network_settings(keypoints=6, outputs=0))
    with pytest.raises(UserError, match="its network has another size: 'stem") as error:
        read_origin(weights).fill(wider)
    assert "network.width" in error.value.remedy


def test_a_checkpoint_of_another_program_is_refused(tmp_path: Path) -> None:
    other = description()
    spacing_um = other.sampling.spacing_um
    save_knowing(tmp_path / "c.onnx", other, heatmaps_of(other, {}, spacing_um))
    with pytest.raises(UserError, match="does not name its weights as a 'lean' network") as error:
        read_origin(tmp_path / "c.onnx").fill(network())
    assert "best.pt" in error.value.remedy


def test_what_is_no_network_is_refused(tmp_path: Path) -> None:
    torch.save({"version": "oct-training/2"}, tmp_path / "state.pt")
    with pytest.raises(StateError, match="no network of this program") as error:
        read_origin(tmp_path / "state.pt")
    assert "best.pt" in error.value.remedy
    with pytest.raises(CheckpointError, match="could not be read"):
        read_origin(tmp_path / "nowhere" / "forceps")
