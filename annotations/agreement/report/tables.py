"""The tables of a report, as text in cells."""

from collections.abc import Iterable, Mapping, Sequence

from annotations.agreement.report.contents import Table
from annotations.agreement.report.file_tables import MOST_ROWS, cut
from annotations.agreement.report.labels import (
    METHODS,
    NOTHING,
    STATISTICS,
    counted,
    duration,
    estimate,
    interval,
    label_of,
    methods_of,
    number,
    p_value,
    ratio,
    signed_number,
    unit_of,
    with_unit,
)
from annotations.agreement.results import Agreement, Estimate, Figures, StatisticName, Statistics
from annotations.documents.record import Method

WORST_VOLUMES = 20


def main_table(agreement: Agreement) -> Table:
    """Return the deviations in the layout in which they were published: targets by methods."""
    return _targets_by_methods(
        agreement,
        ("published",),
        "Deviation from the mean of all annotators: mean over the volumes [95 % confidence interval].",
        dict(agreement.methods),
        is_main=True,
    )


def main_table_without_mistakes(agreement: Agreement) -> Table | None:
    """Return the same figures without recognised mistakes; None where none was recognised."""
    return variant_table(
        agreement,
        "without_mistakes",
        "Deviation from the mean of all annotators without the annotations in which a mistake was "
        "recognised: mean over the volumes [95 % confidence interval].",
        ("published",),
    )


def all_statistics_table(agreement: Agreement) -> Table:
    """Return all three statistics, targets by methods."""
    return _targets_by_methods(
        agreement,
        tuple(STATISTICS),
        "The three statistics: mean over the volumes [95 % confidence interval].",
        dict(agreement.methods),
    )


def spread_table(agreement: Agreement) -> Table:
    """Return mean, standard deviation and number of volumes of each statistic."""
    rows = [
        (
            f"{label_of(target)}, {STATISTICS[name].lower()}",
            METHODS[method],
            unit_of(target),
            number(value.mean, unit_of(target)),
            number(value.sd, unit_of(target)),
            interval(value.ci95, unit_of(target)) or NOTHING,
            f"{value.n:,}",
        )
        for target in agreement.targets
        for name in STATISTICS
        for method in methods_of(agreement)
        for value in [_statistic(agreement.methods[method], target, name)]
    ]
    return Table(
        "Every statistic with its standard deviation (n − 1) over the volumes and their number n.",
        ("Target and statistic", "Method", "Unit", "Mean", "SD", "95 % interval", "n"),
        tuple(rows),
        words=frozenset({1, 2}),
    )


def variant_table(
    agreement: Agreement, variant: str, caption: str, names: Sequence[StatisticName] = tuple(STATISTICS)
) -> Table | None:
    """Return the statistics of another selection of points or documents; None where there is none.

    Parameters
    ----------
    variant : str
        ``without_mistakes``, ``without_doubtful``, ``with_not_blind`` or ``with_from_prediction``, as
        `MethodResult` names them.
    names : sequence of str
        Which statistics.
    """
    figures: dict[Method, Figures] = {
        method: found
        for method in methods_of(agreement)
        if (found := getattr(agreement.methods[method], variant)) is not None
    }
    return _targets_by_methods(agreement, names, caption, figures) if figures else None


def annotators_table(agreement: Agreement, method: Method) -> Table:
    """Return how much each annotator did, how far from the others, and how fast."""
    annotators = agreement.methods[method].annotators
    seen = any(each.not_blind for each in annotators)
    begun = any(each.from_prediction for each in annotators)
    rows = [
        (
            each.annotator,
            f"{each.documents:,}",
            f"{each.done:,}",
            *([f"{each.not_blind:,}"] if seen else []),
            *([f"{each.from_prediction:,}"] if begun else []),
            *(_estimate(each.deviation, target) for target in agreement.targets),
            f"{len(each.outliers):,}",
            duration(each.active_seconds.mean),
        )
        for each in annotators
    ]
    return Table(
        f"{METHODS[method]}: leave-one-out deviation of each annotator, that is the distance from the mean "
        "of the others, mean over the volumes [95 % confidence interval]; outliers; and active time on a "
        f"volume.{_left_out_of_these(seen, begun)}",
        (
            "Annotator",
            "Annotations",
            "Done",
            *(["Not blind"] if seen else []),
            *(["From predictions"] if begun else []),
            *map(with_unit, agreement.targets),
            "Outliers",
            "Time per volume",
        ),
        tuple(rows),
    )


