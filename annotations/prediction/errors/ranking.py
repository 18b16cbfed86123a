"""Volumes in the order in which a reviewer should look at them: where model and people disagree most.

What an error is held against is how far people are apart themselves. For one volume and one target:

- The truth is either one person's annotation, or a consensus. How far one more person would be from it is the
  yardstick: from one person's it is the *pairwise* deviation, from a consensus the *leave-one-out* deviation
  (`annotations.agreement.deviation`). The published statistic, which tables show, would be too small a
  yardstick: each annotator is part of the mean that it is taken from, so that of two people it is half of
  what they differ by. A simulation's truth is exact, and is taken as a consensus is.
- A volume's own figure is of two or three people, and may be next to nothing by chance; that of the study is
  steady, but does not know which volumes are hard. The *floor* is the root mean square of the two, as when
  two equally good estimates of a variance are pooled: never less than 0.7 of the study's, so that nothing is
  divided by a tiny number, and larger where people themselves find it hard. A volume with one annotator has
  the study's.
- The *ratio* is error / floor. Of 1 the model is as far from the truth as another person would be.

A volume's ratio is the largest of its targets', and names the target: one that is wrong is enough to be
looked at. Where the model has not found keypoints that it should have, there is no error that could be too
large, and the volume comes before all others.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from annotations.agreement.outlying import ROUNDING
from annotations.documents.study import CONSENSUS
from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable, HumanFloor


@dataclass(frozen=True)
class RankedVolume:
    """A volume in its place.

    Attributes
    ----------
    volume : str
    ratio : float or None
        How many times further the model is from the truth than another person would be, in the target in
        which that is most; None where there is no target to tell it, or no two people were there.
    target : str or None
        That target; without a ratio, the one of ``ratio_to_median``.
    ratios : mapping of str to float
        Of each target that has an error and a floor.
    floors : mapping of str to float
        How far another person would be from the truth, by target, in the errors' units.
    ratio_to_median : float or None
        The largest error relative to its target's median over the volumes: what volumes without a ratio are
        ranked by. None where no target has an error.
    missing : tuple of str
        Keypoints that were not found, for which the volume comes first.
    """

    volume: str
    ratio: float | None = None
    target: str | None = None
    ratios: Mapping[str, float] = field(default_factory=dict)
    floors: Mapping[str, float] = field(default_factory=dict)
    ratio_to_median: float | None = None
    missing: tuple[str, ...] = ()


def rank(table: ErrorTable) -> tuple[RankedVolume, ...]:
    """Return the rows of a table, the one that needs a look first first.

    Those with keypoints that were not found come first, those with most of them at the top; then those that
    have a ratio, from the largest down, and then those that have none, by their errors relative to the
    medians. Where no two people have annotated a volume of the study, or where it is synthetic, all are of
    the last kind. Volumes that are alike stay in the order of the table.

    Errors are those of the predicted keypoints by the published formulas.
    """
    people = None if table.human is None else _People(table.human)
    medians = _medians(table)
    ranked = [_ranked(row, {} if people is None else people.floors(row), medians) for row in table.rows]
    return tuple(sorted(ranked, key=_precedence))


class _People:
    """Tells how far another person would be from a volume's truth; see the top of this module."""

    def __init__(self, human: HumanFloor) -> None:
        self._annotators = human.annotators
        self._from_one = (human.pairwise, _usual(human.pairwise))
        self._from_several = (human.leave_one_out, _usual(human.leave_one_out))

    def floors(self, row: ErrorsOfVolume) -> Mapping[str, float]:
        """Return it by target."""
        is_of_one = row.whose != CONSENSUS and row.whose in self._annotators
        apart, usual = self._from_one if is_of_one else self._from_several
        own = apart.get(row.volume, {})
        return {name: _floor(own.get(name), of_study) for name, of_study in usual.items()}


def _usual(apart: Mapping[str, Mapping[str, float]]) -> Mapping[str, float]:
    """Return the study's figures: means over its volumes, without those that are what rounding left."""
    by_target: dict[str, list[float]] = {}
    for of_volume in apart.values():
        for name, value in of_volume.items():
            by_target.setdefault(name, []).append(value)
    means = {name: float(np.mean(values)) for name, values in by_target.items()}
    return {name: mean for name, mean in means.items() if mean > ROUNDING}


def _floor(own: float | None, usual: float) -> float:
    return usual if own is None else math.hypot(own, usual) / math.sqrt(2)


def _medians(table: ErrorTable) -> Mapping[str, float]:
    by_target: dict[str, list[float]] = {}
    # Where no truth is independent of networks, the rows are compared with each other all the same.
    for row in table.independent_rows or table.rows:
        for name, error in row.targets.items():
            by_target.setdefault(name, []).append(error)
    return {name: float(np.median(errors)) for name, errors in by_target.items()}


def _ranked(row: ErrorsOfVolume, floors: Mapping[str, float], medians: Mapping[str, float]) -> RankedVolume:
    ratios = {name: error / floors[name] for name, error in row.targets.items() if name in floors}
    relative = {
        name: _relative(error, medians[name]) for name, error in row.targets.items() if name in medians
    }
    said = ratios or relative
    worst = max(said, key=lambda name: said[name], default=None)
    return RankedVolume(
        volume=row.volume,
        ratio=max(ratios.values(), default=None),
        target=worst,
        ratios=ratios,
        floors=floors,
        ratio_to_median=max(relative.values(), default=None),
        missing=row.missing,
    )


def _relative(error: float, median: float) -> float:
    # Where half of the errors are nothing but rounding, any real error is infinitely many times that.
    if median > ROUNDING:
        return error / median
    return math.inf if error > ROUNDING else 0.0


def _precedence(ranked: RankedVolume) -> tuple[int, bool, float]:
    """Return what volumes are sorted by, the smallest first."""
    has_no_ratio = ranked.ratio is None
    value = ranked.ratio_to_median if has_no_ratio else ranked.ratio
    return -len(ranked.missing), has_no_ratio, -(value if value is not None else -1.0)
