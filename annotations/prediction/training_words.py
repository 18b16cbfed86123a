"""What a checkpoint says of its training, in words."""

from annotations.prediction.checkpoint_description import TrainingSummary
from annotations.prediction.errors.error_text import column_title

_UNKNOWN = "it does not say"


def training_in_words(training: TrainingSummary) -> str:
    """Say what a network was trained on, and for how long; the weights with which it began come first."""
    parts = []
    if training.synthetic_volumes:
        parts.append(f"{training.synthetic_volumes:,} synthetic volumes")
    if training.annotated_volumes:
        parts.append(f"{training.annotated_volumes:,} annotated volumes of {', '.join(training.studies)}")
    if training.epochs:
        parts.append(f"{training.epochs:,} epochs")
    if training.seconds:
        parts.append(f"{training.seconds / 60:,.0f} minutes")
    said = ", ".join(parts) or _UNKNOWN
    if training.origin is None:
        return said
    return f"{training_in_words(training.origin.training)}; from there ({training.origin.name}) on {said}"


def errors_in_words(training: TrainingSummary) -> str:
    """Say how well a network did on volumes that it was not trained on, mean ± standard deviation."""
    if not training.validation:
        return _UNKNOWN
    figures = "; ".join(
        f"{column_title(name)} {error.mean:.2f} ± {error.deviation:.2f}"
        for name, error in training.validation.items()
    )
    return f"{figures}, on {training.validation_volumes:,} other volumes"
