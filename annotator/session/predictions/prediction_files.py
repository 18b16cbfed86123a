"""Where the predictions of a list's volumes are kept, and what stands there about the one that is open."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from annotations.documents.files import DocumentError
from annotations.documents.record import changed
from annotations.documents.standing import standing
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.volumes import Volume
from annotator.session.volumes.worklist import WorkItem, Worklist

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.interchange.speaking_documents import SpeakingDocument
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.errors.study_errors import Truth
    from annotations.prediction.prediction import Prediction

# A spacing that was stored and read again may differ in its last digits.
_SAME_SPACING = 1e-6


@dataclass(frozen=True)
class OpenVolume:
    """The open volume, as far as predictions of it go.

    Attributes
    ----------
    worklist, item
        What it belongs to.
    volume : Volume
    fingerprint : str
    spacing_um : (float, float, float)
    tool : ToolSpecification
        Of the open document.
    tool_folders : tuple of Path
    """

    worklist: Worklist
    item: WorkItem
    volume: Volume
    fingerprint: str
    spacing_um: Vector
    tool: ToolSpecification
    tool_folders: tuple[Path, ...]


@dataclass(frozen=True)
class KeptPrediction:
    """What is kept about the open volume.

    Attributes
    ----------
    path : Path
        Where a prediction is kept, or would be.
    prediction : Prediction or None
        Of this checkpoint, this volume and this spacing.
    problem : str
        Why a file that is there is not that, as a sentence without its full stop; else empty.
    spoken : SpeakingDocument or None
        The annotation that speaks for the volume in its study; None where none does, and outside of one.
    """

    path: Path
    prediction: "Prediction | None"
    problem: str = ""
    spoken: "SpeakingDocument | None" = None


def prediction_path(worklist: Worklist, item: WorkItem, volume: Volume, checkpoint: "Checkpoint") -> Path:
    """Return where a checkpoint's prediction of a volume is kept: in its study, else beside the volume."""
    from annotations.prediction.prediction_file import (
        checkpoint_folder,
        loose_prediction_path,
        study_prediction_path,
    )

    name, sha256 = checkpoint.description.name, checkpoint.sha256
    if worklist.study is not None and item.volume_id is not None:
        return study_prediction_path(worklist.folder, name, sha256, item.volume_id)
    return loose_prediction_path(checkpoint_folder(item.volume_path.parent, name, sha256), volume)


def read_prediction(
    path: Path, checkpoint: "Checkpoint", fingerprint: str, spacing_um: Vector
) -> "tuple[Prediction | None, str]":
    """Read what a checkpoint has said of a volume, if it would say the same again.

    Returns
    -------
    Prediction or None
    str
        Why what is there is not that, as a sentence without its full stop; else empty.
    """
    from annotations.prediction.prediction_file import load_prediction

    if not path.exists():
        return None, ""
    name = checkpoint.description.name
    try:
        prediction = load_prediction(path)
    except DocumentError as error:
        return None, f"What {name} predicted cannot be read: {error.problem}"
    if prediction.checkpoint.sha256 != checkpoint.sha256:
        return None, f"This was predicted by another checkpoint that is called {name}: predict it again"
    if not prediction.is_of(checkpoint.sha256, fingerprint):
        return None, "The volume is another one than when it was predicted: predict it again"
    if not np.allclose(prediction.volume.spacing_um, spacing_um, rtol=_SAME_SPACING, atol=0):
        return None, "It was predicted with another spacing: predict it again"
    return prediction, ""


def read_kept(
    opened: OpenVolume, checkpoint: "Checkpoint", truth: "Truth", *, counts: bool = True
) -> KeptPrediction:
    """Read what is kept about the open volume: a checkpoint's prediction, if it counts, and what is true."""
    path = prediction_path(opened.worklist, opened.item, opened.volume, checkpoint)
    prediction, problem = None, ""
    if counts:
        prediction, problem = read_prediction(path, checkpoint, opened.fingerprint, opened.spacing_um)
    return KeptPrediction(path, prediction, problem, _spoken(opened, truth))


def _spoken(opened: OpenVolume, truth: "Truth") -> "SpeakingDocument | None":
    from annotations.interchange.speaking_documents import speaking_documents

    study, volume_id = opened.worklist.study, opened.item.volume_id
    if study is None or volume_id is None:
        return None
    # Of one volume first: to read those of all takes seconds.
    alone = changed(study, volumes=(study.volume(volume_id),))
    for asked in (alone, study):
        documents, _ = speaking_documents(
            asked, opened.worklist.folder, opened.tool, opened.tool_folders, truth.choice(study)
        )
        spoken = next((each for each in documents if each.volume.id == volume_id), None)
        if (
            spoken is None
            or truth.annotator is not None
            or any(standing(part) == "counted" for part in spoken.annotation.parts)
        ):
            return spoken
        # A simulation speaks where nobody has done anything in the whole study.
    return spoken
