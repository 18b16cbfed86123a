"""What a report on the errors of checkpoints is made of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from annotations.geometry.tool import ToolSpecification
from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.errors.error_text import begun_text
from annotations.prediction.errors.paired_errors import PairedErrors, paired_errors
from annotations.prediction.errors.ranking import RankedVolume, rank
from annotations.prediction.errors.study_errors import Truth
from annotations.prediction.prediction import Prediction
from annotations.prediction.report.checkpoint_names import checkpoint_names
from annotations.prediction.verdicts.verdict_file import study_verdicts
from annotations.prediction.verdicts.verdicts import Verdict, VerdictList, VolumeVerdict, is_stale

VERDICTS: Mapping[Verdict, str] = {
    "annotation_wrong": "Annotation wrong",
    "model_wrong": "Model wrong",
    "both_wrong": "Both wrong",
    "neither_wrong": "Neither wrong",
}
"""What the verdicts are called."""


@dataclass(frozen=True, eq=False)
class JudgedCheckpoint:
    """A checkpoint in a report.

    Attributes
    ----------
    table : ErrorTable
    ranking : tuple of RankedVolume
        The volume that needs a look first comes first.
    predictions : mapping of str to Prediction
        By the volume's id; those of which there are none are not drawn.
    verdicts : tuple of VerdictList
        Of all reviewers.
    """

    table: ErrorTable
    ranking: tuple[RankedVolume, ...]
    predictions: Mapping[str, Prediction] = field(default_factory=dict)
    verdicts: tuple[VerdictList, ...] = ()

    def is_outdated(self, verdict: VolumeVerdict) -> bool:
        """Say whether the annotation or the prediction have changed since a verdict."""
        row = next((row for row in self.table.rows if row.volume == verdict.volume), None)
        return self.table.checkpoint is None or is_stale(verdict, row, self.table.checkpoint.sha256)

    @property
    def verdicts_in_words(self) -> Mapping[str, tuple[str, ...]]:
        """What reviewers said of each volume, by its id."""
        words: dict[str, tuple[str, ...]] = {}
        for said in self.verdicts:
            for each in said.verdicts:
                outdated = ", outdated" if self.is_outdated(each) else ""
                one = f"{VERDICTS[each.verdict].lower()} ({said.reviewer}{outdated})"
                words[each.volume] = (*words.get(each.volume, ()), one)
        return words


@dataclass(frozen=True, eq=False)
class ReportMaterial:
    """What a report is made of.

    Attributes
    ----------
    tool : ToolSpecification
        Of the study, or of the checkpoint where there is none.
    truth : Truth
        Whose annotations were taken for the truth: they are read again for the pictures.
    checkpoints : tuple of JudgedCheckpoint
        The first is the one that others are compared with.
    paired : PairedErrors or None
        None where fewer than two of them are judged on any volume.
    remarks : tuple of str
        What a reader should not miss, as sentences without a full stop.
    """

    tool: ToolSpecification
    truth: Truth
    checkpoints: tuple[JudgedCheckpoint, ...]
    paired: PairedErrors | None = None
    remarks: tuple[str, ...] = ()

    @property
    def sentences(self) -> tuple[str, ...]:
        """The remarks as they are read."""
        return tuple(f"{remark[:1].upper()}{remark[1:]}." for remark in self.remarks)

    @property
    def tables(self) -> tuple[ErrorTable, ...]:
        """Of each checkpoint."""
        return tuple(each.table for each in self.checkpoints)

    @property
    def names(self) -> tuple[str, ...]:
        """What the checkpoints are called, no two alike."""
        return checkpoint_names(self.tables)


def report_material(
    tool: ToolSpecification,
    truth: Truth,
    tables: Sequence[ErrorTable],
    predictions: Sequence[Mapping[str, Prediction]],
    folder: Path | None = None,
    *,
    remarks: Sequence[str] = (),
) -> ReportMaterial:
    """Return what a report on tables of errors is made of.

    Parameters
    ----------
    tool, truth, remarks
        As in `ReportMaterial`.
    tables : sequence of ErrorTable
        One a checkpoint.
    predictions : sequence of (mapping of str to Prediction)
        Of the same checkpoints.
    folder : Path, optional
        The study's, which keeps the verdicts.

    Verdicts that cannot be read become a remark, and so do annotations that were begun from a prediction.
    """
    said_besides = list(remarks)
    checkpoints = []
    for table, predicted in zip(tables, predictions, strict=True):
        said: tuple[VerdictList, ...] = ()
        if folder is not None and table.checkpoint is not None:
            said, problems = study_verdicts(folder, table.checkpoint.name, table.checkpoint.sha256)
            said_besides += [f"Verdicts are not shown: {str(error).rstrip('.')}" for error in problems]
        checkpoints.append(JudgedCheckpoint(table, rank(table), predicted, said))
    for name, table in zip(checkpoint_names(tables), tables, strict=True):
        if begun := begun_text(table):
            said_besides.append(begun if len(tables) == 1 else f"{name}: {begun}")
    judged = [table for table in tables if table.rows]
    paired = paired_errors(judged) if len(judged) > 1 else None
    return ReportMaterial(tool, truth, tuple(checkpoints), paired, tuple(said_besides))
