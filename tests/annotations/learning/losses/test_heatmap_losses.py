"""What heatmaps are compared with, and how."""

import math

import numpy as np
import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.geometry.kinematics import ToolPose, keypoints_um  # noqa: E402
from annotations.geometry.tool_library import shipped_tools  # noqa: E402
from annotations.learning.losses.heatmap_losses import (  # noqa: E402
    HeatmapTargets,
    cross_entropy,
    decoded_index,
    heatmap_targets,
    heatmap_voxel_mm,
    keypoint_loss,
    soft_argmax,
    squared_error,
    squared_mass,
)
from annotations.learning.losses.pose_losses import PoseLoss  # noqa: E402
from annotations.learning.settings.loss_settings import LossSettings  # noqa: E402
from annotations.prediction.heatmaps import HeatmapConvention, decode, encode  # noqa: E402

torch.set_num_threads(1)

SHAPE = (8, 12, 20)
DISTRIBUTION = HeatmapConvention()
GAUSSIAN = HeatmapConvention(target="gaussian", decoding="soft-argmax", temperature=100.0)
ONE_HOT = HeatmapConvention(target="one-hot", decoding="soft-argmax", temperature=100.0)
CONVENTIONS = (DISTRIBUTION, GAUSSIAN, ONE_HOT)
VOXEL_MM = torch.tensor([1.2, 0.4, 0.25])
ALL = LossSettings(heatmap=0.3, coordinate=1.0, pose=0.5)
FORCEPS = shipped_tools()["magnetic-forceps"]

OUT = (1e3,) * 3
UNKNOWN = (np.nan,) * 3


def random_index(rng: np.random.Generator, count: int = 2, keypoints: int = 6) -> np.ndarray:
    return rng.uniform(0.3, np.array(SHAPE) - 1.3, (count, keypoints, 3))


def encoded(index: np.ndarray, convention: HeatmapConvention) -> "torch.Tensor":
    return torch.tensor(np.stack([encode(one, SHAPE, convention) for one in index]), dtype=torch.float32)


def pose_loss() -> PoseLoss:
    return PoseLoss(FORCEPS, FORCEPS.keypoint_names, 0.1)


# Targets


def test_targets_tell_out_of_range_from_unknown() -> None:
    index = np.array([[(1.0, 2.0, 3.0), (-0.1, 2.0, 3.0), OUT, UNKNOWN]])
    targets = heatmap_targets(index, SHAPE, DISTRIBUTION)
    assert targets.is_in_range.tolist() == [[True, False, False, False]]
    assert targets.is_known.tolist() == [[True, True, True, False]]
    assert targets.weight.tolist() == [1.0]
    assert torch.isfinite(targets.index_heatmap).all()
    for profile, count in zip(targets.profiles, SHAPE, strict=True):
        assert profile.shape == (1, 4, count)
        torch.testing.assert_close(profile.sum(dim=2), torch.tensor([[1.0, 0.0, 0.0, 0.0]]))


def test_a_heatmap_voxel_is_as_large_as_the_labels_are_shrunk() -> None:
    convention = HeatmapConvention(shrink=0.8)
    found = heatmap_voxel_mm(convention, (622.0, 189.0, 131.6))
    shape, ends = (32, 160, 96), np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    apart = np.diff(convention.to_input(ends, shape), axis=0)[0] * (622.0, 189.0, 131.6) / 1000
    torch.testing.assert_close(found, torch.tensor(apart, dtype=torch.float32))


# The soft-argmax


def test_the_soft_argmax_of_two_voxels_is_their_logistic_mean() -> None:
    heatmap = torch.zeros(1, 1, 2, dtype=torch.float32)
    heatmap[0, 0, 1] = 0.7
    for temperature in (0.5, 1.0, 3.0):
        found = soft_argmax(heatmap, temperature)
        torch.testing.assert_close(found, torch.tensor([0.0, 0.0, 1 / (1 + math.exp(-0.7 * temperature))]))


def test_the_soft_argmax_of_separable_exponentials_is_the_mean_of_geometric_series() -> None:
    rates, temperature = (0.3, -0.2, 0.05), 1.5
    grids = torch.meshgrid(*(torch.arange(float(n)) for n in SHAPE), indexing="ij")
    heatmap = sum((rate * grid for rate, grid in zip(rates, grids, strict=True)), torch.zeros(SHAPE))
    found = soft_argmax(heatmap, temperature)
    for axis, (rate, count) in enumerate(zip(rates, SHAPE, strict=True)):
        # The mean of j with weights qʲ, j = 0 … n − 1.
        q = math.exp(rate * temperature)
        expected = q / (1 - q) - count * q**count / (1 - q**count)
        assert found[axis].item() == pytest.approx(expected, abs=1e-5)


