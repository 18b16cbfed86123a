"""What the trainings have seen that a network went through one after the other. Needs no torch."""

from annotations.learning.settings.training_settings import SettingsError, TrainingSettings, parse_settings
from annotations.prediction.checkpoint_description import TrainingSummary


def said_settings(training: TrainingSummary) -> TrainingSettings | None:
    """Return the settings of a training; None where it does not say, or in a way of its own.

    It may be of another version of this program, or of another program.
    """
    try:
        return parse_settings(training.settings, "the checkpoint") if training.settings else None
    except SettingsError:
        return None


def learned_seeds(training: TrainingSummary) -> frozenset[int]:
    """Return the seeds of the synthetic volumes from which a network has learned, now and before."""
    return frozenset(
        settings.synthetic.seed
        for stage in training.stages
        if (settings := said_settings(stage)) is not None
        # Annotated volumes may have been mixed with some of that seed, too.
        and (settings.synthetic.volumes or stage.synthetic_volumes)
    )


def seen_seeds(training: TrainingSummary) -> frozenset[int]:
    """Return the seeds of the synthetic volumes from which it has learned or by which it was chosen."""
    return learned_seeds(training) | {settings.validation.seed for settings in _all(training)}


def learned_volumes(training: TrainingSummary, seed: int) -> int:
    """Return from how many synthetic volumes of a seed, the first of them, a network has learned."""
    return sum(
        stage.synthetic_volumes
        for stage in training.stages
        if (settings := said_settings(stage)) is not None and settings.synthetic.seed == seed
    )


def learned_fingerprints(training: TrainingSummary) -> frozenset[str]:
    """Return the fingerprints of annotated volumes from which a network has learned, as far as it says."""
    return frozenset[str]().union(*(stage.training_fingerprints for stage in training.stages))


def _all(training: TrainingSummary) -> list[TrainingSettings]:
    said = [said_settings(stage) for stage in training.stages]
    return [settings for settings in said if settings is not None]
