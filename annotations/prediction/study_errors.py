"""What a checkpoint predicted in a study against what its people say, and against how far they are apart."""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from annotations.agreement.collecting import collect
from annotations.agreement.deviation import Deviations, deviations
from annotations.agreement.measured import measured_targets
from annotations.app_folders import tool_folder
from annotations.documents.annotation import Annotation
from annotations.documents.files import DocumentError
from annotations.documents.record import Method
from annotations.documents.representations import keypoints_of
from annotations.documents.study import Study, load_study
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotations.interchange.speaking_documents import Choice, SpeakingDocument, speaking_documents
from annotations.prediction.checkpoint_description import CheckpointDescription
from annotations.prediction.error_table import (
    ErrorTable,
    HumanFloor,
    JudgedPrediction,
    UnjudgedVolume,
    error_table,
    human_floor,
)
from annotations.prediction.prediction import Prediction
from annotations.prediction.prediction_errors import shown_target
from annotations.prediction.prediction_file import load_prediction, study_prediction_path

_SAME_SPACING = 1e-6


@dataclass(frozen=True)
class Truth:
    """Whose annotations are taken for the truth.

    Attributes
    ----------
    method : str or None
        None for the study's, keypoints where it has both.
    annotator : str or None
        None for the consensus, else the only person who is done, else a simulation.
    unfinished : bool
        Annotations that are not done count as well.
    """

    method: Method | None = None
    annotator: str | None = None
    unfinished: bool = False

    def choice(self, study: Study) -> Choice:
        """Return which of a study's annotations these are."""
        method = study.usual_method if self.method is None else self.method
        return Choice(method, self.annotator, unfinished=self.unfinished)


def kept_predictions(
    folder: Path, checkpoint_name: str, checkpoint_sha256: str | None = None
) -> tuple[Mapping[str, Prediction], tuple[UnjudgedVolume, ...]]:
    """Read what a study keeps of one checkpoint's predictions.

    Parameters
    ----------
    folder : Path
        The study's.
    checkpoint_name : str
    checkpoint_sha256 : str, optional
        Of the checkpoint's file; by default that of the latest prediction. Those of an earlier checkpoint of
        the same name are passed over.

    Returns
    -------
    mapping of str to Prediction
        By the volume's id, in the study's order.
    tuple of UnjudgedVolume
        Volumes with a file that cannot be read, or of another checkpoint; volumes without one are in neither.

    Raises
    ------
    StudyError
        ``study.toml`` is wrong.
    """
    found: dict[str, Prediction] = {}
    unread: list[UnjudgedVolume] = []
    for volume in load_study(folder).volumes:
        path = study_prediction_path(folder, checkpoint_name, volume.id)
        if not path.exists():
            continue
        try:
            found[volume.id] = load_prediction(path)
        except DocumentError as error:
            unread.append(UnjudgedVolume(volume=volume.id, reason=f"its prediction cannot be read: {error}"))
    if checkpoint_sha256 is None and found:
        checkpoint_sha256 = max(found.values(), key=lambda each: each.created).checkpoint.sha256
    others = [name for name, each in found.items() if each.checkpoint.sha256 != checkpoint_sha256]
    unread += [
        UnjudgedVolume(
            volume=name, reason=f"its prediction is of another checkpoint that is called {checkpoint_name!r}"
        )
        for name in others
    ]
    return {name: each for name, each in found.items() if name not in others}, tuple(unread)