def test_the_soft_argmax_of_a_logarithmic_gaussian_is_its_middle() -> None:
    middle = torch.tensor([3.7, 5.2, 9.6])
    grids = torch.stack(torch.meshgrid(*(torch.arange(float(n)) for n in SHAPE), indexing="ij"), dim=-1)
    heatmap = -(grids - middle).square().sum(dim=-1) / 2
    torch.testing.assert_close(soft_argmax(heatmap), middle, atol=1e-3, rtol=0)
    # A temperature narrows it: the standard deviation falls with its root.
    torch.testing.assert_close(soft_argmax(heatmap, 2.0), middle, atol=2e-2, rtol=0)


def test_a_temperature_scales_the_heatmap() -> None:
    heatmaps = torch.randn(2, 3, *SHAPE, generator=torch.Generator().manual_seed(1))
    torch.testing.assert_close(soft_argmax(heatmaps, 7.0), soft_argmax(7.0 * heatmaps))


@pytest.mark.parametrize("temperature", [1.0, 10.0, 100.0, 1000.0])
def test_the_soft_argmax_is_stable_at_every_temperature(temperature: float) -> None:
    heatmaps = 50 * torch.randn(2, 3, *SHAPE, generator=torch.Generator().manual_seed(2))
    heatmaps.requires_grad_()
    found = soft_argmax(heatmaps, temperature)
    assert torch.isfinite(found).all()
    assert (found >= 0).all()
    assert (found <= torch.tensor(SHAPE) - 0.999).all()
    found.square().sum().backward()
    assert heatmaps.grad is not None
    assert torch.isfinite(heatmaps.grad).all()


def test_a_high_temperature_gives_the_argmax_and_a_low_one_the_centre() -> None:
    heatmap = encoded(np.array([[[2.0, 9.0, 15.0]]]), GAUSSIAN)
    torch.testing.assert_close(
        soft_argmax(heatmap, 1000.0)[0, 0], torch.tensor([2.0, 9.0, 15.0]), atol=1e-3, rtol=0
    )
    centre = torch.tensor([(count - 1) / 2 for count in SHAPE])
    torch.testing.assert_close(soft_argmax(heatmap, 1.0)[0, 0], centre, atol=0.5, rtol=0)


@pytest.mark.parametrize(
    "convention",
    [*CONVENTIONS, *(GAUSSIAN.model_copy(update={"temperature": t}) for t in (1.0, 10.0, 1000.0))],
)
def test_it_decodes_as_the_library_does(convention: HeatmapConvention) -> None:
    rng = np.random.default_rng(3)
    heatmaps = encoded(random_index(rng), convention)
    noisy = heatmaps + 0.05 * torch.tensor(rng.standard_normal(heatmaps.shape), dtype=torch.float32)
    for some in (heatmaps, noisy):
        expected = np.stack([decode(one.numpy(), convention).index_heatmap for one in some])
        np.testing.assert_allclose(decoded_index(some, convention).numpy(), expected, atol=1e-4)


def test_an_argmax_cannot_be_learned_through() -> None:
    convention = HeatmapConvention(target="gaussian", decoding="argmax")
    with pytest.raises(ValueError, match="no gradient"):
        decoded_index(torch.zeros(1, 1, *SHAPE), convention)


# Losses of heatmaps


def test_the_cross_entropy_is_that_of_the_softmax_with_one_more_logit() -> None:
    rng = np.random.default_rng(4)
    index = random_index(rng)
    index[0, 1], index[1, 2] = OUT, (-3.0, 1.0, 1.0)
    targets = heatmap_targets(index, SHAPE, DISTRIBUTION)
    logits = torch.tensor(rng.standard_normal((2, 6, *SHAPE)), dtype=torch.float32)
    first, second, third = targets.profiles
    mass = torch.einsum("nki,nkj,nkl->nkijl", first, second, third).flatten(2)
    nowhere = (~targets.is_in_range).float()[..., None]
    shares = torch.log_softmax(torch.cat([logits.flatten(2), torch.zeros(2, 6, 1)], dim=2), dim=2)
    expected = -(shares * torch.cat([mass, nowhere], dim=2)).sum(dim=2)
    torch.testing.assert_close(cross_entropy(logits, targets), expected, atol=1e-4, rtol=1e-5)


