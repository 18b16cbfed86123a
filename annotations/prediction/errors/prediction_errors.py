"""How far predicted keypoints are from the truth, by the formulas that were published with the instrument.

Position: Euclidean distance, here in mm as in the published tables. Orientation: angle between the two
directions, in degrees. A joint's angle: absolute difference of the unsigned angles, in degrees. A keypoint:
Euclidean distance in µm. Tables give mean ± standard deviation over volumes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.deviation import distances
from annotations.agreement.measured import target_metrics
from annotations.documents.record import Record
from annotations.geometry.angles import lengths
from annotations.geometry.frames import Vector
from annotations.geometry.targets import TargetArrays, target_arrays
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]

FAR_UM = 2000.0
"""A keypoint further off than this is not near its place at all."""

_UM_PER_MM = 1000.0


@dataclass(frozen=True, eq=False)
class PredictionErrors:
    """Errors of V volumes; K keypoints.

    Attributes
    ----------
    targets : mapping of str to ndarray of float64, shape (V,)
        By ``position_mm``, ``orientation_deg`` and ``<angle>_deg``; those that the tool lacks are absent. NaN
        where the prediction or the truth lacks a keypoint that the target is made of.
    targets_missing : mapping of str to ndarray of bool, shape (V,)
        Where the truth has the target and the prediction has not.
    keypoints_um : ndarray of float64, shape (V, K)
        In the tool's order; NaN where the prediction or the truth lacks the keypoint.
    keypoints_missing : ndarray of bool, shape (V, K)
        Where the truth has the keypoint and the prediction has not, though it should.
    keypoints_rightly_absent : ndarray of bool, shape (V, K)
        Where neither has it within the range of the network's input, and the truth has it beyond. The targets
        that are made of it are missing all the same.
    """

    targets: Mapping[str, Array]
    targets_missing: Mapping[str, NDArray[np.bool_]]
    keypoints_um: Array
    keypoints_missing: NDArray[np.bool_]
    keypoints_rightly_absent: NDArray[np.bool_]

    @property
    def distances_um(self) -> Array:
        """Distances of the keypoints, shape (V, K): infinite where missing, and NaN where none is wanted."""
        return np.where(self.keypoints_missing, np.inf, self.keypoints_um)

    def of_volumes(self, is_chosen: NDArray[np.bool_]) -> "PredictionErrors":
        """Return the errors of some of the volumes: an array of bool, shape (V,), says of which."""
        return PredictionErrors(
            {name: errors[is_chosen] for name, errors in self.targets.items()},
            {name: is_missing[is_chosen] for name, is_missing in self.targets_missing.items()},
            self.keypoints_um[is_chosen],
            self.keypoints_missing[is_chosen],
            self.keypoints_rightly_absent[is_chosen],
        )


class ErrorFigures(Record):
    """Errors of one kind over volumes, in the unit that the name of what they are errors of ends with.

    Attributes
    ----------
    mean, sd, median, p95 : float or None
        None where there is none; ``sd`` with n − 1, and None for one volume.
    n : int
        Over how many.
    missing : int
        How many the truth has besides, and the prediction has not.
    """

    mean: float | None = None
    sd: float | None = None
    median: float | None = None
    p95: float | None = None
    n: int = 0
    missing: int = 0


class ErrorOverview(Record):
    """The errors of a checkpoint over volumes.

    Attributes
    ----------
    targets : mapping of str to ErrorFigures
        By ``position_mm``, ``orientation_deg`` and ``<angle>_deg``.
    keypoints_um : mapping of str to ErrorFigures
        In the tool's order.
    all_keypoints_um : ErrorFigures
        All of them together.
    far_share : float or None
        Of the keypoints that the truth has, which share is more than 2 mm off, or missing.
    """

    targets: Mapping[str, ErrorFigures] = {}
    keypoints_um: Mapping[str, ErrorFigures] = {}
    all_keypoints_um: ErrorFigures = ErrorFigures()
    far_share: float | None = None


def positions_array_um(positions_um: Sequence[Mapping[str, Vector]], tool: ToolSpecification) -> Array:
    """Return positions in µm by name, of V volumes, as one array of shape (V, K, 3) in the tool's order."""
    absent = (np.nan,) * 3
    rows = [[of_volume.get(name, absent) for name in tool.keypoint_names] for of_volume in positions_um]
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(tool.keypoint_names), 3)


