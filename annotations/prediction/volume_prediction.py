"""A volume predicted: from its file to the prediction document that is kept of it."""

from pathlib import Path

import annotations
from annotations.documents.volume_link import reference_to, relative_path
from annotations.prediction.checkpoint import Checkpoint
from annotations.prediction.predicted_pose import fit_prediction
from annotations.prediction.prediction import CheckpointReference, Prediction, prediction_of
from annotations.prediction.predictor import Predictor
from annotations.volumes import SpacingUm, Volume, VolumeError, fingerprint


def predict_volume(
    predictor: Predictor, volume: Volume, spacing_um: SpacingUm | None, prediction_path: Path
) -> Prediction:
    """Predict the keypoints of a volume, and fit the pose of the tool to them.

    Parameters
    ----------
    predictor : Predictor
    volume : Volume
        Open.
    spacing_um : (float, float, float) or None
        Of its voxels; None for an unknown one, which is refused.
    prediction_path : Path
        Where the prediction will be kept: paths in it are relative to there. Nothing is written.

    Raises
    ------
    VolumeError
        Nobody says how far apart its voxels are; it cannot be read, or the network was not trained on such
        volumes.
    CheckpointError
        The network failed.
    """
    if spacing_um is None:
        raise VolumeError(
            "how far apart its voxels are is unknown: neither the file nor a sidecar says it",
            where=volume.path,
            remedy="Say it once where the application asks, or give it here (--spacing-um X Y Z)",
        )
    predicted = predictor.predict(volume, spacing_um)
    checkpoint = predictor.checkpoint
    return prediction_of(
        predicted,
        fit_prediction(predicted, checkpoint.description),
        reference_to(volume, spacing_um, prediction_path, fingerprint(volume)),
        reference_to_checkpoint(checkpoint, prediction_path),
        checkpoint.description.tool,
    )


def reference_to_checkpoint(checkpoint: Checkpoint, prediction_path: Path) -> CheckpointReference:
    """Describe a checkpoint for a prediction that will be kept at a path."""
    path = checkpoint.path.absolute()
    ships = path.is_relative_to(Path(annotations.__file__).parent)
    return CheckpointReference(
        name=checkpoint.description.name,
        sha256=checkpoint.sha256,
        path=None if ships else relative_path(path, prediction_path.absolute()),
    )