def _left_out_of_these(seen: bool, begun: bool) -> str:
    kinds = [
        *(["that are not blind"] if seen else []),
        *(["that were begun from a network's prediction"] if begun else []),
    ]
    return f" Those {' and those '.join(kinds)} are left out of everything else here." if kinds else ""


def bias_table(agreement: Agreement, method: Method) -> Table:
    """Return the signed mean difference of each annotator from the mean of the others, by component."""
    rows = []
    for each in agreement.methods[method].annotators:
        cells = []
        for component in agreement.components:
            value, unit = each.bias.get(component, Estimate()), unit_of(component)
            cells.append(f"{signed_number(value.mean, unit)} {interval(value.ci95, unit)}".strip())
        rows.append((each.annotator, *cells))
    return Table(
        f"{METHODS[method]}: bias of each annotator, the signed mean difference from the mean of the others "
        "[95 % confidence interval].",
        ("Annotator", *map(with_unit, agreement.components)),
        tuple(rows),
    )


def scatter_table(agreement: Agreement, method: Method) -> Table:
    """Return how much each annotator's differences from the mean of the others scatter, by component."""
    return Table(
        f"{METHODS[method]}: spread of each annotator, the standard deviation (n − 1), over the volumes, of "
        "the signed differences from the mean of the others.",
        ("Annotator", *map(with_unit, agreement.components)),
        tuple(
            (
                each.annotator,
                *(
                    number(each.bias.get(component, Estimate()).sd, unit_of(component))
                    for component in agreement.components
                ),
            )
            for each in agreement.methods[method].annotators
        ),
    )


def outliers_table(agreement: Agreement, method: Method) -> Table | None:
    """Return the volumes that an annotator has much further from the others than usual."""
    found = [
        (each.annotator, outlier)
        for each in agreement.methods[method].annotators
        for outlier in each.outliers
    ]
    if not found:
        return None
    rows = [
        (
            annotator,
            outlier.volume,
            with_unit(outlier.target),
            number(outlier.value, unit_of(outlier.target)),
            number(outlier.limit, unit_of(outlier.target)),
        )
        for annotator, outlier in found[:MOST_ROWS]
    ]
    return Table(
        f"{METHODS[method]}: outliers, where an annotator is much further from the mean of the others than "
        f"usual{cut(len(found))}.",
        ("Annotator", "Volume", "Target", "Distance", "Limit"),
        tuple(rows),
        words=frozenset({1, 2}),
    )


def keypoints_table(agreement: Agreement, method: Method) -> Table:
    """Return the deviation at each keypoint, whole, along and across its link."""
    rows = []
    for name, keypoint in agreement.methods[method].keypoints.items():
        whole = keypoint.distance_um
        parts = [part.published if part else Estimate() for part in (keypoint.along_um, keypoint.across_um)]
        estimates = [whole.published, whole.leave_one_out, whole.pairwise, *parts]
        rows.append((name, *(estimate(each, "µm") for each in estimates), f"{whole.published.n:,}"))
    return Table(
        f"{METHODS[method]}: deviation at each keypoint in µm, mean over the volumes [95 % confidence "
        "interval]. The parts along and across the axis of the keypoint's link are those of the deviation "
        "from the mean of all.",
        ("Keypoint", "From the mean of all", "Leave-one-out", "Pairwise", "Along", "Across", "n"),
        tuple(rows),
    )


