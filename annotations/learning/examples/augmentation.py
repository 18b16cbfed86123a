"""Examples varied at random, with labels that follow. Needs no torch."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.mirroring import mirrored_um
from annotations.learning.examples.examples import Example, Samples
from annotations.learning.settings.augmentation_settings import AugmentationSettings, Filling
from annotations.volumes.sampling import Sampling

_LOOKED_AT = 1 << 15
"""Samples from which the background is known well enough."""
_WIDEST = 3.0
"""Standard deviations above the median that still are background."""
_SIGMA_OF_DEVIATION = 1.4826
"""The standard deviation of a normal distribution over its median absolute deviation."""


def augmented(
    example: Example, sampling: Sampling, settings: AugmentationSettings, rng: np.random.Generator
) -> Example:
    """Return an example flipped, shifted and occluded at random; the given one stays as it is.

    Keypoints that are shifted out of the network's input are out of range like any others that lie there.

    Parameters
    ----------
    example : Example
    sampling : Sampling
        By which it was sampled.
    settings : AugmentationSettings
    rng : numpy.random.Generator
    """
    axes = settings.flip_axes
    if axes is None:
        axes = tuple(axis for axis in range(3) if axis != sampling.depth_axis)
    for axis in axes:
        if rng.random() < 0.5:
            example = flipped(example, sampling, axis)
    if any(settings.shift_voxels):
        steps = [int(rng.integers(-most, most, endpoint=True)) for most in settings.shift_voxels]
        example = shifted(example, sampling, steps, settings.shift_filling, rng)
    if rng.random() < settings.occlusion_chance:
        block = random_block(example.samples.shape, settings.occlusion_share, rng)
        samples = example.samples.copy()
        samples[block] = _filling(
            example.samples, samples[block].shape, settings.occlusion_filling, sampling, rng
        )
        example = replace(example, samples=samples)
    return example


def flipped(example: Example, sampling: Sampling, axis: int) -> Example:
    """Return an example in a mirror across an array axis, in the middle of its samples.

    A tool that has no mirrored poses (see `has_mirrored_poses`) becomes another tool.
    """
    ends_um = sampling.axis_um(axis, example.spacing_um)[[0, -1]]
    return replace(
        example,
        samples=np.flip(example.samples, axis),
        keypoints_um=mirrored_um(example.keypoints_um, axis, float(ends_um.mean())),
    )


def shifted(
    example: Example,
    sampling: Sampling,
    steps: Sequence[int],
    filling: Filling,
    rng: np.random.Generator,
) -> Example:
    """Return an example moved by whole samples along axes 0, 1, 2; what comes in is filled.

    Parameters
    ----------
    example : Example
    sampling : Sampling
    steps : (int, int, int)
        Samples by which everything moves towards higher indices.
    filling : str
        See `AugmentationSettings`.
    rng : numpy.random.Generator
        For noise.
    """
    before = example.samples
    if filling == "mirror":
        samples = before[
            np.ix_(*(_mirrored_index(n, step) for n, step in zip(before.shape, steps, strict=True)))
        ]
    else:
        samples = _filling(before, before.shape, filling, sampling, rng)
        # Where the samples that stay in view come from and go to.
        places = [(max(0, -step), max(0, step)) for step in steps]
        counts = [max(0, n - abs(step)) for n, step in zip(before.shape, steps, strict=True)]
        source = tuple(slice(first, first + n) for (first, _), n in zip(places, counts, strict=True))
        target = tuple(slice(first, first + n) for (_, first), n in zip(places, counts, strict=True))
        samples[target] = before[source]
    return replace(
        example, samples=samples, keypoints_um=example.keypoints_um + np.multiply(steps, sampling.spacing_um)
    )


def random_block(
    shape: Sequence[int], share: tuple[float, float], rng: np.random.Generator
) -> tuple[slice, ...]:
    """Return a block somewhere in a volume whose edges are between two shares of the volume's."""
    block = []
    for count in shape:
        size = max(1, round(count * rng.uniform(*share)))
        first = int(rng.integers(0, count - size, endpoint=True))
        block.append(slice(first, first + size))
    return tuple(block)


def mixed_samples(
    first: Example, second: Example, alpha: float, rng: np.random.Generator
) -> tuple[Samples, float]:
    """Return two examples' samples laid over each other, and the share λ of the first.

    The mixture has two sets of labels: the loss is λ times that by the labels of the first and 1 − λ times
    that by the labels of the second (H. Zhang et al., *mixup: Beyond empirical risk minimization*, 2018). See
    `HeatmapTargets.weight`.

    Parameters
    ----------
    first, second : Example
        Of one sampling.
    alpha : float
        λ is drawn from the beta distribution (α, α).
    rng : numpy.random.Generator
    """
    share = float(rng.beta(alpha, alpha))
    mixture = first.samples * np.float32(share) + second.samples * np.float32(1 - share)
    return mixture.astype(first.samples.dtype), share


def background(samples: Samples, empty: float, rng: np.random.Generator) -> Samples:
    """Return values of the volume's background, shape (n,), from which noise like it can be drawn.

    Most of a volume shows nothing, so that the median and the median absolute deviation are those of its
    noise, and what is far brighter is none. Empty samples beyond the volume's end are left out.
    """
    values = rng.choice(samples.reshape(-1), size=_LOOKED_AT)
    seen = values[values != empty]
    if not len(seen):
        return values
    levels = seen.astype(np.float32)
    median = np.median(levels)
    deviation = _SIGMA_OF_DEVIATION * np.median(np.abs(levels - median))
    return np.asarray(seen[levels <= median + _WIDEST * deviation])


def _filling(
    samples: Samples, shape: tuple[int, ...], filling: Filling, sampling: Sampling, rng: np.random.Generator
) -> Samples:
    """Return a new array of noise like the samples' own, or of what is scaled to 0."""
    empty = sampling.value_range[0]
    if filling == "noise":
        return np.asarray(rng.choice(background(samples, empty, rng), size=shape))
    return np.full(shape, empty, dtype=samples.dtype)


def _mirrored_index(count: int, step: int) -> NDArray[np.intp]:
    """Return which sample each one shows after a shift between two mirrors at the ends."""
    index = (np.arange(count) - step) % (2 * count)
    return np.asarray(np.where(index < count, index, 2 * count - 1 - index))
