"""A review of a study: what a report on its checkpoints is made of, and from which files."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from annotations.documents.annotation import Annotation
from annotations.documents.permission import check_may_see_all
from annotations.documents.standing import standing
from annotations.documents.study import Study, annotator_folders
from annotator.session.agreement.opinion_watch import FileMarks, folder_marks

if TYPE_CHECKING:
    # Half a second that only those wait for who review.
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.errors.error_table import UnjudgedVolume
    from annotations.prediction.errors.study_errors import StudyTruths, Truth
    from annotations.prediction.prediction import Prediction
    from annotations.prediction.report.material import JudgedCheckpoint, ReportMaterial

_UNFINISHED = "the errors show what the others found in volumes that are not done by you"


@dataclass(frozen=True, eq=False)
class ReadStudy:
    """What a review is computed from.

    Attributes
    ----------
    truths : StudyTruths
    wanted : Truth
        Whose annotations they are.
    predictions : tuple of (mapping of str to Prediction)
        Of each checkpoint, by the volume's id.
    unread : tuple of (tuple of UnjudgedVolume)
        Of each checkpoint, the predictions that cannot be used.
    """

    truths: "StudyTruths"
    wanted: "Truth"
    predictions: "tuple[Mapping[str, Prediction], ...]"
    unread: "tuple[tuple[UnjudgedVolume, ...], ...]"


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
    read : ReadStudy
        What was read, so that one annotation that is saved here need not have all of it read again.
    at : datetime
        When that was, in local time.
    """

    folder: Path
    checkpoints: "tuple[Checkpoint, ...]"
    material: "ReportMaterial"
    marks: FileMarks
    read: "ReadStudy"
    at: datetime = field(default_factory=lambda: datetime.now().astimezone())

    @property
    def by_sha256(self) -> "Mapping[str, JudgedCheckpoint]":
        """What there is of each checkpoint, by the SHA-256 of its file."""
        judged = zip(self.checkpoints, self.material.checkpoints, strict=True)
        return {checkpoint.sha256: each for checkpoint, each in judged}

    def is_spoken_by(self, volume: str, annotation: Annotation, path: Path) -> bool:
        """Say whether an annotation that was saved is still the one that speaks for a volume."""
        read = self.read.truths.by_volume.get(volume)
        return (
            read is not None
            and read.path == path
            and (annotation.status == "done" or self.read.wanted.unfinished)
            # Where it was all simulated before, others of the study may speak no more now that it is not.
            and all(_is_counted(each) for each in (read.annotation, annotation))
        )

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
        The study or its tool is wrong, or the person may not see everybody's work.
    Cancelled
        `cancelled` returned true.
    """
    from annotations.prediction.errors.study_errors import (  # late: few sessions review
        kept_predictions,
        read_truths,
    )

    # The open list tells of one method alone.
    check_may_see_all(study, folder, person, _UNFINISHED, cancelled)
    # Before they are read: what changes meanwhile is noticed.
    marks = review_marks(folder, checkpoints)
    truths = read_truths(folder, truth, progress=progress, cancelled=cancelled)
    kept = [kept_predictions(folder, each.description.name, each.sha256) for each in checkpoints]
    read = ReadStudy(truths, truth, tuple(each for each, _ in kept), tuple(unread for _, unread in kept))
    return _review_of(folder, tuple(checkpoints), read, marks)


def changed_review(
    review: Review, volume: str, annotation: Annotation, path: Path, saved: FileMarks
) -> Review:
    """Return a review after an annotation that speaks for a volume was saved here; only that volume is new.

    How far people are apart stays as it was read, which one volume of many hardly moves.

    Parameters
    ----------
    review : Review
    volume : str
        Its id; one of those that somebody speaks for.
    annotation : Annotation
        As it was saved.
    path : Path
        Where.
    saved : frozenset
        The mark of that file right after it was saved: that is no change by somebody else.
    """
    truths = review.read.truths.with_annotation(volume, annotation)
    marks = frozenset(each for each in review.marks if each[0] != str(path)) | saved
    return _review_of(review.folder, review.checkpoints, replace(review.read, truths=truths), marks)


def review_marks(folder: Path, checkpoints: "Sequence[Checkpoint]") -> FileMarks:
    """Return the marks of what a review reads: annotations, and predictions of these checkpoints."""
    from annotations.prediction.prediction_file import checkpoint_folder  # late: as above

    folders = {checkpoint_folder(folder, each.description.name, each.sha256) for each in checkpoints}
    return folder_marks((*annotator_folders(folder), *folders))


def _review_of(
    folder: Path, checkpoints: "tuple[Checkpoint, ...]", read: ReadStudy, marks: FileMarks
) -> Review:
    from annotations.prediction.errors.study_errors import errors_against
    from annotations.prediction.report.material import report_material  # late: few sessions review

    tables = [
        errors_against(read.truths, predicted, checkpoint.description, unjudged=unread)
        for checkpoint, predicted, unread in zip(checkpoints, read.predictions, read.unread, strict=True)
    ]
    material = report_material(read.truths.tool, read.wanted, tables, read.predictions, folder)
    return Review(folder, checkpoints, material, marks, read)


def _is_counted(annotation: Annotation) -> bool:
    """Say whether a person has placed any part of an annotation."""
    return any(standing(part) == "counted" for part in annotation.parts)
