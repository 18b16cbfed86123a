"""A review of a study: what a report on its checkpoints is made of, and from which files."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from annotations.app_folders import tool_folder
from annotations.documents.permission import check_may_see_all
from annotations.documents.study import Study, annotation_files
from annotations.geometry.tool_library import find_tool
from annotator.session.opinion_watch import FileMarks, file_marks

if TYPE_CHECKING:
    # Half a second that only those wait for who review.
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.error_table import ErrorTable
    from annotations.prediction.prediction import Prediction
    from annotations.prediction.report.material import JudgedCheckpoint, ReportMaterial
    from annotations.prediction.study_errors import Truth

_UNFINISHED = "the errors show what the others found in volumes that are not done by you"


@dataclass(frozen=True, eq=False)
class Review:
    """What was computed of a study.

    Attributes
    ----------
    folder : Path
        The study's.
    checkpoints : tuple of Checkpoint
        Those that were loaded, in their order.
    material : ReportMaterial
        Of the same checkpoints, in the same order.
    marks : FileMarks
        Of the files that were read.
    at : datetime
        When that was, in local time.
    """

    folder: Path
    checkpoints: "tuple[Checkpoint, ...]"
    material: "ReportMaterial"
    marks: FileMarks
    at: datetime = field(default_factory=lambda: datetime.now().astimezone())

    @property
    def by_sha256(self) -> "Mapping[str, JudgedCheckpoint]":
        """What there is of each checkpoint, by the SHA-256 of its file."""
        judged = zip(self.checkpoints, self.material.checkpoints, strict=True)
        return {checkpoint.sha256: each for checkpoint, each in judged}

    @property
    def is_paired(self) -> bool:
        """Whether several checkpoints can be compared."""
        paired = self.material.paired
        return paired is not None and len(paired.checkpoints) > 1


def computed_review(
    folder: Path,
    study: Study,
    person: str,
    checkpoints: "Sequence[Checkpoint]",
    truth: "Truth",
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> Review:
    """Return the review of the predictions that a study keeps.

    Raises
    ------
    UserError
        The study, its tool or a file of verdicts is wrong, or the person may not see everybody's work.
    Cancelled
        `cancelled` returned true.
    """
    from annotations.prediction.report.material import report_material  # late: few sessions review

    # The open list tells of one method alone.
    check_may_see_all(study, folder, person, _UNFINISHED, cancelled)
    # Before they are read: what changes meanwhile is noticed.
    marks = review_marks(folder, checkpoints)
    tables: list[ErrorTable] = []
    predictions: list[Mapping[str, Prediction]] = []
    for number, checkpoint in enumerate(checkpoints):

        def advance(share: float, number: int = number) -> None:
            progress((number + share) / len(checkpoints))

        table, predicted = _table_of(folder, checkpoint, truth, advance, cancelled)
        tables.append(table)
        predictions.append(predicted)
    tool = find_tool(study.tool, (folder / "tools", tool_folder()))
    material = report_material(tool, truth, tables, predictions, folder)
    return Review(folder, tuple(checkpoints), material, marks)


def review_marks(folder: Path, checkpoints: "Sequence[Checkpoint]") -> FileMarks:
    """Return the marks of what a review reads: annotations, and predictions of these checkpoints."""
    from annotations.prediction.prediction_file import study_prediction_path  # late: as above

    folders = {study_prediction_path(folder, each.description.name, "-").parent for each in checkpoints}
    predictions = (path for of_checkpoint in sorted(folders) for path in of_checkpoint.glob("*.json"))
    return file_marks((*annotation_files(folder), *predictions))


def _table_of(
    folder: Path,
    checkpoint: "Checkpoint",
    truth: "Truth",
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> "tuple[ErrorTable, Mapping[str, Prediction]]":
    from annotations.prediction.study_errors import kept_predictions, study_errors  # late: as above

    description = checkpoint.description
    predictions, unread = kept_predictions(folder, description.name, checkpoint.sha256)
    table = study_errors(
        folder, predictions, truth, description, unjudged=unread, progress=progress, cancelled=cancelled
    )
    return table, predictions
