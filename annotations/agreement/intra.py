"""How far annotators are from themselves: their repeated passes over the same volumes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.compared import Compared
from annotations.agreement.deviation import deviations, mean_of_all
from annotations.agreement.intervals import RESAMPLES, estimate
from annotations.agreement.measured import Measured, measured_targets
from annotations.agreement.results import IntraResult
from annotations.geometry.tool import ToolSpecification


def intra_results(
    passes: Sequence[Compared], tool: ToolSpecification, *, resamples: int = RESAMPLES, seed: int = 0
) -> tuple[IntraResult, ...]:
    """Return for each annotator with repeats, and then for all of them, how far their passes are apart.

    For each volume and annotator that is the mean distance over all pairs of passes. All of them together
    are the mean over volumes of the mean over the volume's annotators, so that a volume counts once.

    Parameters
    ----------
    passes : sequence of Compared
        The first pass, then the repeats, of one method.
    tool : ToolSpecification
    resamples, seed : int
        Of the bootstrap over volumes.

    Returns
    -------
    tuple of IntraResult
        Empty where nobody did a volume twice.
    """
    if len(passes) < 2:
        return ()
    annotators = passes[0].annotators
    volumes = list(dict.fromkeys(volume for each in passes for volume in each.volumes))
    row_of = {volume: row for row, volume in enumerate(volumes)}
    by_pass = [measured_targets(each, tool) for each in passes]
    apart: dict[str, NDArray[np.float64]] = {}
    for name, first in by_pass[0].items():
        width = first.values.shape[2]
        # Passes take the place of annotators: the pairwise statistic is then of each person.
        values = np.full((len(annotators), len(volumes), len(passes), width), np.nan)
        for number, (each, targets) in enumerate(zip(passes, by_pass, strict=True)):
            rows = [row_of[volume] for volume in each.volumes]
            values[:, rows, number] = targets[name].values.swapaxes(0, 1)
        apart[name] = np.stack(
            [deviations(Measured(name, first.metric, own)).pairwise for own in values], axis=1
        )
    results = []
    for who, annotator in enumerate(annotators):
        targets_of_one = {
            name: estimate(values[:, who], resamples=resamples, seed=seed) for name, values in apart.items()
        }
        if any(figure.n for figure in targets_of_one.values()):
            results.append(IntraResult(annotator=annotator, targets=targets_of_one))
    if not results:
        return ()
    together = {
        name: estimate(_of_each_volume(values), resamples=resamples, seed=seed)
        for name, values in apart.items()
    }
    return (*results, IntraResult(annotator=None, targets=together))


def _of_each_volume(apart: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean over the annotators of each volume: shape (V, A) to (V,)."""
    return mean_of_all(Measured("apart", "difference", apart[..., np.newaxis]))[..., 0]
