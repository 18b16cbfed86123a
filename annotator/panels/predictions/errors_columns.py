"""The columns of the table of errors: what stands in each, by what it sorts, and what people come to."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from annotations.agreement.report.labels import NOTHING, listed
from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable
from annotations.prediction.errors.error_text import column_title, decimals_of, mean_and_deviation
from annotations.prediction.errors.prediction_errors import error_figures
from annotations.prediction.errors.ranking import RankedVolume
from annotator.panels.widgets.table_model import Column
from annotator.session.predictions.judging import Judgement

_RATIO = (
    "How many times further the checkpoint is from what people say than people are from each other, in the "
    "target in which that is most: what the volumes are ranked by"
)
_TO_MEDIAN = (
    "How many times larger the error is than its median over the volumes, in the target in which that is "
    "most: what the volumes are ranked by, as no volume has two annotators who could be apart from each other"
)
_FLOOR = "in brackets how far another person would be from the truth; coloured where the error is larger"
_BY_FORMULAS, _BY_FIT = "of the predicted keypoints", "of the pose that was fitted to them"


@dataclass(frozen=True, eq=False)
class ReviewedVolume:
    """A row of the table.

    Attributes
    ----------
    label : str
        How the volume is called where it is shown.
    errors : ErrorsOfVolume
    ranked : RankedVolume
    rank : int
        0 for the volume that needs a look first.
    judgement : Judgement
    """

    label: str
    errors: ErrorsOfVolume
    ranked: RankedVolume
    rank: int
    judgement: Judgement

    @property
    def volume(self) -> str:
        """Its id."""
        return self.errors.volume


@dataclass(frozen=True)
class ErrorColumn(Column[ReviewedVolume]):
    """A column of the table; rows of which `sort` is None come last, whichever way it is sorted.

    Attributes
    ----------
    is_beyond : callable
        Whether the error is larger than people's own.
    summary : callable
        What stands below the rows that are shown.
    people : str
        What stands below that: how far people are apart.
    """

    is_beyond: Callable[[ReviewedVolume], bool] = lambda _volume: False
    summary: Callable[[Sequence[ReviewedVolume]], str] = lambda _volumes: ""
    people: str = ""


VOLUME, RANK = 0, 1
"""Places of the columns that every table has first."""


def columns_of(table: ErrorTable, *, by_fit: bool) -> tuple[ErrorColumn, ...]:
    """Return the columns for the targets of a table.

    Parameters
    ----------
    by_fit : bool
        Of the fitted pose rather than of the predicted keypoints.
    """
    return (
        ErrorColumn(
            "Volume",
            "A click opens it, and so do the arrow keys",
            lambda volume: volume.label,
            lambda volume: volume.label.casefold(),
            is_number=False,
            summary=lambda _volumes: "mean ± SD",
            people="people" if table.human is not None else "",
        ),
        _rank_column(table),
        ErrorColumn(
            "verdict",
            "Who is wrong, as you or others say; * where the annotation has been changed since",
            lambda volume: volume.judgement.words,
            lambda volume: volume.judgement.words or None,
            is_number=False,
        ),
        *(_target_column(table, name, by_fit) for name in table.by_formulas.targets),
        _keypoints_column(by_fit),
        ErrorColumn(
            _in_two_lines("sure (%)"),
            "How sure the network is that the keypoint of which it is least sure is there at all",
            lambda volume: _number(volume.errors.presence * 100, 1),
            lambda volume: volume.errors.presence,
            summary=lambda volumes: _summary([volume.errors.presence * 100 for volume in volumes], 1),
        ),
        ErrorColumn(
            _in_two_lines("spread (µm)"),
            "How wide the heatmaps are: the other way in which the network says how sure it is",
            lambda volume: _number(volume.errors.spread_um, 0),
            lambda volume: volume.errors.spread_um,
            summary=lambda volumes: _summary([volume.errors.spread_um for volume in volumes], 0),
        ),
    )


def explained(volume: ReviewedVolume) -> str:
    """Return what there is to say of a row besides its figures, a line for each."""
    errors = volume.errors
    lines = [f"{volume.label}, held against {errors.whose}"]
    if errors.begun_from:
        begun = listed(list(errors.begun_from))
        lines.append(f"The annotation was begun from a prediction of {begun}: it counts in no figure")
    lines += [
        f"{words}: {', '.join(names)}"
        for words, names in (
            ("Not found", errors.missing),
            ("Rightly said to be out of range", errors.rightly_out_of_range),
            ("Out of view", errors.out_of_view),
            ("The tool cannot have them where they were predicted", errors.left_out),
        )
        if names
    ]
    if errors.keypoints_um:
        worst = max(errors.keypoints_um, key=lambda name: errors.keypoints_um[name])
        lines.append(f"Furthest off: {worst}, {errors.keypoints_um[worst]:.0f} µm")
    return "\n".join([*lines, *volume.judgement.lines])


def _rank_column(table: ErrorTable) -> ErrorColumn:
    if table.human is None:
        return ErrorColumn(
            "×\nmedian",
            _TO_MEDIAN,
            lambda volume: _times(volume.ranked.ratio_to_median),
            lambda volume: -volume.rank,
        )
    return ErrorColumn(
        "×\npeople",
        _RATIO,
        lambda volume: _times(volume.ranked.ratio),
        # The first of the ranking has the largest one.
        lambda volume: -volume.rank,
        is_beyond=lambda volume: volume.ranked.ratio is not None and volume.ranked.ratio > 1,
    )


def _target_column(table: ErrorTable, name: str, by_fit: bool) -> ErrorColumn:
    decimals = decimals_of(name)
    floors = table.human.targets if table.human is not None else {}

    def error(volume: ReviewedVolume) -> float | None:
        targets = volume.errors.targets_by_fit if by_fit else volume.errors.targets
        return targets.get(name)

    def text(volume: ReviewedVolume) -> str:
        shown = _number(error(volume), decimals)
        if table.human is None:
            return shown
        return f"{shown} ({_number(volume.ranked.floors.get(name), decimals + 1)})"

    def is_beyond(volume: ReviewedVolume) -> bool:
        value, floor = error(volume), volume.ranked.floors.get(name)
        return value is not None and floor is not None and value > floor

    way = _BY_FIT if by_fit else _BY_FORMULAS
    return ErrorColumn(
        _in_two_lines(column_title(name)),
        f"Error {way}; {_FLOOR}" if table.human is not None else f"Error {way}",
        text,
        error,
        is_beyond=is_beyond,
        summary=lambda volumes: _summary([error(volume) for volume in volumes], decimals),
        people=mean_and_deviation(floors.get(name), decimals + 1) if table.human is not None else "",
    )


def _keypoints_column(by_fit: bool) -> ErrorColumn:
    def mean_um(volume: ReviewedVolume) -> float | None:
        errors = volume.errors
        distances_um = errors.keypoints_by_fit_um if by_fit else errors.keypoints_um
        return float(np.mean(list(distances_um.values()))) if distances_um else None

    def text(volume: ReviewedVolume) -> str:
        missing = len(volume.errors.missing)
        return f"{_number(mean_um(volume), 0)}{f', {missing} missing' if missing else ''}"

    return ErrorColumn(
        _in_two_lines("keypoints (µm)"),
        f"Mean distance of the keypoints {_BY_FIT}" if by_fit else "Mean distance of the predicted keypoints",
        text,
        mean_um,
        summary=lambda volumes: _summary([mean_um(volume) for volume in volumes], 0),
    )


def _in_two_lines(title: str) -> str:
    """Return a heading with its unit below: figures are narrow, and a table has many of them."""
    return title.replace(" (", "\n(")


def _times(ratio: float | None) -> str:
    return NOTHING if ratio is None else f"× {ratio:.1f}"


def _number(value: float | None, decimals: int) -> str:
    return NOTHING if value is None else f"{value:.{decimals}f}"


def _summary(values: Sequence[float | None], decimals: int) -> str:
    """Return mean ± standard deviation of what is there."""
    known = np.array([value for value in values if value is not None], dtype=np.float64)
    return mean_and_deviation(error_figures(known, np.zeros(1, dtype=bool)), decimals)
