"""The tables of a report on errors, as text in cells."""

from collections.abc import Mapping, Sequence

from annotations.agreement.report.contents import Table
from annotations.agreement.report.file_tables import MOST_ROWS, cut
from annotations.agreement.report.labels import NOTHING, counted, listed, moment
from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable, HumanFloor
from annotations.prediction.errors.error_text import column_title, decimals_of, mean_and_deviation
from annotations.prediction.errors.prediction_errors import ErrorFigures, ErrorOverview
from annotations.prediction.errors.ranking import RankedVolume
from annotations.prediction.report.material import VERDICTS, JudgedCheckpoint, ReportMaterial

BY_FORMULAS, BY_FIT = "predicted keypoints", "fitted pose"
"""The two ways to an error: by the published formulas, and of the pose that was fitted."""

WORST_VOLUMES = 20


def targets_of(tables: Sequence[ErrorTable]) -> tuple[str, ...]:
    """Return the names of the targets that any checkpoint has, in the order in which they are shown."""
    return tuple(dict.fromkeys(name for table in tables for name in table.by_formulas.targets))


def main_table(material: ReportMaterial) -> Table:
    """Return the errors in the layout in which those of networks were published."""
    targets = targets_of(material.tables)
    rows = [
        (f"{name}, {way}", *_cells(overview.targets, targets)) for name, way, overview in _overviews(material)
    ]
    rows += [(title, *_cells(floor.targets, targets, more_decimals=1)) for title, floor in _floors(material)]
    return Table(
        "Errors of the predictions: mean ± standard deviation (n − 1) over the volumes.",
        ("", *map(column_title, targets)),
        tuple(rows),
        is_main=True,
    )


def spread_table(material: ReportMaterial) -> Table:
    """Return what a mean does not say: median, the 95th percentile, and where nothing was found."""
    rows = [
        (
            column_title(target),
            name,
            way,
            _number(figures.mean, decimals_of(target)),
            _number(figures.sd, decimals_of(target)),
            _number(figures.median, decimals_of(target)),
            _number(figures.p95, decimals_of(target)),
            f"{figures.n:,}",
            f"{figures.missing:,}",
        )
        for target in targets_of(material.tables)
        for name, way, overview in _overviews(material)
        for figures in [overview.targets.get(target, ErrorFigures())]
    ]
    return Table(
        "The same errors with their median and 95th percentile, over n volumes. “Not found”: volumes in "
        "which the annotation tells the target and the prediction does not; they are in none of the figures.",
        ("Target", "Checkpoint", "By", "Mean", "SD", "Median", "95 %", "n", "Not found"),
        tuple(rows),
        words=frozenset({1, 2}),
    )


def shares_table(material: ReportMaterial) -> Table:
    """Return what share of the keypoints goes astray."""
    tables = material.tables
    lines: tuple[tuple[str, Sequence[float | None]], ...] = (
        ("More than 2 mm off, or not found", [each.by_formulas.far_share for each in tables]),
        ("… of the fitted pose, or not told by it", [each.by_fit.far_share for each in tables]),
        ("Not found", [each.missing_share for each in tables]),
        ("Outside of the volume", [each.out_of_view_share for each in tables]),
        (
            "Beyond the range of the network, which says so",
            [each.rightly_out_of_range_share for each in tables],
        ),
    )
    return Table(
        "Shares of the keypoints that the annotations have.",
        ("", *material.names),
        tuple((words, *(_share(value) for value in values)) for words, values in lines),
    )


def keypoints_table(material: ReportMaterial) -> Table:
    """Return the distance of each keypoint, by checkpoint and way."""
    overviews = [overview for _, _, overview in _overviews(material)]
    names = tuple(dict.fromkeys(name for each in overviews for name in each.keypoints_um))
    rows = [
        (name, *(mean_and_deviation(each.keypoints_um.get(name), 0) for each in overviews)) for name in names
    ]
    rows.append(("All", *(mean_and_deviation(each.all_keypoints_um, 0) for each in overviews)))
    return Table(
        "Distance of each keypoint from its true place, in µm: mean ± standard deviation over the volumes.",
        ("Keypoint", *([BY_FORMULAS, BY_FIT] * len(material.checkpoints))),
        tuple(rows),
        groups=(("", 1), *((name, 2) for name in material.names)),
    )