def test_the_cross_entropy_is_least_for_the_target_itself() -> None:
    rng = np.random.default_rng(5)
    index = random_index(rng, 1, 3)
    index[0, 2] = OUT
    targets = heatmap_targets(index, SHAPE, DISTRIBUTION)
    sure = encoded(index, DISTRIBUTION).requires_grad_()
    losses = cross_entropy(sure, targets)
    (gradient,) = torch.autograd.grad(losses.sum(), sure)
    # What is missing is the share that a network can never be sure of.
    assert gradient.abs().max() < 1e-5
    assert losses[0, 2].item() == pytest.approx(0, abs=1e-6)
    for factor in (0.9, 1.1):
        assert (cross_entropy(factor * sure, targets)[0, :2] > losses[0, :2]).all()


def test_a_keypoint_out_of_range_pushes_all_logits_down() -> None:
    logits = torch.randn(1, 1, *SHAPE, generator=torch.Generator().manual_seed(6)).requires_grad_()
    targets = heatmap_targets([[OUT]], SHAPE, DISTRIBUTION)
    cross_entropy(logits, targets).sum().backward()
    assert logits.grad is not None
    assert (logits.grad > 0).all()


@pytest.mark.parametrize("scale", [1e4, 1e30])
def test_the_cross_entropy_of_enormous_logits_is_finite(scale: float) -> None:
    logits = (scale * torch.randn(1, 2, *SHAPE, generator=torch.Generator().manual_seed(7))).requires_grad_()
    losses = cross_entropy(logits, heatmap_targets([[(1.5, 2.5, 3.5), OUT]], SHAPE, DISTRIBUTION))
    assert torch.isfinite(losses).all()
    losses.sum().backward()
    assert logits.grad is not None
    assert torch.isfinite(logits.grad).all()


@pytest.mark.parametrize("convention", [GAUSSIAN, ONE_HOT])
def test_the_squared_error_is_about_one_for_a_network_that_sees_nothing(
    convention: HeatmapConvention,
) -> None:
    index = np.random.default_rng(8).uniform(2, np.array(SHAPE) - 3, (50, 6, 3))
    targets = heatmap_targets(index, SHAPE, convention)
    nothing = squared_error(torch.zeros(50, 6, *SHAPE), targets, convention)
    assert nothing.mean().item() == pytest.approx(1, abs=0.1)
    assert squared_error(encoded(index, convention), targets, convention).max() < 1e-9
    voxels = math.prod(SHAPE)
    wanted = encoded(index, convention)
    mean = torch.nn.functional.mse_loss(torch.zeros(50, 6, *SHAPE), wanted)
    assert nothing.mean().item() * squared_mass(convention) / voxels == pytest.approx(mean.item(), rel=1e-5)


def test_distributions_have_no_squared_error() -> None:
    with pytest.raises(ValueError, match="cross-entropy"):
        squared_mass(DISTRIBUTION)


# All together


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_every_part_sends_a_finite_gradient_to_every_known_heatmap(convention: HeatmapConvention) -> None:
    rng = np.random.default_rng(9)
    index = random_index(rng)
    targets = heatmap_targets(index, SHAPE, convention)
    heatmaps = torch.tensor(0.1 * rng.standard_normal((2, 6, *SHAPE)), dtype=torch.float32)
    for settings in (
        LossSettings(heatmap=1.0, coordinate=0.0),
        LossSettings(heatmap=0.0, coordinate=1.0),
        LossSettings(heatmap=0.0, coordinate=0.0, pose=1.0),
    ):
        output = heatmaps.clone().requires_grad_()
        # Links longer than a tenth of the true ones, or they say nothing of their directions.
        shown = output + 0.3 * encoded(index + 0.2, convention).clamp(min=-5.0)
        total, parts = keypoint_loss(shown, targets, settings, convention, VOXEL_MM, pose_loss())
        (gradient,) = torch.autograd.grad(total, output)
        assert torch.isfinite(gradient).all(), settings
        assert (gradient.abs().amax(dim=(2, 3, 4)) > 0).all(), settings
        assert total.item() > 0
        assert not any(part.requires_grad for part in parts.values())


