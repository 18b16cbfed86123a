"""From a volume to predicted keypoints, by any network that a checkpoint describes."""

import time
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.frames import Vector, vector
from annotations.prediction.checkpoint import Checkpoint
from annotations.prediction.heatmaps import decode
from annotations.prediction.volume_heatmaps import VolumeHeatmaps, volume_heatmaps
from annotations.volumes import SpacingUm, Volume
from annotations.volumes.sampling import sample_volume

Array = NDArray[np.float64]


class HeatmapSource(Protocol):
    """What runs a network: `annotations.prediction.runtime.Runtime`, or a stand-in."""

    def heatmaps(self, padded_input: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the heatmaps, shape (K, h0, h1, h2) and finite, of an input of the padded shape."""


@dataclass(frozen=True)
class StageTimes:
    """How long the stages of one prediction took, in seconds; 0 for one that was not needed.

    Attributes
    ----------
    sampling_s : float
        Reading the voxels that the network needs, and averaging them.
    network_s : float
        Scaling and padding, and the network.
    decoding_s : float
        From heatmaps to micrometres.
    """

    sampling_s: float
    network_s: float
    decoding_s: float


@dataclass(frozen=True, eq=False)
class PredictedKeypoints:
    """What a network says of one volume; K keypoints.

    Attributes
    ----------
    names : tuple of str
        In the order of the checkpoint.
    positions_um : ndarray of float64, shape (K, 3)
        In the volume's frame; some lie outside of the volume. NaN for a keypoint beyond the range of the
        network's input, or that it does not see.
    presence : ndarray of float64, shape (K,)
        How sure the network is that the keypoint is within its range, 0 to 1.
    peak : ndarray of float64, shape (K,)
        Of the heatmap, see `DecodedHeatmaps`.
    spread_um : ndarray of float64, shape (K, 3)
        Standard deviation of the heatmap along each axis, which has the width that the network was taught
        even where it is sure.
    times : StageTimes
    """

    names: tuple[str, ...]
    positions_um: Array
    presence: Array
    peak: Array
    spread_um: Array
    times: StageTimes

    @property
    def by_name(self) -> dict[str, Vector]:
        """The positions in µm of the keypoints that have one."""
        return {
            name: vector(position_um)
            for name, position_um in zip(self.names, self.positions_um, strict=True)
            if np.isfinite(position_um).all()
        }


class Predictor:
    """A checkpoint at work.

    Parameters
    ----------
    checkpoint : Checkpoint
        Says what input the network wants, and what its output means.
    network : HeatmapSource
        Runs it.
    """

    def __init__(self, checkpoint: Checkpoint, network: HeatmapSource) -> None:
        self.checkpoint = checkpoint
        self._network = network

    def predict(self, volume: Volume, spacing_um: SpacingUm) -> PredictedKeypoints:
        """Return the keypoints in a volume, a full one or a real-time one.

        Parameters
        ----------
        volume : Volume
        spacing_um : (float, float, float)
            Of its voxels along axes 0, 1, 2.

        Raises
        ------
        VolumeError
            The volume cannot be read, or is none of those that the network was trained on; see
            `sample_volume`.
        CheckpointError
            The network failed.
        """
        begun_s = time.perf_counter()
        samples = sample_volume(volume, spacing_um, self.checkpoint.description.sampling)
        return self._predicted(samples, spacing_um, time.perf_counter() - begun_s)

    def predict_samples(
        self, samples: NDArray[np.float32], volume_spacing_um: SpacingUm
    ) -> PredictedKeypoints:
        """Return the keypoints in what `sample_volume` gives of a volume.

        Parameters
        ----------
        samples : ndarray of float32, shape ``sampling.shape``
            In the volume's own values.
        volume_spacing_um : (float, float, float)
            Of the volume that was sampled.

        Raises
        ------
        CheckpointError
            The network failed.
        """
        return self._predicted(samples, volume_spacing_um, 0.0)

    def heatmaps(self, volume: Volume, spacing_um: SpacingUm) -> VolumeHeatmaps:
        """Return where in a volume the network takes each keypoint to be, as a cloud.

        Parameters and errors are those of `predict`.
        """
        description = self.checkpoint.description
        samples = sample_volume(volume, spacing_um, description.sampling)
        given = self._network.heatmaps(description.sampling.scaled(samples))
        return volume_heatmaps(given, description, spacing_um)

    def _predicted(
        self, samples: NDArray[np.float32], volume_spacing_um: SpacingUm, sampling_s: float
    ) -> PredictedKeypoints:
        description = self.checkpoint.description
        sampling, convention = description.sampling, description.heatmaps
        begun_s = time.perf_counter()
        heatmaps = self._network.heatmaps(sampling.scaled(samples))
        given_s = time.perf_counter()
        decoded = decode(heatmaps, convention)
        index_input = convention.to_input(decoded.index_heatmap, sampling.padded_shape)
        voxel_um = np.multiply(convention.reduction, sampling.spacing_um) / convention.shrink
        return PredictedKeypoints(
            description.keypoints,
            sampling.to_um(index_input, volume_spacing_um),
            decoded.presence,
            decoded.peak,
            decoded.spread_voxel * voxel_um,
            StageTimes(sampling_s, given_s - begun_s, time.perf_counter() - given_s),
        )
