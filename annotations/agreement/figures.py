"""The deviations of one method: each target and each keypoint by the three statistics."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.compared import Compared
from annotations.agreement.deviation import deviations, mean_of_all
from annotations.agreement.intervals import RESAMPLES, estimate
from annotations.agreement.measured import Measured, measured_targets
from annotations.agreement.results import Figures, KeypointDeviation, Statistics
from annotations.geometry.angles import unit_vectors
from annotations.geometry.tool import Link, ToolSpecification

Array = NDArray[np.float64]


def figures(
    compared: Compared, tool: ToolSpecification, *, resamples: int = RESAMPLES, seed: int = 0
) -> Figures:
    """Return the deviations of one method, over the volumes with at least two annotators.

    Parameters
    ----------
    resamples, seed : int
        Of the bootstrap over volumes.
    """

    def statistics(measured: Measured) -> Statistics:
        found = deviations(measured)
        return Statistics(
            published=estimate(found.published, resamples=resamples, seed=seed),
            leave_one_out=estimate(found.leave_one_out, resamples=resamples, seed=seed),
            pairwise=estimate(found.pairwise, resamples=resamples, seed=seed),
        )

    keypoints = {}
    for name in tool.keypoint_names:
        parts = {
            part: statistics(measured) for part, measured in measured_keypoint(compared, tool, name).items()
        }
        keypoints[name] = KeypointDeviation(**parts)
    targets = {name: statistics(measured) for name, measured in measured_targets(compared, tool).items()}
    return Figures(targets=targets, keypoints=keypoints)


def measured_keypoint(compared: Compared, tool: ToolSpecification, name: str) -> Mapping[str, Measured]:
    """Return the positions of one keypoint, and their parts along and across the axis of its link.

    A volume's axis is that from the mean of the link's base, over those who have it, to the mean of its tip.
    All annotators share it, so that for any two of them the squares of what is along and of what is across it
    add up to the square of their distance.

    Returns
    -------
    mapping of str to Measured
        ``distance_um``, and for a keypoint that ends a link ``along_um`` and ``across_um``, which a volume
        has where somebody has the link's other end.
    """
    positions_um = _positions_um(compared, tool, name)
    found = {"distance_um": Measured("distance_um", "distance", positions_um)}
    link = tool.link_of(name)
    if link is not None:
        axes = _axes(compared, tool, link)[:, np.newaxis]
        along_um = (positions_um * axes).sum(axis=-1, keepdims=True)
        found["along_um"] = Measured("along_um", "difference", along_um)
        found["across_um"] = Measured("across_um", "distance", positions_um - along_um * axes)
    return found


def _axes(compared: Compared, tool: ToolSpecification, link: Link) -> Array:
    """Return the unit vector along a link's axis in each volume, (V, 3); NaN where it is not known."""
    base_um, tip_um = (
        mean_of_all(Measured(end, "distance", _positions_um(compared, tool, end)))
        for end in (link.base, link.tip)
    )
    return unit_vectors(tip_um - base_um)


def _positions_um(compared: Compared, tool: ToolSpecification, name: str) -> Array:
    return compared.positions_um[:, :, tool.keypoint_names.index(name)]
