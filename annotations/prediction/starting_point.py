"""A prediction as the beginning of an annotation: a person corrects it instead of beginning with nothing."""

from pathlib import Path

from annotations.documents.annotation import Annotation, KeypointAnnotation
from annotations.documents.edits import EditRefused
from annotations.documents.provenance import PredictionOrigin
from annotations.documents.record import changed
from annotations.documents.volume_link import relative_path
from annotations.prediction.prediction import Prediction


def start_from(
    document: Annotation, prediction: Prediction, *, prediction_path: Path, annotation_path: Path
) -> Annotation:
    """Return a document whose unplaced keypoints are where a prediction has them, as an edit.

    Their source is ``predicted`` until a person touches them: nobody has judged them, and comparisons leave
    them out. What is placed or locked stays as it is. The document says which checkpoint it was.

    Parameters
    ----------
    document : Annotation
        Of keypoints, as `new_annotation` begins it.
    prediction : Prediction
    prediction_path, annotation_path : Path
        Where the two are kept: the path in the document is relative to there.

    Raises
    ------
    EditRefused
        It is a document of boxes, or the prediction is of other data or another spacing. Nothing has changed.
    """
    if document.method != "keypoints":
        raise EditRefused(
            "a prediction gives keypoints, and this is a document of boxes",
            remedy="Start one of keypoints from it, and convert that",
        )
    seen, annotated = prediction.volume, document.volume
    if seen.fingerprint != annotated.fingerprint:
        raise EditRefused("the prediction is of another volume", remedy="Predict this volume")
    if seen.spacing_um != annotated.spacing_um:
        raise EditRefused(
            f"the prediction was made with the spacing {seen.spacing_um} µm, the document with "
            f"{annotated.spacing_um} µm",
            remedy="Predict this volume again with the right spacing",
        )
    keypoints = tuple(_placed(keypoint, prediction) for keypoint in document.keypoints)
    if keypoints == document.keypoints:
        return document
    origin = PredictionOrigin(
        path=relative_path(prediction_path, annotation_path),
        checkpoint=prediction.checkpoint.name,
        sha256=prediction.checkpoint.sha256,
    )
    return changed(document, keypoints=keypoints, predicted_from=origin)


def _placed(keypoint: KeypointAnnotation, prediction: Prediction) -> KeypointAnnotation:
    found = next((each for each in prediction.keypoints if each.name == keypoint.name), None)
    if found is None or found.position_um is None or keypoint.state != "unplaced" or keypoint.locked:
        return keypoint
    return changed(keypoint, state=found.state, position_um=found.position_um, source="predicted")
