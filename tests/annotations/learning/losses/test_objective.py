"""What a network is asked for."""

import numpy as np
import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from torch import Tensor  # noqa: E402

from annotations.errors import UserError  # noqa: E402
from annotations.geometry.targets import target_arrays  # noqa: E402
from annotations.geometry.tool import ToolSpecification  # noqa: E402
from annotations.learning.losses.objective import HeatmapObjective, RegressionObjective, objective_of  # noqa: E402
from tests.annotations.learning.tiny_training import TOOL, examples, tiny_settings  # noqa: E402

CPU = torch.device("cpu")
PLAIN = {"flip_axes": []}


class Inputs:
    """A network that remembers what went in, and always says the same."""

    def __init__(self, output: Tensor) -> None:
        self.output = output

    def __call__(self, inputs: Tensor) -> Tensor:
        self.inputs = inputs
        return self.output


def heatmaps() -> Tensor:
    return torch.randn(2, 6, 8, 16, 16, generator=torch.Generator().manual_seed(2))


def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def test_the_input_is_scaled_and_padded() -> None:
    settings = tiny_settings(augmentation=PLAIN)
    two = examples(2)
    network = Inputs(heatmaps())
    HeatmapObjective(settings, TOOL, CPU).loss(network, two, rng())
    assert network.inputs.shape == (2, 1, 16, 32, 32)
    for given, one in zip(network.inputs, two, strict=True):
        np.testing.assert_array_equal(
            given[0].numpy(), settings.sampling.scaled(one.samples.astype(np.float32))
        )


def test_the_loss_of_a_mixture_is_that_of_both_examples_by_their_shares() -> None:
    two = examples(2)
    plain = HeatmapObjective(tiny_settings(augmentation=PLAIN), TOOL, CPU)
    mixing = HeatmapObjective(tiny_settings(augmentation=PLAIN | {"mixup_alpha": 0.2}), TOOL, CPU)
    network = Inputs(heatmaps())

    mixed, parts = mixing.loss(network, two, rng())

    drawn = rng()
    # Whether a block is hidden is drawn for each of them first.
    drawn.random(2)
    shares = np.array([drawn.beta(0.2, 0.2) for _ in two])
    own, _ = plain.loss_by(heatmaps(), plain.targets(two, shares))
    other, _ = plain.loss_by(heatmaps(), plain.targets(two[::-1], 1 - shares))
    assert mixed.item() == pytest.approx((own + other).item(), rel=1e-6)
    assert parts["coordinate_mm"] > 0
    first = shares[0] * two[0].samples + (1 - shares[0]) * two[1].samples
    inner = network.inputs[0, 0, 1:-1, 1:-1, 1:-1].numpy()
    np.testing.assert_allclose(inner, first / 255, atol=1e-3)


def oblique_tool() -> ToolSpecification:
    fields = TOOL.model_dump(mode="json")
    fields["joints"][0]["hinge_axis"] = (0.0, 0.6, 0.8)
    return ToolSpecification.model_validate(fields)


def test_a_tool_that_is_another_one_in_a_mirror_is_not_flipped() -> None:
    settings, one = tiny_settings(), examples(1)
    for tool, times in ((TOOL, 4), (oblique_tool(), 1)):
        network, draws, seen = Inputs(heatmaps()[:1]), rng(), set()
        objective = HeatmapObjective(settings, tool, CPU)
        for _ in range(60):
            objective.loss(network, one, draws)
            seen.add(network.inputs.numpy().tobytes())
        assert len(seen) == times


def test_flips_that_would_show_another_tool_are_refused() -> None:
    settings = tiny_settings(augmentation={"flip_axes": [1]})
    with pytest.raises(UserError, match="in a mirror 'magnetic-forceps' is another tool") as error:
        objective_of(settings, oblique_tool(), CPU)
    assert error.value.where == "augmentation.flip_axes"
    objective_of(tiny_settings(augmentation=PLAIN), oblique_tool(), CPU)


def test_numbers_say_the_pose_that_they_were_made_of() -> None:
    two = examples(2)
    objective = objective_of(tiny_settings(network={"kind": "resnext3d"}), TOOL, CPU)
    assert isinstance(objective, RegressionObjective)
    scaled = objective.targets(two, np.ones(2)).scaled
    assert scaled.shape == (2, objective.network_settings.outputs)

    found = objective.found(scaled, two)

    true = target_arrays(np.stack([one.keypoints_um for one in two]), TOOL)
    assert found.keypoints_um is None
    np.testing.assert_allclose(found.targets.position_um, true.position_um, atol=0.01)
    np.testing.assert_allclose(found.targets.orientation, true.orientation, atol=1e-5)
    np.testing.assert_allclose(found.targets.angles_deg["theta1"], true.angles_deg["theta1"], atol=1e-3)
    loss, parts = objective.loss_by(scaled, objective.targets(two, np.ones(2)))
    assert (loss.item(), parts) == (0.0, {})
