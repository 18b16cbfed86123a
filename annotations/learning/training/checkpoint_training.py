"""From settings and studies to a checkpoint."""

from collections.abc import Callable
from pathlib import Path

from annotations.documents.record import now
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.learning.architectures.networks import parameter_count
from annotations.learning.conversion import convert_state
from annotations.learning.examples.examples import AnnotatedExamples
from annotations.learning.settings.training_settings import TrainingSettings
from annotations.learning.training.origin import Origin
from annotations.learning.training.state_file import write_state
from annotations.learning.training.training import Training
from annotations.learning.training.training_folder import BEST_FILE, training_folder_path
from annotations.prediction.checkpoint import Checkpoint
from annotations.prediction.checkpoint_description import (
    MOST_FINGERPRINTS,
    CheckpointDescription,
    ErrorSummary,
    TrainingSummary,
)


def train_checkpoint(
    settings: TrainingSettings,
    tool: ToolSpecification,
    annotated: AnnotatedExamples,
    checkpoint: Path,
    *,
    say: Callable[[str], None] = lambda _line: None,
    stopped: Callable[[], bool] = lambda: False,
    restart: bool = False,
    origin: Origin | None = None,
) -> Checkpoint | None:
    """Train a network, go on with a training that was interrupted, and write its checkpoint.

    Parameters
    ----------
    settings : TrainingSettings
    tool : ToolSpecification
    annotated : AnnotatedExamples
        None of them for a training on synthetic volumes alone.
    checkpoint : Path
        The file to write; beside it the training keeps a folder of the same name with ``.training``.
    say : callable, optional
        Told one line at a time how it goes.
    stopped : callable, optional
        Asked after every step whether to stop.
    restart : bool
        Whether to begin again where a training was interrupted.
    origin : Origin, optional
        The network with whose weights it begins; random ones by default.

    Returns
    -------
    Checkpoint or None
        None where it was stopped; the same call goes on from there.

    Raises
    ------
    UserError
        The settings do not fit, or nothing is to be trained on; SaveError where something cannot be written.
    """
    if not settings.gives_heatmaps:
        raise UserError(
            f"a {settings.network.kind!r} network tells no keypoints, so that there is no checkpoint of it",
            where="network.kind",
            remedy="Choose 'lean' or 'v2v'; the others are for 'annotations experiment'",
        )
    if checkpoint.is_dir():
        # Else that would show at the end.
        raise UserError(
            "it is a folder, and a checkpoint is a file",
            where=checkpoint,
            remedy="Choose another name for -o",
        )
    replaced = (checkpoint, training_folder_path(checkpoint) / BEST_FILE)
    if origin is not None and origin.path.resolve() in [path.resolve() for path in replaced]:
        raise UserError(
            "the training would replace what it begins with",
            where=origin.path,
            remedy="Choose another name for -o",
        )
    training = Training(settings, tool, annotated, checkpoint, say, restart, origin)
    is_done = training.run(stopped)
    path = training.folder.path / BEST_FILE
    if training.progress.rows:
        # Of one that was stopped as well: whoever does not want to wait makes a checkpoint of it.
        write_state(path, _description(training, checkpoint.stem), training.network_settings, training.best)
    return convert_state(path, checkpoint) if is_done else None


def _description(training: Training, name: str) -> CheckpointDescription:
    settings, progress, annotated = training.settings, training.progress, training.annotated
    origin = None if training.origin is None else training.origin.summary
    named = len(annotated.training_fingerprints) + len(annotated.validation_fingerprints)
    for stage in () if origin is None else origin.training.stages:
        named += len(stage.training_fingerprints) + len(stage.validation_fingerprints)
    # Some of them would pass for all.
    are_few = named <= MOST_FINGERPRINTS
    return CheckpointDescription(
        name=name,
        network=settings.network.kind,
        parameters=parameter_count(training.network),
        tool=training.tool,
        keypoints=training.tool.keypoint_names,
        sampling=settings.sampling,
        heatmaps=settings.heatmaps,
        training=TrainingSummary(
            synthetic_volumes=progress.synthetic_volumes,
            studies=annotated.studies,
            annotated_volumes=len(annotated.training),
            training_fingerprints=annotated.training_fingerprints if are_few else (),
            validation_fingerprints=annotated.validation_fingerprints if are_few else (),
            # A row of what a part began with is no epoch.
            epochs=sum("loss" in row for row in progress.rows),
            seconds=round(progress.seconds, 1),
            validation_volumes=progress.validation_volumes,
            validation={
                name: ErrorSummary(mean=mean, deviation=deviation)
                for name, (mean, deviation) in progress.best_errors.items()
            },
            settings=settings.as_toml(),
            origin=origin,
        ),
        created=now(),
    )
