"""The volumes that the annotators disagree on, the worst first, and why."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.compared import Compared
from annotations.agreement.results import TurnedBox, VolumeResult
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]


def volume_results(
    compared: Compared,
    tool: ToolSpecification,
    published: Mapping[str, Array],
    turned: Sequence[TurnedBox] = (),
) -> tuple[VolumeResult, ...]:
    """Return each volume with at least two annotators, the worst first.

    Parameters
    ----------
    published : mapping of str to (V,) array of float64
        The published statistic of each volume, by target; NaN where a volume has none.
    turned : sequence of TurnedBox
        See `annotations.agreement.turned_boxes.turned_boxes`.
    """
    known = {name: np.where(np.isfinite(values), values, 0.0) for name, values in published.items()}
    ranks = _ranks(published)
    shared = np.isfinite(compared.positions_um).any(axis=(2, 3)).sum(axis=1) > 1
    return tuple(
        VolumeResult(
            volume=compared.volumes[row],
            annotators=tuple(np.array(compared.annotators)[compared.has_document[row]].tolist()),
            targets={
                name: float(values[row])
                for name, values in known.items()
                if np.isfinite(published[name][row])
            },
            rank=float(ranks[row]),
        )
        for row in np.argsort(-ranks, kind="stable")
        if shared[row]
    )


def _ranks(published: Mapping[str, Array]) -> Array:
    """Return for each volume the largest ratio of a target's figure to its median over the volumes, (V,)."""
    ratios = []
    for values in published.values():
        known = values[np.isfinite(values)]
        # Where more than half agree exactly there is no median to compare with.
        usual = float(np.median(known) or known.mean()) if known.size else 0.0
        if usual > 0:
            ratios.append(np.where(np.isfinite(values), values, 0.0) / usual)
    number = len(next(iter(published.values()))) if published else 0
    return np.max(ratios, axis=0) if ratios else np.zeros(number)
