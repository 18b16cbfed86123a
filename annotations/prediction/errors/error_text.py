"""A table of errors as text: the published layout, mean ± standard deviation over volumes, a row a way."""

from collections.abc import Mapping

from annotations.agreement.report.labels import NOTHING, counted, label_of, listed
from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.errors.prediction_errors import ErrorFigures

_BY_FORMULAS, _BY_FIT = "predicted keypoints", "fitted pose"
_NAMED = 5


def error_text(table: ErrorTable, name: str = "") -> str:
    """Return the table for a person: targets, then what goes wrong, then each keypoint.

    Parameters
    ----------
    table : ErrorTable
    name : str
        What the checkpoint is called, where its own name is not enough.
    """
    targets = list(table.by_formulas.targets)
    name = name or (table.checkpoint.name if table.checkpoint else "no checkpoint")
    volumes = counted(len(table.independent_rows), "volume")
    lines = [
        f"{name}: {volumes} of {table.title!r}, mean ± standard deviation",
        *_grid(["", *(column_title(name) for name in targets)], _rows(table, targets)),
        *_shares(table),
        *_grid(["keypoint", f"{_BY_FORMULAS} (µm)", f"{_BY_FIT} (µm)"], _keypoint_rows(table)),
        *(f"  not judged, {each.volume}: {each.reason}" for each in table.unjudged),
        *_trained_on(table),
    ]
    return "\n".join(lines)


def begun_text(table: ErrorTable) -> str:
    """Say which volumes count in no figure, since their truth was begun from a prediction, and what they say.

    A sentence without its full stop; empty where every truth is independent.
    """
    begun = [row for row in table.rows if row.begun_from]
    if table.with_begun is None or not begun:
        return ""
    unnamed = [f"{len(begun) - _NAMED} more"] if len(begun) > _NAMED else []
    volumes = listed([*(row.volume for row in begun[:_NAMED]), *unnamed])
    checkpoints = listed(list(dict.fromkeys(name for row in begun for name in row.begun_from)))
    figures = ", ".join(
        f"{column_title(name)} {mean_and_deviation(each, decimals_of(name))}"
        for name, each in table.with_begun.targets.items()
        if each.n
    )
    return (
        f"of {counted(len(begun), 'volume')} ({volumes}) the annotation was begun from a prediction of "
        f"{checkpoints}, and leans towards what networks say: listed, and counted in no figure. "
        f"With {'it' if len(begun) == 1 else 'them'}: {figures or NOTHING}"
    )


def column_title(name: str) -> str:
    """Return the published title of a target's column, such as ``position (mm)`` and ``θ1 (°)``."""
    bare, unit = name.removesuffix("_mm"), "mm"
    if bare == name:
        bare, unit = name.removesuffix("_deg"), "°"
    label = label_of(bare)
    return f"{label[:1].lower()}{label[1:]} ({unit})"


def decimals_of(name: str) -> int:
    """Return how many decimals a target's figures have: 2 of millimetres, else 1."""
    return 2 if name.endswith("_mm") else 1


def mean_and_deviation(figures: ErrorFigures | None, decimals: int) -> str:
    """Return ``mean ± standard deviation``."""
    if figures is None or figures.mean is None:
        return NOTHING
    spread = f" ± {figures.sd:.{decimals}f}" if figures.sd is not None else ""
    return f"{figures.mean:.{decimals}f}{spread}"


def _median(figures: ErrorFigures, decimals: int) -> str:
    if figures.median is None or figures.p95 is None:
        return NOTHING
    return f"{figures.median:.{decimals}f} / {figures.p95:.{decimals}f}"


def _rows(table: ErrorTable, targets: list[str]) -> list[list[str]]:
    by_way: dict[str, Mapping[str, ErrorFigures]] = {
        _BY_FORMULAS: table.by_formulas.targets,
        _BY_FIT: table.by_fit.targets,
    }
    rows = [
        [way, *(mean_and_deviation(of_way.get(name), decimals_of(name)) for name in targets)]
        for way, of_way in by_way.items()
    ]
    for way, of_way in by_way.items():
        figures = [of_way[name] for name in targets]
        medians = [_median(each, decimals_of(name)) for name, each in zip(targets, figures, strict=True)]
        rows.append([f"{way}, median / 95 %", *medians])
        if any(each.missing for each in figures):
            rows.append([f"{way}, not found in", *(counted(each.missing, "volume") for each in figures)])
    if table.human is not None:
        of_people = table.human.targets
        cells = [mean_and_deviation(of_people.get(name), decimals_of(name) + 1) for name in targets]
        rows.append([f"annotators by {table.human.method}, from the mean of all", *cells])
    return rows


def _shares(table: ErrorTable) -> list[str]:
    said = [
        ("keypoints more than 2 mm off, or not found", table.by_formulas.far_share),
        ("keypoints of the fitted pose more than 2 mm off, or untold", table.by_fit.far_share),
        ("keypoints that were not found", table.missing_share),
        ("keypoints out of view", table.out_of_view_share),
    ]
    if table.rightly_out_of_range_share:
        said.append(("keypoints rightly said to be out of range", table.rightly_out_of_range_share))
    return [f"  {words}: {share:.1%}" for words, share in said if share is not None]


def _trained_on(table: ErrorTable) -> list[str]:
    if not table.trained_on:
        return []
    return [f"  left out: {counted(table.trained_on, 'volume')} that the network was trained on"]


def _keypoint_rows(table: ErrorTable) -> list[list[str]]:
    return [
        [
            name,
            mean_and_deviation(figures, 0),
            mean_and_deviation(table.by_fit.keypoints_um.get(name), 0),
        ]
        for name, figures in table.by_formulas.keypoints_um.items()
    ]


def _grid(titles: list[str], rows: list[list[str]]) -> list[str]:
    """Lay cells out in columns, divided as in the published tables."""
    widths = [max(len(row[place]) for row in [titles, *rows]) for place in range(len(titles))]
    return [
        "  " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in [titles, *rows]
    ]
