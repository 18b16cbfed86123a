"""A review of a study: the errors of several checkpoints, ranked and compared, as they were computed."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from annotations.app_folders import tool_folder
from annotations.documents.permission import check_may_see_all
from annotations.documents.study import Study, annotation_files
from annotations.errors import Cancelled
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotator.session.opinion_watch import FileMarks, file_marks

if TYPE_CHECKING:
    # Half a second that only those wait for who review.
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.error_table import ErrorTable
    from annotations.prediction.paired_errors import PairedErrors
    from annotations.prediction.prediction import Prediction
    from annotations.prediction.ranking import RankedVolume
    from annotations.prediction.study_errors import Truth
    from annotations.prediction.verdicts import VerdictList

_UNFINISHED = "the errors show what the others found in volumes that are not done by you"


@dataclass(frozen=True, eq=False)
class CheckpointReview:
    """What one checkpoint is worth.

    Attributes
    ----------
    checkpoint : Checkpoint
    table : ErrorTable
    ranking : mapping of str to RankedVolume
        By volume, the one that needs a look first comes first.
    predictions : mapping of str to Prediction
        By volume.
    verdicts : tuple of VerdictList
        Everybody's.
    """

    checkpoint: "Checkpoint"
    table: "ErrorTable"
    ranking: "Mapping[str, RankedVolume]"
    predictions: "Mapping[str, Prediction]"
    verdicts: "tuple[VerdictList, ...]" = ()


@dataclass(frozen=True, eq=False)
class Review:
    """What was computed of a study.

    Attributes
    ----------
    folder : Path
        The study's.
    tool : ToolSpecification
        The study's.
    truth : Truth
    by_sha256 : mapping of str to CheckpointReview
        In the order in which the checkpoints were loaded.
    paired : PairedErrors or None
        Where several checkpoints have predicted the same volumes.
    marks : FileMarks
        Of the files that were read.
    at : datetime
        When that was, in local time.
    """

    folder: Path
    tool: ToolSpecification
    truth: "Truth"
    by_sha256: Mapping[str, CheckpointReview]
    paired: "PairedErrors | None"
    marks: FileMarks
    at: datetime = field(default_factory=lambda: datetime.now().astimezone())

    @property
    def checkpoints(self) -> "tuple[Checkpoint, ...]":
        """Those that were reviewed, in the order of their loading."""
        return tuple(each.checkpoint for each in self.by_sha256.values())


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
        The study or its tool is wrong, or the person may not see everybody's work in it.
    Cancelled
        `cancelled` returned true.
    """
    from annotations.prediction.paired_errors import paired_errors  # late: few sessions review

    check_may_see_all(study, folder, person, _UNFINISHED, cancelled)
    # Before they are read: what changes meanwhile is noticed.
    marks = review_marks(folder, checkpoints)
    reviews: dict[str, CheckpointReview] = {}
    for checkpoint in checkpoints:
        if cancelled():
            raise Cancelled
        begun = len(reviews)
        reviews[checkpoint.sha256] = _reviewed(
            folder,
            checkpoint,
            truth,
            lambda share, begun=begun: progress((begun + share) / len(checkpoints)),  # type: ignore[misc]
            cancelled,
        )
    tables = [each.table for each in reviews.values() if each.table.rows]
    paired = paired_errors(tables) if len(tables) > 1 else None
    tool = find_tool(study.tool, (folder / "tools", tool_folder()))
    return Review(folder, tool, truth, reviews, paired, marks)


def review_marks(folder: Path, checkpoints: "Sequence[Checkpoint]") -> FileMarks:
    """Return the marks of what a review reads: annotations, and predictions of these checkpoints."""
    from annotations.prediction.prediction_file import study_prediction_path

    folders = {study_prediction_path(folder, each.description.name, "-").parent for each in checkpoints}
    predictions = (path for of_checkpoint in sorted(folders) for path in of_checkpoint.glob("*.json"))
    return file_marks((*annotation_files(folder), *predictions))


def _reviewed(
    folder: Path,
    checkpoint: "Checkpoint",
    truth: "Truth",
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> CheckpointReview:
    from annotations.prediction.ranking import rank
    from annotations.prediction.study_errors import kept_predictions, study_errors
    from annotations.prediction.verdict_file import study_verdicts

    description = checkpoint.description
    predictions, unread = kept_predictions(folder, description.name, checkpoint.sha256)
    table = study_errors(
        folder, predictions, truth, description, unjudged=unread, progress=progress, cancelled=cancelled
    )
    ranking = {each.volume: each for each in rank(table)}
    return CheckpointReview(checkpoint, table, ranking, predictions, study_verdicts(folder, description.name))
