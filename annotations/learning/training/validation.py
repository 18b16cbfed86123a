"""How far a network is from the truth, while it learns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from annotations.geometry.targets import target_arrays
from annotations.geometry.tool import ToolSpecification
from annotations.learning.architectures.pose_network import PoseNetwork
from annotations.learning.examples.examples import Example
from annotations.learning.losses.objective import Found, HeatmapObjective, RegressionObjective
from annotations.learning.settings.loss_settings import MM_PER_DEGREE
from annotations.prediction.errors.prediction_errors import far_share, prediction_errors, target_errors

_UM_PER_MM = 1000.0
_MISSED_MM = 10.0


@dataclass(frozen=True, eq=False)
class ValidationErrors:
    """Errors on volumes that the network did not learn from.

    Attributes
    ----------
    targets : mapping of str to ndarray, shape (n,)
        ``position_mm``, ``orientation_deg`` and ``<angle>_deg`` of each volume, by the published formulas;
        NaN where the network, or the truth, lacks the keypoints for one.
    keypoints_mm : ndarray, shape (n, K), or None
        NaN where the truth is unknown, or the keypoint lies beyond the range of the network's input, and it
        says so; infinite where it sees none that is there. None of a network that does not tell keypoints.
    """

    targets: Mapping[str, NDArray[np.float64]]
    keypoints_mm: NDArray[np.float64] | None

    @property
    def volumes(self) -> int:
        """How many there are."""
        return len(next(iter(self.targets.values()))) if self.targets else 0

    @property
    def far_share(self) -> float | None:
        """Share of the keypoints that are more than 2 mm off, or not found; None where there are none."""
        return None if self.keypoints_mm is None else far_share(self.keypoints_mm * _UM_PER_MM)

    @property
    def score(self) -> float:
        """What is to become small: the mean distance of the keypoints in mm, 10 for one that is not found.

        Without keypoints, the sum of the targets' errors, of which a degree counts as 0.1 mm.
        """
        if self.keypoints_mm is not None:
            return float(np.nanmean(np.minimum(self.keypoints_mm, _MISSED_MM)))
        return sum(
            mean * (MM_PER_DEGREE if name.endswith("_deg") else 1.0)
            for name, (mean, _) in self.summary().items()
        )

    def figures(self) -> dict[str, float]:
        """Return means and medians by name, such as ``position_mm_mean``; NaN where nothing was found."""
        figures: dict[str, float] = {}
        for name, values in self.targets.items():
            found = values[~np.isnan(values)]
            figures[f"{name}_mean"] = float(found.mean()) if len(found) else np.nan
            figures[f"{name}_median"] = float(np.median(found)) if len(found) else np.nan
        if self.keypoints_mm is not None:
            known = self.keypoints_mm[~np.isnan(self.keypoints_mm)]
            figures["keypoint_mm_mean"] = self.score
            figures["keypoint_mm_median"] = float(np.median(known))
            figures["share_over_2_mm"] = np.nan if self.far_share is None else self.far_share
        return figures

    def summary(self) -> dict[str, tuple[float, float]]:
        """Return the mean and standard deviation of each target's error, where it is known of any volume.

        The standard deviation is with n − 1, as in tables of errors, and 0 of one volume.
        """
        found = {name: values[~np.isnan(values)] for name, values in self.targets.items()}
        return {
            name: (float(values.mean()), float(values.std(ddof=1)) if len(values) > 1 else 0.0)
            for name, values in found.items()
            if len(values)
        }


def validate(
    network: PoseNetwork,
    objective: HeatmapObjective | RegressionObjective,
    tool: ToolSpecification,
    examples: Sequence[Example],
    batch: int,
) -> ValidationErrors:
    """Let a network, in evaluation mode, say what it sees in examples, and compare."""
    parts = []
    with torch.inference_mode():
        for first in range(0, len(examples), batch):
            some = examples[first : first + batch]
            output = network(objective.inputs([one.samples for one in some]))
            found = objective.found(output, some)
            parts.append(compare(found, np.stack([one.keypoints_um for one in some]), tool))
    distances = [part.keypoints_mm for part in parts if part.keypoints_mm is not None]
    return ValidationErrors(
        {name: np.concatenate([part.targets[name] for part in parts]) for name in parts[0].targets},
        np.concatenate(distances) if distances else None,
    )


def compare(found: Found, true_um: NDArray[np.float64], tool: ToolSpecification) -> ValidationErrors:
    """Return the errors of what was found where the keypoints, (n, K, 3), truly are."""
    targets, _ = target_errors(found.targets, target_arrays(true_um, tool), tool)
    if found.keypoints_um is None:
        return ValidationErrors(targets, None)
    errors = prediction_errors(found.keypoints_um, true_um, tool, found.is_in_range)
    return ValidationErrors(targets, errors.distances_um / _UM_PER_MM)