def intra_table(agreement: Agreement) -> Table | None:
    """Return how far annotators are from themselves."""
    rows = [
        (
            each.annotator or "All together",
            METHODS[method],
            *(_estimate(each.targets, target) for target in agreement.targets),
            f"{max((value.n for value in each.targets.values()), default=0):,}",
        )
        for method in methods_of(agreement)
        for each in agreement.methods[method].intra
    ]
    if not rows:
        return None
    return Table(
        "Deviation of annotators from themselves: mean distance between repeated passes over the same "
        "volume [95 % confidence interval].",
        ("Annotator", "Method", *map(with_unit, agreement.targets), "n"),
        tuple(rows),
        words=frozenset({1}),
    )


def comparison_table(agreement: Agreement) -> Table | None:
    """Return keypoints against boxes."""
    if not agreement.method_comparison:
        return None
    rows = []
    for target in agreement.targets:
        if (found := agreement.method_comparison.get(target)) is not None:
            unit, value = unit_of(target), found.difference
            rows.append(
                (
                    with_unit(target),
                    f"{signed_number(value.mean, unit)} {interval(value.ci95, unit)}".strip(),
                    f"{value.n:,}",
                    found.test,
                    p_value(found.p_value),
                    ratio(found.effect),
                )
            )
    return Table(
        "Keypoints minus bounding boxes on the same volumes, in the deviation from the mean of all: mean "
        "difference [95 % confidence interval], paired test, and effect (matched-pairs rank-biserial "
        "correlation; 1 where keypoints are further apart on every volume, −1 where boxes are). The p-values "
        "are each target's own, not adjusted for their number.",
        ("Target", "Difference", "n", "Test", "p", "Effect"),
        tuple(rows),
        words=frozenset({3}),
    )


def volumes_table(agreement: Agreement, method: Method) -> Table | None:
    """Return the volumes on which the annotators are furthest apart, with reasons."""
    volumes = [volume for volume in agreement.methods[method].volumes if volume.targets]
    if not volumes:
        return None
    worst = sorted(volumes, key=lambda volume: volume.ratio_to_median, reverse=True)[:WORST_VOLUMES]
    rows = [
        (
            volume.volume,
            f"{len(volume.annotators)}",
            f"{volume.ratio_to_median:.1f}",
            *(number(volume.targets.get(target), unit_of(target)) for target in agreement.targets),
            "; ".join(volume.reasons) or NOTHING,
        )
        for volume in worst
    ]
    reasons = len(agreement.targets) + 3
    return Table(
        f"{METHODS[method]}: the volumes on which the annotators are furthest apart, the worst first "
        f"({len(worst)} of {counted(len(volumes), 'volume')}), with the deviation from the mean of all. "
        "They are sorted by the ratio: the largest of a target's deviation to its median over the volumes.",
        ("Volume", "Annotators", "Ratio", *map(with_unit, agreement.targets), "Why"),
        tuple(rows),
        words=frozenset({reasons}),
    )


def _targets_by_methods(
    agreement: Agreement,
    names: Sequence[StatisticName],
    caption: str,
    figures: Mapping[Method, Figures],
    *,
    is_main: bool = False,
) -> Table:
    methods = [method for method in METHODS if method in figures]
    rows = [
        (
            with_unit(target),
            *(
                estimate(_statistic(figures[method], target, name), unit_of(target))
                for name in names
                for method in methods
            ),
        )
        for target in agreement.targets
    ]
    counts = [
        _volumes(_statistic(figures[method], target, name) for target in agreement.targets)
        for name in names
        for method in methods
    ]
    return Table(
        caption,
        ("Target", *(METHODS[method] for _ in names for method in methods)),
        (*rows, ("Volumes (n)", *counts)),
        groups=(("", 1), *((STATISTICS[name], len(methods)) for name in names)) if len(names) > 1 else (),
        is_main=is_main,
    )


def _statistic(figures: Figures, target: str, name: StatisticName) -> Estimate:
    found: Estimate = getattr(figures.targets.get(target, Statistics()), name)
    return found


def _volumes(estimates: Iterable[Estimate]) -> str:
    """Return over how many volumes; from the fewest to the most where targets differ in it."""
    numbers = [value.n for value in estimates]
    if not numbers:
        return "0"
    low, high = min(numbers), max(numbers)
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"


def _estimate(values: Mapping[str, Estimate], name: str) -> str:
    return estimate(values.get(name, Estimate()), unit_of(name))