def prediction_errors(
    predicted_um: Array,
    true_um: Array,
    tool: ToolSpecification,
    is_in_range: NDArray[np.bool_] | None = None,
) -> PredictionErrors:
    """Return the errors of predicted keypoints against the truth.

    Parameters
    ----------
    predicted_um, true_um : ndarray of float64, shape (V, K, 3)
        In µm and the tool's order of keypoints; NaN for those that have no position.
    is_in_range : ndarray of bool, shape (V, K), optional
        Whether the true place is one that the network can tell; by default all are.
    """
    is_absent = _is_missing(predicted_um, true_um)
    is_wanted = np.ones_like(is_absent) if is_in_range is None else is_in_range
    targets, missing = target_errors(target_arrays(predicted_um, tool), target_arrays(true_um, tool), tool)
    return PredictionErrors(
        targets,
        missing,
        lengths(predicted_um - true_um),
        is_absent & is_wanted,
        is_absent & ~is_wanted,
    )


def target_errors(
    predicted: TargetArrays, true: TargetArrays, tool: ToolSpecification
) -> tuple[dict[str, Array], dict[str, NDArray[np.bool_]]]:
    """Return the errors of predicted pose targets of V volumes, and where they are missing.

    Both by the names, and as the arrays, of `PredictionErrors`.
    """
    targets: dict[str, Array] = {}
    missing: dict[str, NDArray[np.bool_]] = {}
    for name, metric in target_metrics(tool).items():
        values, truths = _values(predicted, name), _values(true, name)
        shown, unit = shown_target(name)
        targets[shown] = distances(values, truths, metric) / unit
        missing[shown] = _is_missing(values, truths)
    return targets, missing


def shown_target(name: str) -> tuple[str, float]:
    """Return how tables of predictions call a target, and what they divide it by: positions are in mm."""
    return ("position_mm", _UM_PER_MM) if name == "position_um" else (name, 1.0)


def summarise(errors: PredictionErrors, tool: ToolSpecification) -> ErrorOverview:
    """Return the figures over volumes."""
    return ErrorOverview(
        targets={
            name: error_figures(values, errors.targets_missing[name])
            for name, values in errors.targets.items()
        },
        keypoints_um={
            name: error_figures(errors.keypoints_um[:, place], errors.keypoints_missing[:, place])
            for place, name in enumerate(tool.keypoint_names)
        },
        all_keypoints_um=error_figures(errors.keypoints_um, errors.keypoints_missing),
        far_share=far_share(errors.distances_um),
    )


def far_share(distances_um: Array) -> float | None:
    """Return which share of keypoints is more than 2 mm off.

    Parameters
    ----------
    distances_um : ndarray of float64
        Infinite for a keypoint that was not found, which is far, and NaN for one that does not count.

    Returns
    -------
    float or None
        None where none counts.
    """
    known_um = distances_um[~np.isnan(distances_um)]
    return float(np.mean(known_um > FAR_UM)) if known_um.size else None


def error_figures(values: Array, missing: NDArray[np.bool_]) -> ErrorFigures:
    """Return the figures of errors, NaN for none, of which some are missing."""
    known = values[np.isfinite(values)]
    count = int(missing.sum())
    if not known.size:
        return ErrorFigures(missing=count)
    return ErrorFigures(
        mean=float(known.mean()),
        sd=float(known.std(ddof=1)) if known.size > 1 else None,
        median=float(np.median(known)),
        p95=float(np.percentile(known, 95)),
        n=known.size,
        missing=count,
    )


def _is_missing(predicted: Array, true: Array) -> NDArray[np.bool_]:
    is_missing: NDArray[np.bool_] = np.isnan(predicted[..., 0]) & np.isfinite(true[..., 0])
    return is_missing


def _values(targets: TargetArrays, name: str) -> Array:
    """Return a target of V volumes as vectors, shape (V, 3) or (V, 1)."""
    if name == "position_um" and targets.position_um is not None:
        return targets.position_um
    if name == "orientation_deg" and targets.orientation is not None:
        return targets.orientation
    return targets.angles_deg[name.removesuffix("_deg")][..., np.newaxis]