def test_the_total_is_the_weighted_sum_of_the_parts() -> None:
    rng = np.random.default_rng(10)
    index = random_index(rng)
    heatmaps = encoded(index + rng.uniform(-0.3, 0.3, index.shape), DISTRIBUTION)
    targets = heatmap_targets(index, SHAPE, DISTRIBUTION)
    total, parts = keypoint_loss(heatmaps, targets, ALL, DISTRIBUTION, VOXEL_MM, pose_loss())
    assert list(parts) == [
        "heatmap",
        "coordinate_mm",
        "position_mm",
        "orientation_deg",
        "theta1_deg",
        "theta2_deg",
    ]
    degrees = sum(part.item() for name, part in parts.items() if name.endswith("_deg"))
    pose_mm = parts["position_mm"].item() + 0.1 * degrees
    expected = 0.3 * parts["heatmap"].item() + parts["coordinate_mm"].item() + 0.5 * pose_mm
    assert total.item() == pytest.approx(expected, rel=1e-5)


def test_the_coordinate_loss_is_the_distance_in_mm_summed_over_the_axes() -> None:
    index = np.array([[[3.0, 4.0, 5.0], [4.0, 4.0, 5.0]]])
    off = np.array([[[1.0, -2.0, 3.0], [0.0, 0.0, 0.0]]])
    targets = heatmap_targets(index, SHAPE, DISTRIBUTION)
    _, parts = keypoint_loss(
        encoded(index + off, DISTRIBUTION), targets, LossSettings(), DISTRIBUTION, VOXEL_MM
    )
    assert parts["coordinate_mm"].item() == pytest.approx((1.2 + 2 * 0.4 + 3 * 0.25) / 2, abs=1e-4)


def test_what_is_out_of_range_or_unknown_has_no_coordinate_and_what_is_unknown_no_heatmap() -> None:
    index = np.array([[(3.0, 4.0, 5.0), OUT, UNKNOWN]])
    targets = heatmap_targets(index, SHAPE, DISTRIBUTION)
    output = torch.randn(1, 3, *SHAPE, generator=torch.Generator().manual_seed(11)).requires_grad_()
    for settings, learned in (
        (LossSettings(heatmap=0.0), [True, False, False]),
        (LossSettings(coordinate=0.0), [True, True, False]),
    ):
        total, _ = keypoint_loss(output, targets, settings, DISTRIBUTION, VOXEL_MM)
        (gradient,) = torch.autograd.grad(total, output)
        assert (gradient.abs().amax(dim=(2, 3, 4)) > 0).tolist() == [learned]


@pytest.mark.parametrize("nothing", [OUT, UNKNOWN])
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_a_batch_without_any_keypoint_in_range_can_be_learned_from(
    convention: HeatmapConvention, nothing: tuple[float, float, float]
) -> None:
    targets = heatmap_targets([[nothing] * 6] * 2, SHAPE, convention)
    output = torch.zeros(2, 6, *SHAPE).requires_grad_()
    total, parts = keypoint_loss(output, targets, ALL, convention, VOXEL_MM, pose_loss())
    total.backward()
    assert output.grad is not None
    assert torch.isfinite(output.grad).all()
    assert all(part.item() == 0 for name, part in parts.items() if name != "heatmap")


def test_flat_heatmaps_have_finite_gradients_though_all_keypoints_lie_at_one_place() -> None:
    targets = heatmap_targets(random_index(np.random.default_rng(12)), SHAPE, DISTRIBUTION)
    output = torch.zeros(2, 6, *SHAPE).requires_grad_()
    total, parts = keypoint_loss(output, targets, ALL, DISTRIBUTION, VOXEL_MM, pose_loss())
    total.backward()
    assert output.grad is not None
    assert torch.isfinite(output.grad).all()
    assert parts["orientation_deg"].item() == 0


