"""A pose target as each annotator of each volume has it, as arrays."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.compared import Compared
from annotations.geometry.targets import target_arrays
from annotations.geometry.tool import ToolSpecification

Metric = Literal["distance", "angle", "difference"]


@dataclass(frozen=True)
class Measured:
    """One target; V volumes, A annotators.

    Attributes
    ----------
    name : str
        With its unit, such as ``position_um``.
    metric : str
        How far two values are apart: ``distance`` of two positions (d = 3), ``angle`` between two unit
        vectors in degrees (d = 3), absolute ``difference`` of two numbers (d = 1).
    values : (V, A, d) array of float64
        NaN where an annotator has none.
    """

    name: str
    metric: Metric
    values: NDArray[np.float64]


def target_metrics(tool: ToolSpecification) -> Mapping[str, Metric]:
    """Return the metric of each of a tool's targets, by name, in the order in which they are shown."""
    metrics: dict[str, Metric] = {}
    if tool.targets.position:
        metrics["position_um"] = "distance"
    if tool.targets.orientation:
        metrics["orientation_deg"] = "angle"
    return metrics | dict.fromkeys((f"{angle.name}_deg" for angle in tool.targets.angles), "difference")


def measured_targets(compared: Compared, tool: ToolSpecification) -> Mapping[str, Measured]:
    """Return the pose targets (`annotations.geometry.targets.pose_targets`) of all documents, by name.

    A target is missing where one of its keypoints does not count, or where a direction has no length.
    """
    arrays = target_arrays(compared.positions_um, tool)
    values = {f"{name}_deg": angles_deg[..., np.newaxis] for name, angles_deg in arrays.angles_deg.items()}
    if arrays.position_um is not None:
        values["position_um"] = arrays.position_um
    if arrays.orientation is not None:
        values["orientation_deg"] = arrays.orientation
    return {name: Measured(name, metric, values[name]) for name, metric in target_metrics(tool).items()}
