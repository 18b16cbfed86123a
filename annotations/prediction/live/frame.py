"""What a live view shows of one volume: what the network saw, and where it has the tool."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.frames import Vector
from annotations.prediction.prediction import FittedPose, PredictedKeypoint

Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class FrameTimes:
    """How long the stages of one frame took, in seconds.

    Attributes
    ----------
    sampling_s, network_s, decoding_s : float
        See `StageTimes`; opening the volume counts to the sampling.
    fitting_s : float
        From keypoints to the pose of the tool.
    """

    sampling_s: float
    network_s: float
    decoding_s: float
    fitting_s: float


@dataclass(frozen=True, eq=False)
class LiveFrame:
    """A volume as a network saw it, and what it says of it.

    Attributes
    ----------
    volume_path : Path
    keypoints : tuple of PredictedKeypoint
        In the order of the checkpoint.
    pose : FittedPose or None
        None where the keypoints do not tell the direction of any link.
    projections : tuple of three ndarrays of uint8
        The brightest sample along axes 0, 1 and 2, from 0 to 255 as the network takes them for 0 to 1; each
        with the remaining axes in their order.
    origin_um : (float, float, float)
        Centre of the first sample in the volume's frame.
    spacing_um : (float, float, float)
        Between the samples along axes 0, 1, 2.
    depth_axis : int
        Along which the light travels.
    times : FrameTimes
    """

    volume_path: Path
    keypoints: tuple[PredictedKeypoint, ...]
    pose: FittedPose | None
    projections: tuple[Picture, Picture, Picture]
    origin_um: Vector
    spacing_um: Vector
    depth_axis: int
    times: FrameTimes

    @property
    def unseen(self) -> tuple[str, ...]:
        """Names of the keypoints that the network does not see in the volume."""
        return tuple(keypoint.name for keypoint in self.keypoints if keypoint.state != "placed")


def projections_of(samples: NDArray[np.float32], value_range: tuple[float, float]) -> tuple[Any, ...]:
    """Return the brightest sample along each axis, from 0 to 255 within a range of values."""
    low, high = value_range
    pictures = []
    for axis in range(3):
        share = (samples.max(axis=axis) - np.float32(low)) * np.float32(255 / (high - low))
        pictures.append(np.clip(share, 0, 255).astype(np.uint8))
    return tuple(pictures)
