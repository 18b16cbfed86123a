"""What holds for every network."""

from pathlib import Path

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.learning.architectures.networks import build_network, parameter_count  # noqa: E402
from annotations.learning.architectures.pose_network import PoseNetwork  # noqa: E402
from annotations.learning.settings.network_settings import NETWORK_KINDS, NetworkKind, NetworkSettings  # noqa: E402

torch.set_num_threads(1)

every_kind = pytest.mark.parametrize("kind", NETWORK_KINDS)


def _small_settings(
    kind: NetworkKind, *, width: float = 0.125, dropout: float = 0.0, keypoints: int = 3
) -> NetworkSettings:
    # Sizes that are odd once they have been halved as often as the kind needs.
    shape = {"lean": (32, 96, 64), "v2v": (24, 16, 40), "v2v-regression": (24, 16, 40)}.get(
        kind, (18, 40, 46)
    )
    outputs = 0 if kind in ("lean", "v2v") else 5
    return NetworkSettings(
        kind=kind, keypoints=keypoints, outputs=outputs, input_shape=shape, dropout=dropout, width=width
    )


def _small_network(kind: NetworkKind) -> PoseNetwork:
    """A network whose running statistics are those of its input, as after training."""
    torch.manual_seed(1)
    network = build_network(_small_settings(kind))
    for layer in network.modules():
        if isinstance(layer, torch.nn.BatchNorm3d):
            layer.momentum = None  # the plain mean over all batches
    with torch.no_grad():
        network(_volumes(network, 8))
    return network.eval()


def _volumes(network: PoseNetwork, count: int) -> torch.Tensor:
    generator = torch.Generator().manual_seed(count)
    return torch.rand(count, 1, *network.settings.input_shape, generator=generator)


@every_kind
def test_the_output_has_the_shape_that_the_settings_and_the_reduction_say(kind: NetworkKind) -> None:
    network = _small_network(kind)
    with torch.no_grad():
        output = network(_volumes(network, 2))
    assert output.dtype == torch.float32
    if network.heatmap_reduction is None:
        assert not network.settings.gives_heatmaps
        assert output.shape == (2, 5)
    else:
        assert network.settings.gives_heatmaps
        sizes = [
            size // step
            for size, step in zip(network.settings.input_shape, network.heatmap_reduction, strict=True)
        ]
        assert output.shape == (2, 3, *sizes)


@every_kind
def test_gradients_reach_every_parameter(kind: NetworkKind) -> None:
    torch.manual_seed(2)
    network = build_network(_small_settings(kind))
    output = network(_volumes(network, 2))
    (output * torch.rand_like(output)).sum().backward()
    unreached = [
        name
        for name, parameter in network.named_parameters()
        if parameter.grad is None or not parameter.grad.abs().max() > 0
    ]
    assert unreached == []


@every_kind
def test_every_voxel_group_of_the_input_matters(kind: NetworkKind) -> None:
    network = _small_network(kind)
    volumes = _volumes(network, 1).requires_grad_()
    output = network(volumes)
    (output * torch.rand_like(output)).sum().backward()
    assert volumes.grad is not None
    seen = volumes.grad[0, 0] != 0
    # A border of two voxels may fall between the steps of a kernel.
    for axis in range(3):
        planes = seen.movedim(axis, 0).flatten(1).any(dim=1)
        assert planes[2:-2].all()


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # the other exporter takes ten times as long
@every_kind
def test_an_exported_network_computes_the_same_in_another_runtime(kind: NetworkKind, tmp_path: Path) -> None:
    onnxruntime = pytest.importorskip("onnxruntime")
    network = _small_network(kind)
    volumes = _volumes(network, 1)
    file = tmp_path / "network.onnx"
    torch.onnx.export(
        network,
        (volumes,),
        file,
        dynamo=False,
        opset_version=17,
        input_names=["volume"],
        output_names=["out"],
    )
    session = onnxruntime.InferenceSession(file, providers=["CPUExecutionProvider"])
    (found,) = session.run(["out"], {"volume": volumes.numpy()})
    with torch.no_grad():
        expected = network(volumes)
    assert expected.std() > 1e-5
    assert abs(found - expected.numpy()).max() < 1e-4 * max(1.0, float(expected.abs().max()))


@every_kind
def test_width_scales_the_number_of_parameters(kind: NetworkKind) -> None:
    counts = [
        parameter_count(build_network(_small_settings(kind, width=width))) for width in (0.125, 0.25, 0.5)
    ]
    assert counts[0] < 0.6 * counts[1] < 0.36 * counts[2]


@every_kind
def test_volumes_of_another_shape_are_refused(kind: NetworkKind) -> None:
    network = _small_network(kind)
    volumes = _volumes(network, 1)
    for wrong in (volumes[0], volumes[..., :-1], volumes.repeat(1, 2, 1, 1, 1), volumes.transpose(2, 3)):
        with pytest.raises(ValueError, match="takes volumes of shape"):
            network(wrong)


@every_kind
def test_dropout_acts_in_training_alone(kind: NetworkKind) -> None:
    torch.manual_seed(3)
    network = build_network(_small_settings(kind, dropout=0.5))
    volumes = _volumes(network, 2)
    with torch.no_grad():
        assert not torch.equal(network(volumes), network(volumes))
        network.eval()
        assert torch.equal(network(volumes), network(volumes))


@every_kind
def test_without_dropout_training_is_repeatable(kind: NetworkKind) -> None:
    torch.manual_seed(4)
    network = build_network(_small_settings(kind))
    volumes = _volumes(network, 2)
    with torch.no_grad():
        assert torch.equal(network(volumes), network(volumes))


@every_kind
def test_the_same_seed_gives_the_same_weights(kind: NetworkKind) -> None:
    states = []
    for _ in range(2):
        torch.manual_seed(5)
        states.append(build_network(_small_settings(kind)).state_dict())
    assert states[0].keys() == states[1].keys()
    assert all(torch.equal(states[0][name], states[1][name]) for name in states[0])
