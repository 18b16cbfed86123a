"""The errors of checkpoints as CSV files: one observation a row, units in the headings."""

from collections.abc import Iterator, Mapping, Sequence

from annotations.agreement.report.csv_report import Cell, Row, csv_bytes
from annotations.agreement.results import Estimate
from annotations.prediction.errors.error_table import ErrorsOfVolume
from annotations.prediction.errors.prediction_errors import ErrorFigures
from annotations.prediction.report.material import JudgedCheckpoint, ReportMaterial
from annotations.prediction.report.paired_table import paired_rows
from annotations.prediction.report.tables import targets_of
from annotations.prediction.verdicts.verdict_csv import verdicts_csv
from annotations.prediction.verdicts.verdicts import VerdictList

FILES = (
    "volumes.csv",
    "targets.csv",
    "keypoints.csv",
    "shares.csv",
    "paired.csv",
    "verdicts.csv",
    "left_out.csv",
    "checkpoints.csv",
)
"""What the files are called."""

_FIGURES = ("mean", "sd", "median", "p95", "n", "not_found")
_PAIRED = (
    "error",
    "unit",
    "by",
    "checkpoint",
    "mean",
    "sd",
    "ci95_low",
    "ci95_high",
    "n",
    "absent",
    "difference",
    "difference_ci95_low",
    "difference_ci95_high",
    "test",
    "p_value",
    "effect",
)
_SEVERAL = "; "


def csv_files(material: ReportMaterial) -> dict[str, bytes]:
    """Return the content of each of `FILES`, by its name, UTF-8.

    Numbers are written so that reading them gives the same numbers again.
    """
    tables: dict[str, tuple[Sequence[str], Iterator[Row]]] = {
        "volumes.csv": (_volume_columns(material), _volumes(material)),
        "targets.csv": (("checkpoint", "by", "target", "unit", *_FIGURES), _targets(material)),
        "keypoints.csv": (("checkpoint", "by", "keypoint", "unit", *_FIGURES), _keypoints(material)),
        "shares.csv": (("checkpoint", "what", "share"), _shares(material)),
        "paired.csv": (_PAIRED, _paired(material)),
        "left_out.csv": (("checkpoint", "volume", "reason"), _left_out(material)),
        "checkpoints.csv": (
            ("checkpoint", "sha256", "path", "volumes", "begun_from_predictions", "trained_on"),
            _checkpoints(material),
        ),
    }
    files = {name: csv_bytes(columns, rows) for name, (columns, rows) in tables.items()}
    return {**files, "verdicts.csv": verdicts_csv(_lists(material), material.tables)}


def _each(material: ReportMaterial) -> Iterator[tuple[str, JudgedCheckpoint]]:
    return zip(material.names, material.checkpoints, strict=True)


def _volume_columns(material: ReportMaterial) -> tuple[str, ...]:
    targets, keypoints = targets_of(material.tables), material.tool.keypoint_names
    return (
        "volume",
        "checkpoint",
        "annotation_of",
        "begun_from_prediction_of",
        "rank",
        "ratio_to_people",
        "ratio_to_median",
        "most_in",
        *targets,
        *(f"fit_{name}" for name in targets),
        *(f"floor_{name}" for name in targets),
        "mean_keypoint_um",
        *(f"{name}_um" for name in keypoints),
        *(f"fit_{name}_um" for name in keypoints),
        "presence",
        "spread_um",
        "residual_um",
        *(f"true_{angle.name}_deg" for angle in material.tool.targets.angles),
        "depth_um",
        "visible_share",
        "not_found",
        "rightly_out_of_range",
        "out_of_view",
        "left_out_of_fit",
        "verdicts",
    )


