"""An agreement as tidy CSV files: one observation a row, with its unit; an absent number is an empty cell."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence

from annotations.agreement.report.labels import STATISTICS
from annotations.agreement.results import Agreement, Estimate, Figures, MethodResult, Statistics

Cell = str | int | float | None
Row = tuple[Cell, ...]

_UNITS = ("um", "deg")
_ESTIMATE = ("mean", "sd", "ci95_low", "ci95_high", "n")
_VARIANTS = ("main", "without_doubtful", "with_not_blind", "with_from_prediction", "without_mistakes")

FILES: dict[str, tuple[str, ...]] = {
    "targets.csv": ("method", "target", "unit", "statistic", "variant", *_ESTIMATE),
    "keypoints.csv": ("method", "keypoint", "part", "unit", "statistic", "variant", *_ESTIMATE),
    "annotators.csv": ("method", "annotator", "quantity", "of", "unit", *_ESTIMATE),
    "outliers.csv": ("method", "annotator", "volume", "target", "unit", "distance", "limit"),
    "pairs.csv": (
        "method",
        "first",
        "second",
        "component",
        "unit",
        "bias",
        "bias_ci95_low",
        "bias_ci95_high",
        "sd",
        "limit_low",
        "limit_low_ci95_low",
        "limit_low_ci95_high",
        "limit_high",
        "limit_high_ci95_low",
        "limit_high_ci95_high",
        "n",
    ),
    "reliability.csv": ("method", "component", "icc", "ci95_low", "ci95_high", "n", "annotators"),
    "intra.csv": ("method", "annotator", "target", "unit", *_ESTIMATE),
    "volumes.csv": (
        "method",
        "volume",
        "annotators",
        "target",
        "unit",
        "deviation",
        "ratio_to_median",
        "reasons",
        "mistaken",
    ),
    "turned_boxes.csv": ("method", "volume", "link", "annotator"),
    "counts.csv": ("method", "annotator", "what", "count"),
    "method_comparison.csv": ("target", "unit", *_ESTIMATE, "test", "p_value", "effect"),
    "left_out.csv": ("path", "files", "reason"),
    "inputs.csv": ("path", "volume", "annotator", "method", "repeat", "status", "sha256"),
}
"""What the files are called, and their columns."""


def csv_files(agreement: Agreement) -> dict[str, bytes]:
    """Return the content of each of `FILES`, by its name, UTF-8.

    Numbers are written so that reading them gives the same numbers again.
    """
    rows: dict[str, Iterable[Row]] = {
        "targets.csv": _targets(agreement),
        "keypoints.csv": _keypoints(agreement),
        "annotators.csv": _annotators(agreement),
        "outliers.csv": _outliers(agreement),
        "pairs.csv": _pairs(agreement),
        "reliability.csv": _reliability(agreement),
        "intra.csv": _intra(agreement),
        "volumes.csv": _volumes(agreement),
        "turned_boxes.csv": _turned_boxes(agreement),
        "counts.csv": _counts(agreement),
        "method_comparison.csv": _method_comparison(agreement),
        "left_out.csv": ((each.path, each.files, each.reason) for each in agreement.left_out),
        "inputs.csv": (
            (each.path, each.volume, each.annotator, each.method, each.repeat, each.status, each.sha256)
            for each in agreement.inputs
        ),
    }
    return {name: csv_bytes(columns, rows[name]) for name, columns in FILES.items()}


def csv_bytes(columns: Sequence[str], rows: Iterable[Row]) -> bytes:
    """Return rows under their headings as CSV, UTF-8; None is an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue().encode("utf-8", "backslashreplace")


def _unit(name: str) -> str:
    """Return the unit of a target or component, which its name ends in, in plain letters."""
    ending = name.rpartition("_")[2]
    return ending if ending in _UNITS else ""


def _figures(value: Estimate) -> Row:
    low, high = value.ci95 or (None, None)
    return (value.mean, value.sd, low, high, value.n)


def _variants(result: MethodResult) -> Iterator[tuple[str, Figures]]:
    selections = (
        result,
        result.without_doubtful,
        result.with_not_blind,
        result.with_from_prediction,
        result.without_mistakes,
    )
    for variant, figures in zip(_VARIANTS, selections, strict=True):
        if figures is not None:
            yield variant, figures


