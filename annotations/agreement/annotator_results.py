"""Each annotator beside the others: how far off, in which direction, where most, and how quickly."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.compared import Compared
from annotations.agreement.components import difference_from_others
from annotations.agreement.deviation import distances_from_others
from annotations.agreement.intervals import RESAMPLES, estimate
from annotations.agreement.measured import Measured
from annotations.agreement.outlying import outlying_limit
from annotations.agreement.results import AnnotatorResult, Outlier

Array = NDArray[np.float64]


def annotator_results(
    compared: Compared,
    measured: Mapping[str, Measured],
    components: Mapping[str, Array],
    not_blind: Mapping[str, int],
    from_prediction: Mapping[str, int],
    *,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> tuple[AnnotatorResult, ...]:
    """Return what can be said of each annotator, in their order.

    Distances and biases are from the mean of the others, over the volumes that somebody else did, too.

    Parameters
    ----------
    compared : Compared
    measured : mapping of str to Measured
        The targets of ``compared``.
    components : mapping of str to (V, A) array of float64
        See `annotations.agreement.components.component_values`, in the frame of each volume.
    not_blind : mapping of str to int
        How many documents of each annotator are left out of ``compared``, because others' were seen before.
    from_prediction : mapping of str to int
        And how many because they were begun from a prediction.
    resamples, seed : int
        Of the bootstrap over volumes.
    """
    apart = {name: distances_from_others(target) for name, target in measured.items()}
    off = {name: difference_from_others(values) for name, values in components.items()}
    outliers = outliers_of(compared, measured, apart)
    return tuple(
        AnnotatorResult(
            annotator=annotator,
            documents=int(compared.has_document[:, who].sum()),
            done=int((compared.has_document & compared.is_done)[:, who].sum()),
            not_blind=not_blind.get(annotator, 0),
            from_prediction=from_prediction.get(annotator, 0),
            deviation={
                name: estimate(values[:, who], resamples=resamples, seed=seed)
                for name, values in apart.items()
            },
            bias={
                name: estimate(values[:, who], resamples=resamples, seed=seed) for name, values in off.items()
            },
            outliers=outliers[who],
            active_seconds=estimate(compared.active_seconds[:, who], resamples=resamples, seed=seed),
        )
        for who, annotator in enumerate(compared.annotators)
    )


def outliers_of(
    compared: Compared, measured: Mapping[str, Measured], apart: Mapping[str, Array]
) -> Sequence[tuple[Outlier, ...]]:
    """Return for each annotator the volumes that they have much further from the others than is usual.

    The limit of a target is that of all its distances (`annotations.agreement.outlying.outlying_limit`). One
    who is far off draws the mean away from the others, too: of several beyond the limit the worst is taken
    out of the volume, and only who is beyond it without that one is an outlier besides. Of two alone, both
    are: nobody can tell who is wrong.

    Parameters
    ----------
    apart : mapping of str to (V, A) array of float64
        Distances from the mean of the others, by target.

    Returns
    -------
    sequence of tuple of Outlier
        The worst first, as multiples of the limit.
    """
    found: list[list[Outlier]] = [[] for _ in compared.annotators]
    for name, target in measured.items():
        limit = outlying_limit(apart[name])
        for volume, who, value in _beyond(target, apart[name], limit):
            found[who].append(Outlier(volume=compared.volumes[volume], target=name, value=value, limit=limit))
    return [tuple(sorted(each, key=lambda outlier: -outlier.value / outlier.limit)) for each in found]


def _beyond(measured: Measured, apart: Array, limit: float) -> list[tuple[int, int, float]]:
    """Return volume, annotator and distance of each who is beyond the limit by themselves."""
    found = []
    volumes = np.flatnonzero((np.where(np.isnan(apart), 0.0, apart) > limit).any(axis=1))
    rest = replace(measured, values=measured.values[volumes])
    left = apart[volumes]
    while volumes.size:
        distances = np.where(np.isnan(left), 0.0, left)
        worst = distances.argmax(axis=1)
        rows = np.arange(volumes.size)
        is_beyond = distances[rows, worst] > limit
        alone = np.isfinite(left).sum(axis=1) == 2
        for row in np.flatnonzero(is_beyond):
            both = np.flatnonzero(distances[row] > limit) if alone[row] else worst[row : row + 1]
            found += [(int(volumes[row]), int(who), float(distances[row, who])) for who in both]
        stay = is_beyond & ~alone
        values = rest.values[stay].copy()
        values[np.arange(len(values)), worst[stay]] = np.nan
        volumes, rest = volumes[stay], replace(measured, values=values)
        left = distances_from_others(rest)
    return found
