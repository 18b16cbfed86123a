"""What a reader must know before taking a figure out of a report."""

import math

from annotations.agreement.report.contents import Note, Paragraph
from annotations.agreement.report.labels import METHODS, counted, listed, methods_of
from annotations.agreement.results import Agreement
from annotations.documents.record import Method

_FEW_VOLUMES = 10
_MOST_MISTAKES = 5
_MOST_NUMBERS = 3


def mistakes_note(agreement: Agreement) -> Note | None:
    """Return the mistakes that were recognised, since a single one can make a figure; None without any."""
    methods = methods_of(agreement)
    found = [
        f"{volume.volume}: {mistake}{f' ({METHODS[method].lower()})' if len(methods) > 1 else ''}"
        for method in methods
        for volume in agreement.methods[method].volumes
        for mistake in volume.mistakes
    ]
    if not found:
        return None
    more = len(found) - _MOST_MISTAKES
    rest = f"; and {more:,} more, which stand in volumes.csv and among the worst volumes" if more > 0 else ""
    return Note(f"Recognised mistakes: {'; '.join(found[:_MOST_MISTAKES])}{rest}.")


def factors_paragraph(agreement: Agreement) -> Paragraph:
    """Return how the three statistics stand to the distance from the truth, for the annotators there are."""
    numbers = sorted(
        {each for result in agreement.methods.values() for each in result.counts.volumes_by_annotators}
    )
    shown = numbers if len(numbers) <= _MOST_NUMBERS else [numbers[0], numbers[-1]]
    here = [
        f"{_share_of_mean(n):.2f}, {1 / _share_of_mean(n):.2f} and {math.sqrt(2):.2f} with {n} annotators"
        for n in shown
    ]
    return Paragraph(
        "The deviation from the mean of all annotators is the published statistic. Each annotator is part of "
        "that mean, so it understates how far annotators are from the truth; the leave-one-out and the "
        "pairwise deviation overstate it. For n annotators of equal, isotropic noise the three are "
        f"√((n − 1)/n), √(n/(n − 1)) and √2 of it{f': here {listed(here)}' if here else ''}. Compare a "
        "network's error only with the statistic that was computed alike."
    )


def unequal_numbers_note(agreement: Agreement) -> Note | None:
    """Return that volumes of different numbers of annotators are averaged; None where they are not."""
    told = [
        words
        for method in methods_of(agreement)
        if (words := _unequal_numbers(agreement, method)) is not None
    ]
    if not told:
        return None
    return Note(
        "The deviation from the mean of all is smaller where fewer annotators share a volume, for equal "
        f"noise as √((n − 1)/n), and these figures are means over volumes of different n. {' '.join(told)}"
    )


def fewness_note(agreement: Agreement) -> Note | None:
    """Return a warning where a figure is of few volumes."""
    numbers = [
        statistics.published.n
        for result in agreement.methods.values()
        for statistics in result.targets.values()
        if statistics.published.n
    ]
    if min(numbers, default=_FEW_VOLUMES) >= _FEW_VOLUMES:
        return None
    return Note(
        f"Some of these figures are of {counted(min(numbers), 'volume')} only. With fewer than "
        f"{_FEW_VOLUMES} an interval is rough, since a single unusual volume can decide it; of fewer than "
        "five volumes it is Student's t interval, which may reach below zero."
    )


def from_prediction_note(agreement: Agreement) -> Note | None:
    """Return whose annotations were begun from a prediction, and are left out; None where there is none."""
    told = []
    for method in methods_of(agreement):
        begun = agreement.methods[method].counts.from_prediction
        people = [
            f"{each.annotator} {each.from_prediction:,}"
            for each in agreement.methods[method].annotators
            if each.from_prediction
        ]
        if begun:
            told.append(f"{METHODS[method].lower()}: {begun:,} ({listed(people)})")
    if not told:
        return None
    return Note(
        "Annotations that were begun from a network's prediction are no opinions of their own, and are left "
        f"out of these figures; below they are given with them, too. By {'; by '.join(told)}."
    )


def _unequal_numbers(agreement: Agreement, method: Method) -> str | None:
    volumes = agreement.methods[method].counts.volumes_by_annotators
    if len(volumes) < 2:
        return None
    (fewest, first), *others = sorted(volumes.items())
    most = others[-1][0]
    phrases = [
        f"{counted(first, 'volume')} {_have(first)} {fewest} annotators",
        *(f"{number:,} {_have(number)} {annotators}" for annotators, number in others),
    ]
    ratio = _share_of_mean(fewest) / _share_of_mean(most)
    return (
        f"{METHODS[method]}: {listed(phrases)}; for equal noise the deviation of {fewest} is {ratio:.2f} of "
        f"that of {most}."
    )


def _have(number: int) -> str:
    return "has" if number == 1 else "have"


def _share_of_mean(annotators: int) -> float:
    """Return what share of the distance from the truth the distance from the mean of all is."""
    return math.sqrt((annotators - 1) / annotators)