def _statistics(statistics: Statistics) -> Iterator[tuple[str, Estimate]]:
    for name in STATISTICS:
        yield name, getattr(statistics, name)


def _targets(agreement: Agreement) -> Iterator[Row]:
    for method, result in agreement.methods.items():
        for variant, figures in _variants(result):
            for target, statistics in figures.targets.items():
                for name, value in _statistics(statistics):
                    yield (method, target, _unit(target), name, variant, *_figures(value))


def _keypoints(agreement: Agreement) -> Iterator[Row]:
    for method, result in agreement.methods.items():
        for variant, figures in _variants(result):
            for keypoint, deviation in figures.keypoints.items():
                for part in ("distance", "along", "across"):
                    statistics = getattr(deviation, f"{part}_um")
                    if statistics is not None:
                        for name, value in _statistics(statistics):
                            yield (method, keypoint, part, "um", name, variant, *_figures(value))


def _annotators(agreement: Agreement) -> Iterator[Row]:
    for method, result in agreement.methods.items():
        for each in result.annotators:
            for target, value in each.deviation.items():
                yield (method, each.annotator, "deviation", target, _unit(target), *_figures(value))
            for component, value in each.bias.items():
                yield (method, each.annotator, "bias", component, _unit(component), *_figures(value))
            yield (method, each.annotator, "active_time", "volume", "s", *_figures(each.active_seconds))


def _outliers(agreement: Agreement) -> Iterator[Row]:
    for method, result in agreement.methods.items():
        for each in result.annotators:
            for found in each.outliers:
                unit = _unit(found.target)
                yield (method, each.annotator, found.volume, found.target, unit, found.value, found.limit)


def _pairs(agreement: Agreement) -> Iterator[Row]:
    nothing = (None, None)
    for method, result in agreement.methods.items():
        for pair in result.pairs:
            for component, found in pair.components.items():
                low, high = found.limits or nothing
                yield (
                    method,
                    pair.first,
                    pair.second,
                    component,
                    _unit(component),
                    found.bias,
                    *(found.bias_ci95 or nothing),
                    found.sd,
                    low,
                    *(found.low_ci95 or nothing),
                    high,
                    *(found.high_ci95 or nothing),
                    found.n,
                )


def _reliability(agreement: Agreement) -> Iterator[Row]:
    for method, result in agreement.methods.items():
        for component, found in result.reliability.items():
            low, high = found.ci95 or (None, None)
            yield (method, component, found.icc, low, high, found.n, len(found.annotators))


def _intra(agreement: Agreement) -> Iterator[Row]:
    for method, result in agreement.methods.items():
        for each in result.intra:
            for target, value in each.targets.items():
                yield (method, each.annotator, target, _unit(target), *_figures(value))


def _volumes(agreement: Agreement) -> Iterator[Row]:
    for method, result in agreement.methods.items():
        for volume in result.volumes:
            reasons = "; ".join(volume.reasons)
            for target in agreement.targets:
                yield (
                    method,
                    volume.volume,
                    len(volume.annotators),
                    target,
                    _unit(target),
                    volume.targets.get(target),
                    volume.ratio_to_median,
                    reasons,
                    "; ".join(volume.mistaken),
                )


def _turned_boxes(agreement: Agreement) -> Iterator[Row]:
    for method, result in agreement.methods.items():
        for box in result.turned_boxes:
            for annotator in box.annotators:
                yield (method, box.volume, box.link, annotator)


def _counts(agreement: Agreement) -> Iterator[Row]:
    for method, result in agreement.methods.items():
        for what, count in result.counts.model_dump(exclude={"volumes_by_annotators"}).items():
            yield (method, None, what, count)
        for annotators, volumes in result.counts.volumes_by_annotators.items():
            yield (method, None, f"volumes_of_{annotators}_annotators", volumes)
        for each in result.annotators:
            for what in ("documents", "done", "not_blind", "from_prediction"):
                yield (method, each.annotator, what, getattr(each, what))


def _method_comparison(agreement: Agreement) -> Iterator[Row]:
    for target, found in agreement.method_comparison.items():
        yield (
            target,
            _unit(target),
            *_figures(found.difference),
            found.test,
            found.p_value,
            found.effect,
        )
