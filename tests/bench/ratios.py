"""Figures as ratios to others that were taken in turn with them."""

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Comparison:
    """One row that is compared.

    Attributes
    ----------
    name : str
    ours, others : str
        The figures' names.
    at_most : float or None
        What the ratio is to be at most.
    aim : float or None
        What it might be.
    """

    name: str
    ours: str
    others: str
    at_most: float | None = None
    aim: float | None = None


@dataclass(frozen=True)
class Ratio:
    """A comparison's outcome over some rounds.

    Attributes
    ----------
    comparison : Comparison
    ours, others : float
        Medians.
    lowest, median, highest : float
        Of our figure over the other of the same round.
    """

    comparison: Comparison
    ours: float
    others: float
    lowest: float
    median: float
    highest: float

    @property
    def reached(self) -> str:
        """Whether it is no more than what was asked for: in every round, in the median, or not."""
        at_most = self.comparison.at_most
        if at_most is None:
            return ""
        return "yes" if self.highest <= at_most else "in the median" if self.median <= at_most else "no"


def ratios(
    comparisons: Sequence[Comparison],
    ours: Sequence[Mapping[str, object]],
    others: Sequence[Mapping[str, object]],
) -> list[Ratio]:
    """Return each comparison of which both have a figure; the rounds come in pairs."""
    found = []
    for comparison in comparisons:
        pairs = [
            (float(str(own[comparison.ours])), float(str(other[comparison.others])))
            for own, other in zip(ours, others, strict=True)
            if comparison.ours in own and comparison.others in other
        ]
        if pairs:
            quotients = [own / other for own, other in pairs]
            found.append(
                Ratio(
                    comparison,
                    ours=statistics.median(own for own, _ in pairs),
                    others=statistics.median(other for _, other in pairs),
                    lowest=min(quotients),
                    median=statistics.median(quotients),
                    highest=max(quotients),
                )
            )
    return found