def _volumes(material: ReportMaterial) -> Iterator[Row]:
    targets, keypoints = targets_of(material.tables), material.tool.keypoint_names
    for name, checkpoint in _each(material):
        ranks = {ranked.volume: place for place, ranked in enumerate(checkpoint.ranking, start=1)}
        ranking = {ranked.volume: ranked for ranked in checkpoint.ranking}
        verdicts = checkpoint.verdicts_in_words
        for row in checkpoint.table.rows:
            ranked = ranking[row.volume]
            yield (
                row.volume,
                name,
                row.whose,
                _SEVERAL.join(row.begun_from),
                ranks[row.volume],
                ranked.ratio,
                ranked.ratio_to_median,
                ranked.target,
                *_picked(row.targets, targets),
                *_picked(row.targets_by_fit, targets),
                *_picked(ranked.floors, targets),
                row.mean_keypoint_um,
                *_picked(row.keypoints_um, keypoints),
                *_picked(row.keypoints_by_fit_um, keypoints),
                *_conditions(row, material),
                *map(_SEVERAL.join, (row.missing, row.rightly_out_of_range, row.out_of_view, row.left_out)),
                _SEVERAL.join(verdicts.get(row.volume, ())),
            )


def _conditions(row: ErrorsOfVolume, material: ReportMaterial) -> tuple[Cell, ...]:
    return (
        row.presence,
        row.spread_um,
        row.residual_um,
        *_picked(row.true_angles_deg, [angle.name for angle in material.tool.targets.angles]),
        row.depth_um,
        row.visible_share,
    )


def _targets(material: ReportMaterial) -> Iterator[Row]:
    for name, checkpoint in _each(material):
        table = checkpoint.table
        ways = [("keypoints", table.by_formulas.targets), ("fit", table.by_fit.targets)]
        if table.with_begun is not None:
            ways.append(("keypoints_with_begun", table.with_begun.targets))
        if table.human is not None:
            ways.append(("people", table.human.targets))
        for way, figures in ways:
            for target, value in figures.items():
                yield (name, way, target, target.rpartition("_")[2], *_figures(value))


def _keypoints(material: ReportMaterial) -> Iterator[Row]:
    for name, checkpoint in _each(material):
        table = checkpoint.table
        for way, overview in (("keypoints", table.by_formulas), ("fit", table.by_fit)):
            for keypoint, value in {**overview.keypoints_um, "": overview.all_keypoints_um}.items():
                yield (name, way, keypoint or None, "um", *_figures(value))


def _shares(material: ReportMaterial) -> Iterator[Row]:
    for name, checkpoint in _each(material):
        table = checkpoint.table
        yield (name, "far", table.by_formulas.far_share)
        yield (name, "far_by_fit", table.by_fit.far_share)
        for what in ("missing", "out_of_view", "rightly_out_of_range"):
            yield (name, what, getattr(table, f"{what}_share"))


def _paired(material: ReportMaterial) -> Iterator[Row]:
    nothing = (None, None)
    for row in paired_rows(material):
        error, compared = row.error, row.difference
        found = compared.difference if compared is not None else Estimate()
        yield (
            row.name,
            row.name.rpartition("_")[2],
            row.way,
            row.checkpoint,
            error.mean,
            error.sd,
            *(error.ci95 or nothing),
            error.n,
            row.absent,
            found.mean,
            *(found.ci95 or nothing),
            *((compared.test, compared.p_value, compared.effect) if compared is not None else (None,) * 3),
        )


def _lists(material: ReportMaterial) -> list[VerdictList]:
    """Return every list of verdicts once: checkpoints of the same name share theirs."""
    found = {
        (said.checkpoint, said.reviewer): said
        for checkpoint in material.checkpoints
        for said in checkpoint.verdicts
    }
    return list(found.values())


def _left_out(material: ReportMaterial) -> Iterator[Row]:
    for name, checkpoint in _each(material):
        for each in checkpoint.table.unjudged:
            yield (name, each.volume, each.reason)


def _checkpoints(material: ReportMaterial) -> Iterator[Row]:
    for name, checkpoint in _each(material):
        table = checkpoint.table
        known = table.checkpoint
        yield (
            name,
            known.sha256 if known else None,
            known.path if known else None,
            len(table.independent_rows),
            len(table.rows) - len(table.independent_rows),
            table.trained_on,
        )


def _figures(value: ErrorFigures) -> tuple[Cell, ...]:
    return (value.mean, value.sd, value.median, value.p95, value.n, value.missing)


def _picked(values: Mapping[str, float], names: Sequence[str]) -> tuple[Cell, ...]:
    return tuple(values.get(name) for name in names)
