"""A checkpoint that predicts volumes, one after the other: what is done in the background."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from annotations.documents.files import load_annotation
from annotations.documents.study import annotation_files, annotation_name
from annotations.durable_files import SaveError, check_writable
from annotations.errors import Cancelled, UserError
from annotations.geometry.frames import Vector
from annotations.volumes import VolumeError
from annotator.session.neutral_words import NeutralWords
from annotator.session.predictions.prediction_files import prediction_path, read_prediction
from annotator.session.volumes.opening import Found, OpeningRequest, find

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.inference_process import InferenceProcess

KnownSpacing = Callable[[Found], tuple[Found, Vector, str] | None]
"""From a volume and its annotation to its spacing; see `annotator.session.volumes.opening.known_spacing`."""

_MOST_CRASHES = 2
"""In a row: with a third volume it would be no other."""


class _NotWritable(SaveError):  # noqa: N818 - named for what is the case
    """Where a prediction would be kept nothing can be written."""


@dataclass(frozen=True)
class PredictionTask:
    """A volume that is to be predicted.

    Attributes
    ----------
    request : OpeningRequest
        Which one.
    spacing_um : (float, float, float) or None
        That with which it is open; None to find out.
    depth_axis : int or None
        Likewise: somebody may have said it without its being written down.
    is_anew : bool
        Whether a prediction that is kept, and still true, is made again.
    """

    request: OpeningRequest
    spacing_um: Vector | None = None
    depth_axis: int | None = None
    is_anew: bool = False


@dataclass(frozen=True)
class PredictionOutcome:
    """What has become of several volumes.

    Attributes
    ----------
    made, kept : int
        How many were predicted, and how many had been before.
    failures : tuple of (str, UserError)
        What the others are called, and why they were not predicted.
    left : int
        How many were not tried any more, as they would have failed as well.
    """

    made: int
    kept: int
    failures: tuple[tuple[str, UserError], ...]
    left: int = 0


def predict_all(
    tasks: Sequence[PredictionTask],
    checkpoint: "Checkpoint",
    process: "InferenceProcess",
    known_spacing: KnownSpacing,
    done: Callable[[int, bool], None],
    cancelled: Callable[[], bool],
) -> PredictionOutcome:
    """Predict volumes, and write each prediction at once; one that is kept and still true stays.

    Parameters
    ----------
    done : callable
        Told after each how many are finished, and whether there is a prediction of this one.
    cancelled : callable

    Raises
    ------
    SaveError
        Nothing can be written into the study: no volume of it was predicted.
    Cancelled
        `cancelled` returned true; what is done stays.
    """
    from annotations.prediction.checkpoint import CheckpointError
    from annotations.prediction.inference_process import InferenceCrashed

    made = kept = crashes = 0
    failures: list[tuple[str, UserError]] = []
    annotated = _annotated_in(tasks)
    for number, task in enumerate(tasks, start=1):
        if cancelled():
            raise Cancelled
        try:
            if _predict(task, checkpoint, process, known_spacing, annotated, cancelled):
                made += 1
            else:
                kept += 1
            crashes = 0
        except UserError as error:
            if isinstance(error, _NotWritable) and task.request.worklist.study is not None and not made:
                # The others would be kept in the same place.
                raise
            # In the words of its own list: by the time it is read another one may be open.
            words = NeutralWords(task.request.worklist, task.request.item)
            failures.append((task.request.item.label, words.error(error)))
            crashes = crashes + 1 if isinstance(error, InferenceCrashed) else 0
            if isinstance(error, CheckpointError) or crashes == _MOST_CRASHES:
                return PredictionOutcome(made, kept, tuple(failures), len(tasks) - number)
            done(number, False)
        else:
            done(number, True)
    return PredictionOutcome(made, kept, tuple(failures))


def _predict(
    task: PredictionTask,
    checkpoint: "Checkpoint",
    process: "InferenceProcess",
    known_spacing: KnownSpacing,
    annotated: Mapping[str, Sequence[Path]],
    cancelled: Callable[[], bool],
) -> bool:
    """Predict a volume and keep that; False where it had been done before."""
    from annotations.prediction.prediction_file import save_prediction  # late: few sessions predict

    found = find(task.request)
    with found.volume as volume:
        # Of one that is not open: what was said of it, or of its folder, may be written down nowhere.
        known = known_spacing(found) if task.spacing_um is None or task.depth_axis is None else None
        spacing_um, depth_axis = task.spacing_um, task.depth_axis
        if spacing_um is None:
            spacing_um = _annotated_spacing_um(found, annotated) or (None if known is None else known[1])
        if depth_axis is None:
            depth_axis = (found if known is None else known[0]).volume.depth_axis
        path = prediction_path(task.request.worklist, found.item, volume, checkpoint)
        if spacing_um is None:
            raise VolumeError(
                "how far apart its voxels are is unknown: no annotation, file or sidecar says it",
                where=volume.path,
                remedy="Open it, and say it once where the application asks",
            )
        if (
            not task.is_anew
            and read_prediction(path, checkpoint, found.fingerprint, spacing_um)[0] is not None
        ):
            return False
        # Before it takes its time.
        try:
            check_writable(path.parent)
        except SaveError as error:
            problem = f"{checkpoint.description.name} predicts nothing here: {error.problem}"
            raise _NotWritable(problem, where=error.where, remedy=error.remedy) from error
        # Over there the file is opened anew.
        prediction = process.predict(
            volume.path,
            dataset=volume.dataset,
            spacing_um=spacing_um,
            prediction_path=path,
            cancelled=cancelled,
            depth_axis=depth_axis,
        )
    save_prediction(prediction, path)
    return True


def _annotated_spacing_um(found: Found, annotated: Mapping[str, Sequence[Path]]) -> Vector | None:
    """Return the spacing of a volume's annotation by others; None where one's own, or nobody's, counts.

    Annotations come first, as the errors of a prediction are told where it has the same spacing alone.
    """
    if found.document is None:
        for path in annotated.get(found.item.volume_id or "", ()):
            try:
                return load_annotation(path)[0].volume.spacing_um
            except UserError:
                # Whoever opens it will hear of it.
                continue
    return None


def _annotated_in(tasks: Sequence[PredictionTask]) -> Mapping[str, Sequence[Path]]:
    """Return the annotations of the study that tasks belong to, by the volume's id."""
    worklist = tasks[0].request.worklist if tasks else None
    paths: dict[str, list[Path]] = {}
    if worklist is not None and worklist.study is not None:
        for path in annotation_files(worklist.folder):
            name = annotation_name(path)
            if name is not None:
                paths.setdefault(name.volume_id, []).append(path)
    return paths


def failure_of(outcome: PredictionOutcome, checkpoint_name: str) -> UserError | None:
    """Return what a person has to hear of those that failed; None where none did."""
    failures = outcome.failures
    if not failures:
        return None
    count = outcome.made + outcome.kept + len(failures) + outcome.left
    if count == 1:
        return failures[0][1]
    by_reason: dict[str, list[str]] = {}
    for label, error in failures:
        by_reason.setdefault(f"{error.problem}. {error.remedy}".rstrip(". "), []).append(label)
    reasons = [f"{_listed(labels)}: {reason}" for reason, labels in by_reason.items()]
    stopped = f". {outcome.left} were not tried any more" if outcome.left else ""
    return UserError(
        f"{len(failures)} of {count} volumes could not be predicted by {checkpoint_name}{stopped}. "
        + ". ".join(reasons),
        remedy="What was predicted is kept" if outcome.made + outcome.kept else "",
    )


_MOST_LISTED = 8


def _listed(labels: Sequence[str]) -> str:
    more = len(labels) - _MOST_LISTED
    return ", ".join(labels[:_MOST_LISTED]) + (f" and {more} more" if more > 0 else "")
