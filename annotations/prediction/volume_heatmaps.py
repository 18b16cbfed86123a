"""A network's heatmaps in the frame of the volume that it has seen: to be looked at."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.frames import Vector, vector
from annotations.prediction.checkpoint_description import CheckpointDescription
from annotations.prediction.heatmaps import probabilities
from annotations.volumes import SpacingUm


@dataclass(frozen=True, eq=False)
class VolumeHeatmaps:
    """Where a network takes keypoints to be; K of them.

    Attributes
    ----------
    names : tuple of str
        Of the keypoints, in the order of the checkpoint.
    probability : ndarray of float32, shape (K, h0, h1, h2)
        Of each voxel. Each keypoint's sum to its presence (`DecodedHeatmaps.presence`).
    origin_um : (float, float, float)
        Centre of voxel (0, 0, 0) in the volume's frame; the grid reaches beyond the volume.
    spacing_um : (float, float, float)
        Between voxel centres along axes 0, 1, 2.
    """

    names: tuple[str, ...]
    probability: NDArray[np.float32]
    origin_um: Vector
    spacing_um: Vector


def volume_heatmaps(
    heatmaps: NDArray[np.float32], description: CheckpointDescription, volume_spacing_um: SpacingUm
) -> VolumeHeatmaps:
    """Return a network's output in the frame of a volume.

    Parameters
    ----------
    heatmaps : ndarray of float32, shape (K, h0, h1, h2)
        As the network gives them.
    description : CheckpointDescription
    volume_spacing_um : (float, float, float)
        Of the volume that was sampled.
    """
    sampling, convention = description.sampling, description.heatmaps
    corners = convention.to_input(np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), sampling.padded_shape)
    first_um, second_um = sampling.to_um(corners, volume_spacing_um)
    return VolumeHeatmaps(
        description.keypoints,
        probabilities(heatmaps, convention),
        vector(first_um),
        vector(second_um - first_um),
    )