def study_errors(
    folder: Path,
    predictions: Mapping[str, Prediction],
    truth: Truth | None = None,
    checkpoint: CheckpointDescription | None = None,
    *,
    unjudged: Sequence[UnjudgedVolume] = (),
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> ErrorTable:
    """Return the errors of predictions against the annotations that speak for a study's volumes.

    Positions that are themselves a network's, and that nobody has touched since, are no truth. No volume is
    opened.

    Parameters
    ----------
    folder : Path
        The study's.
    predictions : mapping of str to Prediction
        Of one checkpoint, by the volume's id.
    truth : Truth, optional
    checkpoint : CheckpointDescription, optional
        Tells which keypoints it cannot tell, since they lie beyond its range; else it should have found all.
    unjudged : sequence of UnjudgedVolume
        Volumes of which the table is to say why they have no prediction.
    progress, cancelled : callable
        Told the share that is done; asked now and then whether to stop.

    Raises
    ------
    StudyError, ToolError
        ``study.toml`` is wrong, or its tool is unknown.
    Cancelled
        `cancelled` returned true.
    """
    wanted = truth if truth is not None else Truth()
    study = load_study(folder)
    folders = (folder / "tools", tool_folder())
    tool = find_tool(study.tool, folders)
    choice = wanted.choice(study)
    documents, left_out = speaking_documents(
        study, folder, tool, folders, choice, lambda share: progress(share / 2), cancelled
    )
    judged: list[JudgedPrediction] = []
    refused = list(unjudged)
    for document in documents:
        volume_id = document.volume.id
        prediction = predictions.get(volume_id)
        if prediction is None:
            continue
        if reason := _why_not(prediction, document, tool):
            refused.append(UnjudgedVolume(volume=volume_id, reason=reason))
        else:
            truth_um = true_positions_um(document.annotation, document.tool)
            spacing_um = prediction.volume.spacing_um
            beyond = (
                frozenset[str]() if checkpoint is None else out_of_range(checkpoint, truth_um, spacing_um)
            )
            judged.append(
                JudgedPrediction(
                    volume_id,
                    prediction,
                    truth_um,
                    document.annotator,
                    beyond,
                    # A checkpoint refuses volumes in which the light travels along another axis.
                    *(() if checkpoint is None else (checkpoint.sampling.depth_axis,)),
                )
            )
    spoken = {document.volume.id for document in documents}
    silent = {one.volume_id: one.reason for one in left_out if one.volume_id not in spoken}
    refused += [
        UnjudgedVolume(volume=volume_id, reason=reason)
        for volume_id, reason in silent.items()
        if volume_id in predictions
    ]
    human = study_human_floor(
        folder,
        choice.method,
        {each.volume_id for each in judged},
        progress=lambda share: progress((1 + share) / 2),
        cancelled=cancelled,
    )
    return error_table(judged, tool, title=study.title, human=human, unjudged=refused)


def out_of_range(
    checkpoint: CheckpointDescription, truth_um: Mapping[str, Vector], volume_spacing_um: Vector
) -> frozenset[str]:
    """Return the keypoints at positions in µm that a checkpoint cannot tell: they are beyond its range."""
    return frozenset(
        name
        for name, position_um in truth_um.items()
        if not checkpoint.in_range(position_um, volume_spacing_um)
    )


def true_positions_um(annotation: Annotation, tool: ToolSpecification) -> Mapping[str, Vector]:
    """Return the positions in µm of the keypoints that an annotation gives and no network did, by name."""
    return {
        keypoint.name: keypoint.position_um
        for keypoint in keypoints_of(annotation, tool)
        if keypoint.position_um is not None and keypoint.source != "predicted"
    }


def study_human_floor(
    folder: Path,
    method: Method,
    volumes: Container[str] | None = None,
    *,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> HumanFloor | None:
    """Return how far the annotators of a study are apart; None where no volume has two of them.

    Only opinions of their own count (`Compared.is_independent`): who corrected a prediction, or saw others'
    work before, is not among them.

    Parameters
    ----------
    folder : Path
        The study's.
    method : str
    volumes : container of str, optional
        Ids of the volumes that count, such as those that a checkpoint is judged by; by default all.
    progress, cancelled : callable
        Told the share that is done; asked now and then whether to stop.

    Raises
    ------
    StudyError
        ``study.toml`` is wrong.
    Cancelled
        `cancelled` returned true.
    """
    material = collect(folder, (tool_folder(),), progress=progress, cancelled=cancelled)
    passes = material.passes.get(method)
    if not passes or material.tool is None:
        return None
    # What a network had a part in is no yardstick for one, nor is what people did who saw each other's work.
    independent = passes[0].only(passes[0].is_independent)
    names = independent.volumes
    chosen = [place for place, name in enumerate(names) if volumes is None or name in volumes]
    apart = {}
    for name, measured in measured_targets(independent, material.tool).items():
        shown, unit = shown_target(name)
        found = deviations(measured)
        apart[shown] = Deviations(
            found.published[chosen] / unit,
            found.leave_one_out[chosen] / unit,
            found.pairwise[chosen] / unit,
        )
    return human_floor(method, passes[0].annotators, [names[place] for place in chosen], apart)


def _why_not(prediction: Prediction, document: SpeakingDocument, tool: ToolSpecification) -> str:
    """Return why a prediction cannot be held against an annotation; empty where it can."""
    seen, annotated = prediction.volume, document.annotation.volume
    unknown = [each.name for each in prediction.keypoints if each.name not in tool.keypoint_names]
    if unknown:
        return f"the checkpoint's tool {prediction.tool!r} has {unknown[0]!r}, and the study's has not"
    if seen.fingerprint != annotated.fingerprint:
        return f"what was predicted is not what {document.annotator} annotated (the fingerprints differ)"
    if not np.allclose(seen.spacing_um, annotated.spacing_um, rtol=_SAME_SPACING, atol=0):
        return (
            f"it was predicted with the spacing {seen.spacing_um} µm, and annotated with "
            f"{annotated.spacing_um} µm"
        )
    return ""
