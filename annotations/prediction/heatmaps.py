"""Keypoints as heatmaps, and heatmaps as keypoints with their confidence: what a network's output means."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

Array = NDArray[np.float64]

Decoding = Literal["integral", "argmax", "soft-argmax"]
Target = Literal["distribution", "gaussian", "one-hot"]

_Positive = Annotated[float, Field(gt=0, strict=True, allow_inf_nan=False)]
_Reduction = Annotated[int, Field(gt=0, le=64, strict=True)]
_LEAST_PRESENCE = 0.5
_LEAST_PEAK = 0.1
"""A heatmap of peak 1 that nowhere reaches this shows no keypoint."""
_NEARLY_NEVER = -30.0
"""Logarithm of the share that is taken for none: without it an empty voxel would be minus infinity."""
_HALVINGS = 40


class HeatmapConvention(BaseModel):
    """How keypoints become heatmaps and heatmaps become keypoints; a checkpoint names it.

    Two index frames: the network's padded input, and the heatmap. Heatmap voxel j is centred over the input
    voxels that it covers: ``input = (j + 1/2) · reduction − 1/2``.

    Attributes
    ----------
    reduction : (int, int, int)
        Input voxels that a heatmap voxel covers along axes 0, 1, 2.
    target : str
        What the network learns to give. ``distribution``: logits, whose softmax together with one logit of 0,
        for a keypoint that is nowhere in the input, is a narrow distribution whose mean is the keypoint.
        ``gaussian``: a Gaussian of peak 1. ``one-hot``: one spread over the eight neighbours by trilinear
        interpolation. The last two are 0 everywhere for a keypoint that is nowhere.
    sigma_voxel : (float, float, float)
        Standard deviation of the distribution or Gaussian in heatmap voxels.
    decoding : str
        ``integral``: the mean of the softmax over the heatmap. ``argmax``: the largest value.
        ``soft-argmax``: the mean of the softmax of `temperature` times the heatmap (elsewhere its inverse is
        called a temperature; here, as published with the instrument, a larger one is sharper).
    temperature : float
    shrink : float
        Out-of-view convention. 1: the padding of the input is the margin. Less: labels are shrunk about the
        input's middle by this factor, and the output is stretched back, so that a share of ``1 − shrink`` may
        lie outside (published: 0.8).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    reduction: tuple[_Reduction, _Reduction, _Reduction] = (2, 2, 2)
    target: Target = "distribution"
    sigma_voxel: tuple[_Positive, _Positive, _Positive] = (0.6, 1.8, 2.6)
    decoding: Decoding = "integral"
    temperature: _Positive = 1.0
    shrink: Annotated[float, Field(gt=0, le=1, strict=True)] = 1.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.target == "distribution") != (self.decoding == "integral"):
            raise ValueError("a distribution is decoded by its integral, and nothing else is")
        return self

    def heatmap_shape(self, input_shape: Sequence[int]) -> tuple[int, int, int]:
        """Return the heatmap's voxels for a padded input.

        Raises
        ------
        ValueError
            The input cannot be divided so.
        """
        if any(count % factor for count, factor in zip(input_shape, self.reduction, strict=True)):
            raise ValueError(f"an input of {tuple(input_shape)} voxels cannot be divided by {self.reduction}")
        first, second, third = (
            count // factor for count, factor in zip(input_shape, self.reduction, strict=True)
        )
        return (first, second, third)

    def to_heatmap(self, index_input: ArrayLike, input_shape: Sequence[int]) -> Array:
        """Convert indices of the padded input, shape (..., 3), to indices of the heatmap."""
        middle = (np.asarray(input_shape) - 1) / 2
        shrunk = middle + (np.asarray(index_input, dtype=np.float64) - middle) * self.shrink
        return np.asarray((shrunk + 0.5) / np.asarray(self.reduction) - 0.5)

    def to_input(self, index_heatmap: ArrayLike, input_shape: Sequence[int]) -> Array:
        """Convert indices of the heatmap, shape (..., 3), to indices of the padded input."""
        middle = (np.asarray(input_shape) - 1) / 2
        index = (np.asarray(index_heatmap, dtype=np.float64) + 0.5) * np.asarray(self.reduction) - 0.5
        return np.asarray(middle + (index - middle) / self.shrink)


