"""How far a network is from the truth, while it learns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from annotations.geometry.angles import angles_deg
from annotations.geometry.targets import target_arrays
from annotations.geometry.tool import ToolSpecification
from annotations.learning.examples import Example
from annotations.learning.objective import HeatmapObjective
from annotations.learning.pose_network import PoseNetwork

FAR_MM = 2.0
"""A keypoint further off than this is a blunder rather than an error."""
_MISSED_MM = 10.0


@dataclass(frozen=True, eq=False)
class ValidationErrors:
    """Errors on volumes that the network did not learn from.

    Attributes
    ----------
    targets : mapping of str to ndarray, shape (n,)
        ``position_mm``, ``orientation_deg`` and ``<angle>_deg`` of each volume; NaN where the network, or the
        truth, lacks the keypoints for one.
    keypoints_mm : ndarray, shape (n, K)
        NaN where the truth is unknown, infinite where the network sees none.
    """

    targets: Mapping[str, NDArray[np.float64]]
    keypoints_mm: NDArray[np.float64]

    @property
    def score(self) -> float:
        """The mean distance of the keypoints in mm; one that was not found counts as 10 mm off."""
        return float(np.nanmean(np.minimum(self.keypoints_mm, _MISSED_MM)))

    @property
    def far_share(self) -> float:
        """Share of the keypoints that are more than 2 mm off, or not found."""
        known = self.keypoints_mm[~np.isnan(self.keypoints_mm)]
        return float((known > FAR_MM).mean())

    def figures(self) -> dict[str, float]:
        """Return means and medians by name, such as ``position_mm_mean``; NaN where nothing was found."""
        figures: dict[str, float] = {}
        for name, values in self.targets.items():
            found = values[~np.isnan(values)]
            figures[f"{name}_mean"] = float(found.mean()) if len(found) else np.nan
            figures[f"{name}_median"] = float(np.median(found)) if len(found) else np.nan
        return figures | {"keypoint_mm_mean": self.score, "share_over_2_mm": self.far_share}

    def summary(self) -> dict[str, tuple[float, float]]:
        """Return the mean and standard deviation of each target's error, where it is known of any volume."""
        found = {name: values[~np.isnan(values)] for name, values in self.targets.items()}
        return {
            name: (float(values.mean()), float(values.std())) for name, values in found.items() if len(values)
        }


def validate(
    network: PoseNetwork,
    objective: HeatmapObjective,
    tool: ToolSpecification,
    examples: Sequence[Example],
    batch: int,
) -> ValidationErrors:
    """Let a network, in evaluation mode, find the keypoints of examples, and compare."""
    found = []
    with torch.inference_mode():
        for first in range(0, len(examples), batch):
            some = examples[first : first + batch]
            found.append(objective.keypoints_um(network(objective.batch(some).inputs), some))
    return compare(np.concatenate(found), np.stack([one.keypoints_um for one in examples]), tool)


def compare(
    found_um: NDArray[np.float64], true_um: NDArray[np.float64], tool: ToolSpecification
) -> ValidationErrors:
    """Return the errors of keypoints of shape (n, K, 3), by the published formulas."""
    found, true = target_arrays(found_um, tool), target_arrays(true_um, tool)
    targets: dict[str, NDArray[np.float64]] = {}
    if found.position_um is not None and true.position_um is not None:
        targets["position_mm"] = np.linalg.norm(found.position_um - true.position_um, axis=-1) / 1000
    if found.orientation is not None and true.orientation is not None:
        targets["orientation_deg"] = angles_deg(found.orientation, true.orientation)
    for name, angle_deg in found.angles_deg.items():
        targets[f"{name}_deg"] = np.abs(angle_deg - true.angles_deg[name])
    distance_mm = np.linalg.norm(found_um - true_um, axis=-1) / 1000
    missed = np.isnan(found_um).any(axis=-1) & ~np.isnan(true_um).any(axis=-1)
    return ValidationErrors(targets, np.where(missed, np.inf, distance_mm))