def ranking_table(checkpoint: JudgedCheckpoint, name: str) -> Table | None:
    """Return the volumes that need a look first; None where there is none."""
    if not checkpoint.ranking:
        return None
    targets = targets_of([checkpoint.table])
    errors = {row.volume: row for row in checkpoint.table.rows}
    verdicts = checkpoint.verdicts_in_words
    has_people = any(each.floors for each in checkpoint.ranking)
    shown = checkpoint.ranking[:WORST_VOLUMES]
    has_begun = any(errors[each.volume].begun_from for each in shown)
    rows = []
    for ranked in shown:
        row = errors[ranked.volume]
        times = ranked.ratio if has_people else ranked.ratio_to_median
        rows.append(
            (
                ranked.volume,
                NOTHING if times is None else f"{times:,.1f}",
                NOTHING if ranked.target is None else column_title(ranked.target),
                *(_beside_floor(row, ranked, target) for target in targets),
                _number(row.mean_keypoint_um, 0),
                f"{row.presence:.0%}",
                ", ".join(ranked.missing) or NOTHING,
                "; ".join(verdicts.get(ranked.volume, ())) or NOTHING,
                *([listed(list(row.begun_from)) or NOTHING] if has_begun else ()),
            )
        )
    share = f"{len(rows)} of {counted(len(checkpoint.ranking), 'volume')}"
    return Table(
        f"{name}: the volumes that need a look first ({share}). "
        + (
            "First those with keypoints that were not found, then by how many times further the checkpoint "
            "is from the truth than another person would be; how far that is stands in brackets."
            if has_people
            else "How far people are apart is not known: they stand by their largest error relative to its "
            "median over the volumes."
        )
        + (
            " “Begun from”: the checkpoint from whose prediction the annotation was begun; such a volume "
            "counts in no figure."
            if has_begun
            else ""
        ),
        (
            "Volume",
            "× people" if has_people else "× median",
            "Most in",
            *map(column_title, targets),
            "keypoints (µm)",
            "Confidence",
            "Not found",
            "Verdicts",
            *(["Begun from"] if has_begun else ()),
        ),
        tuple(rows),
        words=frozenset({2, len(targets) + 5, len(targets) + 6, *([len(targets) + 7] if has_begun else ())}),
    )


def verdict_counts_table(material: ReportMaterial) -> Table | None:
    """Return how often reviewers found whom wrong; None where nobody has said anything."""
    rows = []
    for name, checkpoint in zip(material.names, material.checkpoints, strict=True):
        for said in checkpoint.verdicts:
            given = [each.verdict for each in said.verdicts]
            outdated = sum(map(checkpoint.is_outdated, said.verdicts))
            counts = [*(given.count(verdict) for verdict in VERDICTS), len(given), outdated]
            rows.append((name, said.reviewer, *(f"{count:,}" for count in counts)))
    if not rows:
        return None
    return Table(
        "Verdicts of the reviewers: in how many volumes the annotation, the checkpoint, both or neither is "
        "wrong. “Outdated”: annotation or prediction have changed since.",
        ("Checkpoint", "Reviewer", *VERDICTS.values(), "All", "Outdated"),
        tuple(rows),
        words=frozenset({1}),
    )


def verdicts_table(material: ReportMaterial) -> Table | None:
    """Return every verdict with its note; None where nobody has said anything."""
    rows = [
        (
            each.volume,
            name,
            said.reviewer,
            VERDICTS[each.verdict] + (", outdated" if checkpoint.is_outdated(each) else ""),
            each.annotator,
            each.note or NOTHING,
            moment(each.moment),
        )
        for name, checkpoint in zip(material.names, material.checkpoints, strict=True)
        for said in checkpoint.verdicts
        for each in said.verdicts
    ]
    if not rows:
        return None
    return Table(
        f"Every verdict{cut(len(rows))}.",
        ("Volume", "Checkpoint", "Reviewer", "Verdict", "Annotation of", "Note", "Given"),
        tuple(rows[:MOST_ROWS]),
        words=frozenset({1, 2, 3, 4, 5, 6}),
    )


def left_out_table(material: ReportMaterial) -> Table | None:
    """Return the volumes that were not judged, and why; None where there is none."""
    rows = [
        (each.volume, name, each.reason)
        for name, table in zip(material.names, material.tables, strict=True)
        for each in table.unjudged
    ]
    if not rows:
        return None
    return Table(
        f"Volumes that were not judged{cut(len(rows))}.",
        ("Volume", "Checkpoint", "Reason"),
        tuple(rows[:MOST_ROWS]),
        words=frozenset({1, 2}),
    )


def _overviews(material: ReportMaterial) -> list[tuple[str, str, ErrorOverview]]:
    """Return the name, the way and the figures of each row of a table."""
    return [
        (name, way, overview)
        for name, table in zip(material.names, material.tables, strict=True)
        for way, overview in ((BY_FORMULAS, table.by_formulas), (BY_FIT, table.by_fit))
    ]


def _floors(material: ReportMaterial) -> list[tuple[str, HumanFloor]]:
    """Return how far people are apart, once where that is the same for all checkpoints."""
    known = [
        (name, table.human)
        for name, table in zip(material.names, material.tables, strict=True)
        if table.human is not None
    ]
    if not known:
        return []
    words = f"Annotators by {known[0][1].method}, from the mean of all"
    if all(floor.targets == known[0][1].targets for _, floor in known):
        return [(words, known[0][1])]
    return [(f"{words}, on the volumes of {name}", floor) for name, floor in known]


def _cells(
    figures: Mapping[str, ErrorFigures], targets: Sequence[str], more_decimals: int = 0
) -> tuple[str, ...]:
    return tuple(
        mean_and_deviation(figures.get(target), decimals_of(target) + more_decimals) for target in targets
    )


def _beside_floor(row: ErrorsOfVolume, ranked: RankedVolume, target: str) -> str:
    """Return an error, and in brackets how far another person would be from the truth."""
    decimals = decimals_of(target)
    error = _number(row.targets.get(target), decimals)
    return f"{error} ({_number(ranked.floors[target], decimals + 1)})" if target in ranked.floors else error


def _number(value: float | None, decimals: int) -> str:
    return NOTHING if value is None else f"{value:,.{decimals}f}"


def _share(value: float | None) -> str:
    return NOTHING if value is None else f"{value:.1%}"