@dataclass(frozen=True, eq=False)
class AxisProfiles:
    """Targets of n keypoints, as one factor an axis: a heatmap is their outer product.

    Attributes
    ----------
    profiles : tuple of ndarray of float64, shapes (n, h0), (n, h1), (n, h2)
    is_in_range : ndarray of bool, shape (n,)
        Whether the keypoint lies within the heatmap's voxel centres. The profiles of the others are 0.
    """

    profiles: tuple[Array, Array, Array]
    is_in_range: NDArray[np.bool_]


def in_range(index_heatmap: ArrayLike, shape: Sequence[int]) -> NDArray[np.bool_]:
    """Say which places in heatmap voxels, shape (..., 3), lie within the voxel centres of a heatmap's shape.

    A network can tell no others. Of one that is NaN the answer is no.
    """
    index = np.asarray(index_heatmap, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        return np.asarray(((index >= 0) & (index <= np.asarray(shape) - 1.0)).all(axis=-1))


def axis_profiles(
    index_heatmap: ArrayLike, shape: Sequence[int], convention: HeatmapConvention
) -> AxisProfiles:
    """Return what a network is to learn of keypoints.

    Parameters
    ----------
    index_heatmap : array_like, shape (n, 3)
        In heatmap voxels, with their fractions; NaN for a keypoint that has no position.
    shape : (int, int, int)
        The heatmap's.
    convention : HeatmapConvention
    """
    index = np.asarray(index_heatmap, dtype=np.float64)
    is_in_range = in_range(index, shape)
    within = np.where(is_in_range[:, None], index, 0.0)
    first, second, third = (
        _profile(within[:, axis], shape[axis], convention.target, convention.sigma_voxel[axis])
        * is_in_range[:, None]
        for axis in range(3)
    )
    return AxisProfiles((first, second, third), is_in_range)


def encode(index_heatmap: ArrayLike, shape: Sequence[int], convention: HeatmapConvention) -> Array:
    """Return the heatmaps of a network that knows the keypoints, shape (n, *shape): `decode` gives them back.

    Parameters are those of `axis_profiles`.
    """
    targets = axis_profiles(index_heatmap, shape, convention)
    first, second, third = targets.profiles
    values = np.einsum("ni,nj,nk->nijk", first, second, third)
    if convention.target != "distribution":
        return np.asarray(values)
    # Nearly sure that the keypoint is there, or that it is not.
    logits = np.log(np.maximum(values, np.exp(_NEARLY_NEVER))) - _NEARLY_NEVER / 2
    logits[~targets.is_in_range] = _NEARLY_NEVER
    return np.asarray(logits)


@dataclass(frozen=True, eq=False)
class DecodedHeatmaps:
    """Where n keypoints are by a network's heatmaps, and how sure it is.

    Attributes
    ----------
    index_heatmap : ndarray of float64, shape (n, 3)
        In heatmap voxels; NaN where the keypoint is in no place that the heatmap covers.
    peak : ndarray of float64, shape (n,)
        Largest value: the likeliest voxel's probability for ``distribution``, else the heatmap's own value.
    presence : ndarray of float64, shape (n,)
        Probability that the keypoint is within the heatmap for ``distribution``, else the peak, in [0, 1].
    spread_voxel : ndarray of float64, shape (n, 3)
        Standard deviation of the distribution along each axis, in heatmap voxels.
    """

    index_heatmap: Array
    peak: Array
    presence: Array
    spread_voxel: Array


def decode(heatmaps: ArrayLike, convention: HeatmapConvention) -> DecodedHeatmaps:
    """Return the keypoints of heatmaps.

    Parameters
    ----------
    heatmaps : array_like, shape (n, h0, h1, h2)
        A network's output for one volume.
    convention : HeatmapConvention
    """
    values = np.asarray(heatmaps, dtype=np.float32)
    count, shape = len(values), values.shape[1:]
    flat = values.reshape(count, -1)
    largest = flat.max(axis=1)
    weights = _weights(flat, largest, convention)
    marginals = _marginals(weights.reshape(values.shape))
    mass = marginals[0].sum(axis=1)
    safe_mass = np.where(mass > 0, mass, 1.0)[:, None]
    if convention.target == "distribution":
        # Relative to the larger of the largest logit and that of absence, which is 0: nothing overflows.
        logit = largest.astype(np.float64)
        highest, absence = np.exp(np.minimum(logit, 0)), np.exp(-np.maximum(logit, 0))
        presence = mass * highest / (mass * highest + absence)
        peak = highest / (mass * highest + absence)
        is_there = presence >= _LEAST_PRESENCE
    else:
        peak = largest.astype(np.float64)
        presence = np.clip(peak, 0, 1)
        is_there = peak >= _LEAST_PEAK
    mean, spread = np.empty((count, 3)), np.empty((count, 3))
    for axis, marginal in enumerate(marginals):
        share, places = marginal / safe_mass, np.arange(shape[axis])
        mean[:, axis] = share @ places
        spread[:, axis] = np.sqrt(np.maximum(share @ np.square(places) - np.square(mean[:, axis]), 0))
    if convention.decoding == "argmax":
        mean = np.stack(np.unravel_index(flat.argmax(axis=1), shape), axis=1).astype(np.float64)
    mean[~is_there] = np.nan
    return DecodedHeatmaps(mean, peak, presence, spread)


def probabilities(heatmaps: ArrayLike, convention: HeatmapConvention) -> NDArray[np.float32]:
    """Return how likely each keypoint is in each voxel, as `decode` takes it.

    Parameters are those of `decode`.

    Returns
    -------
    ndarray of float32, shape (n, h0, h1, h2)
        Each keypoint's sum to its `DecodedHeatmaps.presence`.
    """
    values = np.asarray(heatmaps, dtype=np.float32)
    flat = values.reshape(len(values), -1)
    weights = _weights(flat, flat.max(axis=1), convention)
    mass = weights.sum(axis=1, dtype=np.float64)
    share = decode(values, convention).presence / np.where(mass > 0, mass, 1.0)
    weights *= share.astype(np.float32)[:, None]
    return weights.reshape(values.shape)


def _weights(
    flat: NDArray[np.float32], largest: NDArray[np.float32], convention: HeatmapConvention
) -> NDArray[np.float32]:
    """Return the distributions that are averaged, up to a factor each, shape (n, voxels), of heatmaps alike.

    An argmax has none of its own; that of the heatmap's upper half tells how wide its peak is.
    """
    if convention.decoding == "argmax":
        return np.asarray(np.maximum(flat - np.maximum(largest, 0)[:, None] / 2, 0))
    weights = flat - largest[:, None]
    weights *= np.float32(convention.temperature if convention.decoding == "soft-argmax" else 1.0)
    np.exp(weights, out=weights)
    return np.asarray(weights)


def _marginals(weights: NDArray[np.float32]) -> tuple[Array, Array, Array]:
    """Return the sums of weights (n, h0, h1, h2) over all axes but one, shapes (n, h0), (n, h1) and (n, h2).

    Over one axis in the weights' own precision, which is fast, and over what is left of them in double.
    """
    over_first, over_last = weights.sum(axis=1), weights.sum(axis=3)
    return (
        over_last.sum(axis=2, dtype=np.float64),
        over_last.sum(axis=1, dtype=np.float64),
        over_first.sum(axis=1, dtype=np.float64),
    )


def _profile(place: Array, count: int, target: Target, sigma: float) -> Array:
    """Return the targets along one axis for places within it, shape (n, count)."""
    steps = np.arange(count) - place[:, None]
    if target == "one-hot":
        return np.asarray(np.maximum(1 - np.abs(steps), 0))
    if target == "gaussian":
        return np.asarray(np.exp(np.square(steps) / (-2 * sigma**2)))
    # Cut off by the border, and summed over whole voxels, a Gaussian about the place has another mean. The
    # one whose mean is the place has a logarithm that differs by a linear term, and the mean grows with it.
    low, high = np.full(len(place), -60.0), np.full(len(place), 60.0)
    for _ in range(_HALVINGS):
        slope = (low + high) / 2
        is_below = (_tilted(steps, sigma, slope) * steps).sum(axis=1) < 0
        low, high = np.where(is_below, slope, low), np.where(is_below, high, slope)
    return _tilted(steps, sigma, (low + high) / 2)


def _tilted(steps: Array, sigma: float, slope: Array) -> Array:
    exponent = np.square(steps) / (-2 * sigma**2) + slope[:, None] * steps
    weights = np.exp(exponent - exponent.max(axis=1, keepdims=True))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
