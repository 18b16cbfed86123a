"""Examples: what a network sees of a volume, and where the keypoints are. Needs no torch."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from annotations.volumes.spacing import SpacingUm

Samples = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Example:
    """A volume to learn from, or to be judged by.

    Attributes
    ----------
    samples : ndarray of float16 or float32, shape ``sampling.shape``
        In the volume's own values. Half as many bits are enough where these are bytes.
    keypoints_um : ndarray of float64, shape (K, 3)
        In the volume's frame and the tool's order; NaN for those of which nothing is known.
    spacing_um : (float, float, float)
        Of the volume that was sampled.
    """

    samples: Samples
    keypoints_um: NDArray[np.float64]
    spacing_um: SpacingUm


@dataclass(frozen=True, eq=False)
class AnnotatedExamples:
    """The examples of studies.

    Attributes
    ----------
    training, validation : tuple of Example
    studies : tuple of str
        Their titles.
    fingerprint : str
        Of the annotations that they were made from, and their split.
    training_fingerprints, validation_fingerprints : tuple of str
        Of the volumes to train on, and of those held out, each once and in ascending order.
    """

    training: tuple[Example, ...] = ()
    validation: tuple[Example, ...] = ()
    studies: tuple[str, ...] = ()
    fingerprint: str = ""
    training_fingerprints: tuple[str, ...] = ()
    validation_fingerprints: tuple[str, ...] = ()