def test_the_loss_of_a_mixture_is_the_mixed_loss() -> None:
    rng = np.random.default_rng(13)
    first, second = random_index(rng), random_index(rng)
    second[0, 3] = OUT
    output = torch.tensor(rng.standard_normal((2, 6, *SHAPE)), dtype=torch.float32)

    def loss(index: np.ndarray, weight: float, some: slice = slice(None)) -> float:
        targets = heatmap_targets(index[some], SHAPE, DISTRIBUTION, weight=[weight] * len(index[some]))
        total, _ = keypoint_loss(output[some], targets, ALL, DISTRIBUTION, VOXEL_MM, pose_loss())
        return total.item()

    assert loss(first, 0.3) + loss(second, 0.7) == pytest.approx(
        0.3 * loss(first, 1.0) + 0.7 * loss(second, 1.0), rel=1e-5
    )
    assert loss(first, 0.3) + loss(first, 0.7) == pytest.approx(loss(first, 1.0), rel=1e-5)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_mixing_the_losses_pulls_heatmaps_towards_the_mixed_heatmap(convention: HeatmapConvention) -> None:
    rng = np.random.default_rng(14)
    first, second = random_index(rng, 1, 2), random_index(rng, 1, 2)
    output = torch.tensor(rng.standard_normal((1, 2, *SHAPE)), dtype=torch.float32).requires_grad_()
    settings, weights = LossSettings(heatmap=1.0, coordinate=0.0), (0.3, 0.7)
    parts = [
        heatmap_targets(index, SHAPE, convention, weight=[weight])
        for index, weight in zip((first, second), weights, strict=True)
    ]
    total = sum(
        (keypoint_loss(output, targets, settings, convention, VOXEL_MM)[0] for targets in parts),
        torch.zeros(()),
    )
    (found,) = torch.autograd.grad(total, output)
    mixed = sum(
        (weight * _outer(targets) for weight, targets in zip(weights, parts, strict=True)), torch.zeros(())
    )
    with torch.no_grad():
        if convention.target == "distribution":
            logits = torch.cat([output.flatten(2), torch.zeros(1, 2, 1)], dim=2)
            expected = (torch.softmax(logits, dim=2)[..., :-1].view_as(output) - mixed) / 2
        else:
            expected = (output - mixed) / squared_mass(convention)
    torch.testing.assert_close(found, expected, atol=1e-5, rtol=1e-4)


def _outer(targets: HeatmapTargets) -> "torch.Tensor":
    first, second, third = targets.profiles
    return torch.einsum("nki,nkj,nkl->nkijl", first, second, third)


@pytest.mark.parametrize(
    ("convention", "settings", "rate"),
    [
        (DISTRIBUTION, LossSettings(), 0.3),
        (GAUSSIAN, LossSettings(heatmap=1.0, coordinate=1.0), 0.05),
        (ONE_HOT, LossSettings(heatmap=1.0, coordinate=0.0), 0.05),
    ],
)
def test_descending_the_loss_finds_the_keypoints(
    convention: HeatmapConvention, settings: LossSettings, rate: float
) -> None:
    index = np.array([[(2.3, 4.6, 12.1), (5.5, 7.2, 3.9)]])
    targets = heatmap_targets(index, SHAPE, convention)
    output = torch.zeros(1, 2, *SHAPE).requires_grad_()
    optimizer = torch.optim.Adam([output], lr=rate)
    for _ in range(150):
        optimizer.zero_grad()
        total, _ = keypoint_loss(output, targets, settings, convention, VOXEL_MM)
        total.backward()
        optimizer.step()
    # A soft-argmax is nearly an argmax, and half a voxel off at most.
    found = decode(output.detach().numpy()[0], convention).index_heatmap
    np.testing.assert_allclose(found, index[0], atol=0.15 if convention.target == "distribution" else 0.55)


def test_a_pose_needs_its_loss() -> None:
    targets = heatmap_targets([[OUT]], SHAPE, DISTRIBUTION)
    with pytest.raises(ValueError, match="no pose loss"):
        keypoint_loss(torch.zeros(1, 1, *SHAPE), targets, ALL, DISTRIBUTION, VOXEL_MM)


def test_half_precision_is_widened_first() -> None:
    positions_um = keypoints_um(ToolPose((8000.0, 12_000.0, 2000.0), (1.0, 0.0, 0.0, 0.0)), FORCEPS)
    index = np.array([list(positions_um.values())]) / 2500
    targets = heatmap_targets(index, SHAPE, DISTRIBUTION)
    output = torch.randn(1, 6, *SHAPE, generator=torch.Generator().manual_seed(15)).to(torch.bfloat16)
    total, _ = keypoint_loss(output, targets, LossSettings(), DISTRIBUTION, VOXEL_MM)
    wide, _ = keypoint_loss(output.float(), targets, LossSettings(), DISTRIBUTION, VOXEL_MM)
    assert total.dtype == torch.float32
    assert total == wide
