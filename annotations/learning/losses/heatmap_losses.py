"""What a network that gives heatmaps should learn of an example, and how far it is from that."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from annotations.learning.losses.pose_losses import PoseLoss
from annotations.learning.losses.weighted_mean import weighted_mean
from annotations.learning.settings.loss_settings import LossSettings
from annotations.prediction.heatmaps import HeatmapConvention, axis_profiles


@dataclass(frozen=True, eq=False)
class HeatmapTargets:
    """What heatmaps should be for n examples with K keypoints each.

    Attributes
    ----------
    profiles : tuple of Tensor of float32, shapes (n, K, h0), (n, K, h1), (n, K, h2)
        One factor an axis, 0 for a keypoint that is out of range. A heatmap is their outer product.
    index_heatmap : Tensor of float32, shape (n, K, 3)
        In heatmap voxels; 0 for a keypoint that is out of range or unknown.
    is_in_range : Tensor of bool, shape (n, K)
        Whether the keypoint lies within the heatmap. Coordinates are learned of these alone.
    is_known : Tensor of bool, shape (n, K)
        Whether anything is known of it. One that is known and not in range is learned to be nowhere; of an
        unknown one nothing is learned.
    weight : Tensor of float32, shape (n,)
        What the example counts. Mixup (Zhang et al. 2018) shows λ a + (1 − λ) b: its loss is λ · loss(a) +
        (1 − λ) · loss(b), the losses of two sets of targets with these weights added. For the cross-entropy
        and, but for a constant, for the squared error that is the loss of the mixed heatmap. Coordinates are
        never mixed: what lies between two keypoints is none.
    """

    profiles: tuple[Tensor, Tensor, Tensor]
    index_heatmap: Tensor
    is_in_range: Tensor
    is_known: Tensor
    weight: Tensor


def heatmap_targets(
    index_heatmap: ArrayLike,
    shape: Sequence[int],
    convention: HeatmapConvention,
    device: torch.device | None = None,
    weight: ArrayLike | None = None,
) -> HeatmapTargets:
    """Return what heatmaps should be.

    Parameters
    ----------
    index_heatmap : array_like, shape (n, K, 3)
        Keypoints in heatmap voxels, wherever they lie. NaN for those of which nothing is known.
    shape : (int, int, int)
        The heatmap's.
    convention : HeatmapConvention
    device : torch.device, optional
        Where the losses are worked out.
    weight : array_like, shape (n,), optional
        Of each example; 1 unless given.
    """
    index = np.asarray(index_heatmap, dtype=np.float64)
    found = axis_profiles(index.reshape(-1, 3), shape, convention)
    is_in_range = found.is_in_range.reshape(index.shape[:2])
    first, second, third = (
        torch.tensor(profile.reshape(*index.shape[:2], -1), dtype=torch.float32, device=device)
        for profile in found.profiles
    )
    return HeatmapTargets(
        (first, second, third),
        torch.tensor(np.where(is_in_range[..., None], index, 0.0), dtype=torch.float32, device=device),
        torch.tensor(is_in_range, device=device),
        torch.tensor(~np.isnan(index).any(axis=-1), device=device),
        torch.tensor(np.ones(len(index)) if weight is None else weight, dtype=torch.float32, device=device),
    )


def heatmap_voxel_mm(
    convention: HeatmapConvention, spacing_um: Sequence[float], device: torch.device | None = None
) -> Tensor:
    """Return the size in mm of a heatmap voxel in the volume, shape (3,), by the spacing of the samples."""
    sizes = np.multiply(spacing_um, convention.reduction) / convention.shrink / 1000
    return torch.tensor(sizes, dtype=torch.float32, device=device)


def soft_argmax(heatmaps: Tensor, temperature: float = 1.0) -> Tensor:
    """Return the mean place of the softmax of `temperature` times each heatmap; it has a gradient.

    Parameters
    ----------
    heatmaps : Tensor, shape (…, h0, h1, h2)
    temperature : float
        A larger one is sharper.

    Returns
    -------
    Tensor of float32, shape (…, 3)
        In heatmap voxels.
    """
    values = heatmaps.float()
    shares = torch.softmax(temperature * values.flatten(-3), dim=-1).view_as(values)
    means = []
    for axis in (-3, -2, -1):
        places = torch.arange(values.shape[axis], dtype=torch.float32, device=values.device)
        others = [other for other in (-3, -2, -1) if other != axis]
        means.append((shares.sum(dim=others) * places).sum(dim=-1))
    return torch.stack(means, dim=-1)


def decoded_index(heatmaps: Tensor, convention: HeatmapConvention) -> Tensor:
    """Return the places that `decode` reads from heatmaps, (…, h0, h1, h2) to (…, 3), sure or not.

    Raises
    ------
    ValueError
        Keypoints are decoded by the argmax, which has no gradient.
    """
    if convention.decoding == "argmax":
        raise ValueError("an argmax has no gradient, so that coordinates cannot be learned through it")
    return soft_argmax(heatmaps, convention.temperature if convention.decoding == "soft-argmax" else 1.0)


def cross_entropy(logits: Tensor, targets: HeatmapTargets) -> Tensor:
    """Return the cross-entropy of each keypoint in nats, shape (n, K), for heatmaps (n, K, h0, h1, h2).

    Of the softmax over all voxels and one logit of 0 for "nowhere", where all the mass of a keypoint that is
    out of range is. Its least value is the entropy of the target: about 5.3 nats by default.
    """
    values = logits.float()
    total = torch.logsumexp(values.flatten(-3), dim=-1)
    # The profiles of an axis add up to 1, or are 0, which is the logit for "nowhere".
    return torch.logaddexp(total, torch.zeros_like(total)) - _expected(values, targets)


def squared_error(heatmaps: Tensor, targets: HeatmapTargets, convention: HeatmapConvention) -> Tensor:
    """Return the squared error of each keypoint's heatmap, shape (n, K), for heatmaps (n, K, h0, h1, h2).

    The sum over the voxels, as a share of the sum over a target's own squares: 1 for a heatmap that is 0
    everywhere, whatever the number of voxels. A mean over the voxels would be that times
    `squared_mass` / voxels, 3e-4 of it or less, and would drown beside a loss in mm.
    """
    first, second, third = targets.profiles
    wanted = first[..., :, None, None] * second[..., None, :, None] * third[..., None, None, :]
    return (heatmaps.float() - wanted).square().sum(dim=(-3, -2, -1)) / squared_mass(convention)


def squared_mass(convention: HeatmapConvention) -> float:
    """Return the sum of a target's squared values, in the mean over where between voxels the keypoint is.

    π^(3/2) σ₀ σ₁ σ₂ for a Gaussian of peak 1. For the one-hot heatmap, ((1 − f)² + f²) in the mean over the
    fraction f is 2/3 an axis. ValueError for distributions, which have no squared error.
    """
    if convention.target == "gaussian":
        return float(math.pi**1.5 * math.prod(convention.sigma_voxel))
    if convention.target == "one-hot":
        return (2 / 3) ** 3
    raise ValueError("distributions are learned by their cross-entropy")


def keypoint_loss(
    heatmaps: Tensor,
    targets: HeatmapTargets,
    settings: LossSettings,
    convention: HeatmapConvention,
    voxel_mm: Tensor,
    pose_loss: PoseLoss | None = None,
) -> tuple[Tensor, dict[str, Tensor]]:
    """Return the loss of a network's heatmaps, and its parts.

    Parameters
    ----------
    heatmaps : Tensor, shape (n, K, h0, h1, h2)
        A network's output.
    targets : HeatmapTargets
    settings : LossSettings
    convention : HeatmapConvention
    voxel_mm : Tensor, shape (3,)
        Size of a heatmap voxel; see `heatmap_voxel_mm`.
    pose_loss : PoseLoss, optional
        Needed where the settings give it a weight.

    Returns
    -------
    total : Tensor, shape ()
    parts : dict of str to Tensor, shape ()
        Before weighting and without gradients: ``heatmap``, ``coordinate_mm``, and those of the pose. What
        has no weight is left out.

    Raises
    ------
    ValueError
        The settings ask for coordinates or poses, and keypoints are decoded by the argmax; or there is no
        pose loss.
    """
    total = heatmaps.new_zeros((), dtype=torch.float32)
    parts: dict[str, Tensor] = {}
    if settings.heatmap:
        losses = (
            cross_entropy(heatmaps, targets)
            if convention.target == "distribution"
            else squared_error(heatmaps, targets, convention)
        )
        parts["heatmap"] = weighted_mean(losses, targets.is_known, targets.weight)
        total = total + settings.heatmap * parts["heatmap"]
    if settings.needs_coordinates:
        found_mm = decoded_index(heatmaps, convention) * voxel_mm
        true_mm = targets.index_heatmap * voxel_mm
        if settings.coordinate:
            losses = (found_mm - true_mm).abs().sum(dim=-1)
            parts["coordinate_mm"] = weighted_mean(losses, targets.is_in_range, targets.weight)
            total = total + settings.coordinate * parts["coordinate_mm"]
        if settings.pose:
            if pose_loss is None:
                raise ValueError("the pose has a weight, and there is no pose loss")
            pose_mm, pose_parts = pose_loss(found_mm, true_mm, targets.is_in_range, targets.weight)
            parts |= pose_parts
            total = total + settings.pose * pose_mm
    return total, {name: part.detach() for name, part in parts.items()}


def _expected(values: Tensor, targets: HeatmapTargets) -> Tensor:
    """Return the mean of values (n, K, h0, h1, h2) over the targets, shape (n, K), axis by axis."""
    first, second, third = targets.profiles
    means = (values @ third[..., None, :, None]).squeeze(-1)
    means = (means @ second[..., None]).squeeze(-1)
    return (means * first).sum(dim=-1)
