"""The volumes that the annotators disagree on, the worst first, and why."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.compared import Compared
from annotations.agreement.deviation import distances_from_others
from annotations.agreement.measured import Measured
from annotations.agreement.outlying import ROUNDING, outlying_limit
from annotations.agreement.reasons import Explanation, Reasons, of_turned_box
from annotations.agreement.results import TurnedBox, VolumeResult
from annotations.errors import Cancelled
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]

_MOST_EXPLAINED = 1000
"""How many volumes are looked into, the worst: a millisecond each, and nobody reads more."""


def volume_results(
    compared: Compared,
    tool: ToolSpecification,
    published: Mapping[str, Array],
    turned: Sequence[TurnedBox] = (),
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[VolumeResult, ...]:
    """Return each volume with at least two annotators, the worst first.

    A volume is looked into where some keypoint is further from the mean of the others than is usual in this
    comparison (`annotations.agreement.outlying.outlying_limit`). First come names that annotators exchanged,
    then who is far off where under the names that are right, then boxes that are turned.

    Parameters
    ----------
    published : mapping of str to (V,) array of float64
        The published statistic of each volume, by target; NaN where a volume has none.
    turned : sequence of TurnedBox
        See `annotations.agreement.turned_boxes.turned_boxes`.
    cancelled : callable
        Asked now and then; if it says true, `Cancelled` is raised.
    """
    ratios = _ratios_to_median(published, len(compared.volumes))
    is_placed = np.isfinite(compared.positions_um[..., 0])
    is_there: NDArray[np.bool_] = np.any(is_placed, axis=2)
    is_shared = is_there.sum(axis=1) > 1
    apart_um = np.stack(
        [
            distances_from_others(Measured(name, "distance", compared.positions_um[:, :, point]))
            for point, name in enumerate(tool.keypoint_names)
        ],
        axis=2,
    )
    limit_um = outlying_limit(apart_um)
    is_unusual: NDArray[np.bool_] = np.any(np.nan_to_num(apart_um) > limit_um, axis=(1, 2))
    order = [int(row) for row in np.argsort(-ratios, kind="stable") if is_shared[row]]
    explained = [row for row in order if is_unusual[row]][:_MOST_EXPLAINED]
    explanations: dict[int, Explanation] = defaultdict(Explanation)
    explain = Reasons(tool, compared.method, limit_um)
    for row in explained:
        if cancelled():
            raise Cancelled
        who = np.flatnonzero(is_there[row])
        names = [compared.annotators[each] for each in who]
        explanations[row] = explain.of_positions(names, compared.positions_um[row, who])
    row_of = {volume: row for row, volume in enumerate(compared.volumes)}
    who_of = [
        tuple(compared.annotators[each] for each in np.flatnonzero(is_there[row]))
        for row in range(len(compared.volumes))
    ]
    turned_in: dict[int, list[str]] = defaultdict(list)
    for box in turned:
        row = row_of[box.volume]
        turned_in[row].append(of_turned_box(box, who_of[row]))
    return tuple(
        VolumeResult(
            volume=compared.volumes[row],
            annotators=who_of[row],
            targets={
                name: float(values[row]) for name, values in published.items() if np.isfinite(values[row])
            },
            ratio_to_median=float(ratios[row]),
            reasons=(*explanations[row].mistakes, *explanations[row].far_off, *turned_in[row]),
            mistakes=explanations[row].mistakes,
            mistaken=explanations[row].mistaken,
        )
        for row in order
    )


def _ratios_to_median(published: Mapping[str, Array], volumes: int) -> Array:
    """Return for each volume the largest ratio of a target's figure to its median over the volumes, (V,)."""
    ratios = np.zeros(volumes)
    for values in published.values():
        known = values[np.isfinite(values)]
        if not known.size or known.max() <= ROUNDING:
            continue
        usual = float(np.median(known))
        # Where more than half agree exactly, the median is no measure of what is usual.
        ratios = np.maximum(ratios, np.nan_to_num(values) / (usual if usual > ROUNDING else known.mean()))
    return ratios
