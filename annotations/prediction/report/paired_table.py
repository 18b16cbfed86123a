"""Several checkpoints side by side, as a table."""

from collections.abc import Iterator
from dataclasses import dataclass

from annotations.agreement.report.contents import Table
from annotations.agreement.report.labels import NOTHING, counted, p_value, ratio
from annotations.agreement.results import Estimate, PairedTest
from annotations.prediction.errors.error_text import column_title, decimals_of
from annotations.prediction.report.material import ReportMaterial

IN_WORDS = (
    "A difference is the error of a checkpoint minus that of the first one in the same volume: below zero it "
    "is nearer to the truth. The effect is the matched-pairs rank-biserial correlation: −1 where it is "
    "nearer in every volume, 1 where the first one is."
)


@dataclass(frozen=True)
class PairedRow:
    """One kind of error of one checkpoint, over the volumes that all have.

    Attributes
    ----------
    name : str
        Of the error: a target's, that of a keypoint with ``_um``, or ``mean_keypoint_um``.
    way : str
        ``keypoints`` for the predicted ones by the published formulas, ``fit`` for the fitted pose's.
    checkpoint : str
    error : Estimate
    absent : int
        In how many volumes this checkpoint does not have it though another has.
    difference : PairedTest or None
        From the first checkpoint; None for that itself.
    """

    name: str
    way: str
    checkpoint: str
    error: Estimate
    absent: int
    difference: PairedTest | None


def paired_rows(material: ReportMaterial) -> Iterator[PairedRow]:
    """Yield everything that is known of checkpoints side by side."""
    paired = material.paired
    if paired is None:
        return
    names = {
        table.checkpoint.sha256: name
        for name, table in zip(material.names, material.tables, strict=True)
        if table.checkpoint is not None
    }
    checkpoints = [names[each.sha256] for each in paired.checkpoints]
    for way, overview in (("keypoints", paired.by_formulas), ("fit", paired.by_fit)):
        figures = {
            **overview.targets,
            "mean_keypoint_um": overview.mean_keypoint_um,
            **{f"{name}_um": figure for name, figure in overview.keypoints_um.items()},
        }
        for name, figure in figures.items():
            differences = (None, *figure.differences)
            yield from (
                PairedRow(name, way, *each)
                for each in zip(checkpoints, figure.errors, figure.absent, differences, strict=True)
            )


def paired_table(material: ReportMaterial) -> Table | None:
    """Return the errors of several checkpoints and their differences; None for a single one."""
    paired = material.paired
    if paired is None or len(paired.checkpoints) < 2:
        return None
    shown = (*paired.by_formulas.targets, "mean_keypoint_um")
    rows = [_cells(row) for row in paired_rows(material) if row.name in shown]
    others = f" {counted(len(paired.left_out), 'other')} not compared." if paired.left_out else ""
    first = material.names[0]
    return Table(
        f"Checkpoints on the same {counted(len(paired.volumes), 'volume')}, against the same annotations: "
        f"mean ± standard deviation, and difference from {first} with its 95 % confidence interval.{others}",
        ("Error", "Checkpoint", "By", "Mean ± SD", "n", "Difference", "95 % interval", "p", "Effect"),
        tuple(rows),
        words=frozenset({1, 2}),
    )


def _cells(row: PairedRow) -> tuple[str, ...]:
    decimals = 0 if row.name.endswith("_um") else decimals_of(row.name)
    spread = "" if row.error.sd is None else f" ± {row.error.sd:.{decimals}f}"
    title = "keypoints, mean (µm)" if row.name == "mean_keypoint_um" else column_title(row.name)
    cells = (
        title,
        row.checkpoint,
        "predicted keypoints" if row.way == "keypoints" else "fitted pose",
        NOTHING if row.error.mean is None else f"{row.error.mean:.{decimals}f}{spread}",
        f"{row.error.n:,}",
    )
    if row.difference is None:
        return (*cells, *[NOTHING] * 4)
    found, ends = row.difference.difference, NOTHING
    if found.ci95 is not None:
        ends = f"[{_signed(found.ci95[0], decimals + 1)}, {_signed(found.ci95[1], decimals + 1)}]"
    return (
        *cells,
        NOTHING if found.mean is None else _signed(found.mean, decimals + 1),
        ends,
        p_value(row.difference.p_value),
        ratio(row.difference.effect),
    )


def _signed(value: float, decimals: int) -> str:
    return f"{value:+z,.{decimals}f}".replace("-", "−")
