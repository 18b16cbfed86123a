"""Keypoints against boxes, or any two ways to do the same volumes: which of them has the smaller figures."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.intervals import RESAMPLES, estimate
from annotations.agreement.outlying import ROUNDING
from annotations.agreement.results import PairedTest

TEST = "Wilcoxon signed-rank test, two-sided; volumes without a difference are left out"


def method_comparison(
    volumes: tuple[Sequence[str], Sequence[str]],
    published: tuple[Mapping[str, NDArray[np.float64]], Mapping[str, NDArray[np.float64]]],
    *,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Mapping[str, PairedTest]:
    """Return for each target how keypoints fare against boxes, over the volumes compared by both.

    Parameters
    ----------
    volumes : (sequence of str, sequence of str)
        Names of the volumes annotated by keypoints, and of those annotated by boxes.
    published : (mapping of str to (V,) array, mapping of str to (V,) array)
        The published statistic of each of those volumes, by target; NaN where a volume has none.
    resamples, seed : int
        Of the bootstrap over volumes.
    """
    row_of = {volume: row for row, volume in enumerate(volumes[1])}
    both = [(row, row_of[volume]) for row, volume in enumerate(volumes[0]) if volume in row_of]
    by_keypoints = [row for row, _ in both]
    by_boxes = [row for _, row in both]
    return {
        name: paired_test(values[by_keypoints] - published[1][name][by_boxes], resamples=resamples, seed=seed)
        for name, values in published[0].items()
        if name in published[1]
    }


def paired_test(differences: NDArray[np.float64], *, resamples: int = RESAMPLES, seed: int = 0) -> PairedTest:
    """Return mean difference, F. Wilcoxon's test (*Biometrics Bulletin* 1, 1945) and the effect.

    The effect is the matched-pairs rank-biserial correlation by D. S. Kerby's simple difference formula (*The
    simple difference formula*, Comprehensive Psychology 3, 2014): the share of the ranks' sum that positive
    differences have, less that of negative ones. Differences of zero are left out of test and effect, as by
    Wilcoxon, and equal ones share a mean rank.

    Parameters
    ----------
    differences : (n,) array of float64
        One minus the other, such as keypoints minus boxes, in µm, mm or degrees, one for each volume; NaN
        where a volume lacks a figure, which is not counted. What is left of rounding
        (`annotations.agreement.outlying.ROUNDING`) is no difference.

    Returns
    -------
    PairedTest
        Without p and effect where no volume differs.
    """
    from scipy.stats import rankdata, wilcoxon

    difference = estimate(differences, resamples=resamples, seed=seed)
    known = differences[np.abs(differences) > ROUNDING]
    if not known.size:
        return PairedTest(difference=difference, test=TEST)
    ranks = rankdata(np.abs(known))
    effect = float(ranks[known > 0].sum() - ranks[known < 0].sum()) / float(ranks.sum())
    p_value = float(wilcoxon(known, zero_method="wilcox", correction=False).pvalue)
    return PairedTest(difference=difference, test=TEST, p_value=p_value, effect=effect)
