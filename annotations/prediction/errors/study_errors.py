"""What a checkpoint predicted in a study against what its people say, and against how far they are apart."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from annotations.app_folders import tool_folder
from annotations.documents.annotation import Annotation
from annotations.documents.files import DocumentError
from annotations.documents.record import Method
from annotations.documents.representations import keypoints_of
from annotations.documents.study import Study, load_study
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotations.interchange.speaking_documents import Choice, speaking_documents
from annotations.prediction.checkpoint_description import CheckpointDescription
from annotations.prediction.errors.error_table import (
    ErrorTable,
    JudgedPrediction,
    UnjudgedVolume,
    error_table,
)
from annotations.prediction.errors.study_floor import FloorOfVolumes, floor_of_volumes
from annotations.prediction.prediction import Prediction
from annotations.prediction.prediction_file import checkpoint_folder, load_prediction

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
    folder: Path, checkpoint_name: str, checkpoint_sha256: str
) -> tuple[Mapping[str, Prediction], tuple[UnjudgedVolume, ...]]:
    """Read what a study keeps of one checkpoint's predictions.

    Parameters
    ----------
    folder : Path
        The study's.
    checkpoint_name : str
    checkpoint_sha256 : str
        Of the checkpoint's file: another one of the same name has its predictions elsewhere.

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
    kept_in = checkpoint_folder(folder, checkpoint_name, checkpoint_sha256)
    for volume in load_study(folder).volumes:
        path = kept_in / f"{volume.id}.json"
        if not path.exists():
            continue
        try:
            found[volume.id] = load_prediction(path)
        except DocumentError as error:
            unread.append(UnjudgedVolume(volume=volume.id, reason=f"its prediction cannot be read: {error}"))
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

    What is wanted of several checkpoints, or again after one annotation has changed, need not be read each
    time: see `read_truths` and `errors_against`, of which this is made.

    Parameters
    ----------
    folder : Path
        The study's.
    predictions, checkpoint, unjudged
        As for `errors_against`.
    truth, progress, cancelled
        As for `read_truths`.

    Raises
    ------
    StudyError, ToolError
        ``study.toml`` is wrong, or its tool is unknown.
    Cancelled
        `cancelled` returned true.
    """
    truths = read_truths(folder, truth, progress=progress, cancelled=cancelled)
    return errors_against(truths, predictions, checkpoint, unjudged=unjudged)


@dataclass(frozen=True, eq=False)
class VolumeTruth:
    """What speaks for a volume.

    Attributes
    ----------
    annotation : Annotation
    tool : ToolSpecification
        With which it was made.
    whose : str
        Its annotator.
    path : Path
        Of its file.
    """

    annotation: Annotation
    tool: ToolSpecification
    whose: str
    path: Path


@dataclass(frozen=True, eq=False)
class StudyTruths:
    """What a study's people say, as it was read: what any checkpoint's predictions are held against.

    Attributes
    ----------
    title : str
        The study's.
    tool : ToolSpecification
        The study's.
    method : str
        By which the annotations were made.
    by_volume : mapping of str to VolumeTruth
        By the volume's id, in the study's order.
    silent : mapping of str to str
        Why nothing speaks for the other volumes, as sentences without their full stop.
    floor : FloorOfVolumes or None
        How far people are apart; None where nobody has annotated by the method.
    """

    title: str
    tool: ToolSpecification
    method: Method
    by_volume: Mapping[str, VolumeTruth]
    silent: Mapping[str, str]
    floor: FloorOfVolumes | None

    def with_annotation(self, volume: str, annotation: Annotation) -> "StudyTruths":
        """Return the same after the annotation that speaks for a volume was changed.

        What another person says now is not known here, nor is the floor computed again, which one volume of
        many hardly moves: for that everything is to be read again, now and then.
        """
        changed = replace(self.by_volume[volume], annotation=annotation)
        return replace(self, by_volume={**self.by_volume, volume: changed})


def read_truths(
    folder: Path,
    truth: Truth | None = None,
    *,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> StudyTruths:
    """Read what speaks for a study's volumes, and how far its people are apart. No volume is opened.

    Parameters
    ----------
    folder : Path
        The study's.
    truth : Truth, optional
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
    by_volume = {
        each.volume.id: VolumeTruth(each.annotation, each.tool, each.annotator, each.path)
        for each in documents
    }
    return StudyTruths(
        title=study.title,
        tool=tool,
        method=choice.method,
        by_volume=by_volume,
        silent={one.volume_id: one.reason for one in left_out if one.volume_id not in by_volume},
        floor=floor_of_volumes(folder, choice.method, lambda share: progress((1 + share) / 2), cancelled),
    )


def errors_against(
    truths: StudyTruths,
    predictions: Mapping[str, Prediction],
    checkpoint: CheckpointDescription | None = None,
    *,
    unjudged: Sequence[UnjudgedVolume] = (),
) -> ErrorTable:
    """Return the errors of predictions; no file is read.

    Positions that are themselves a network's, and that nobody has touched since, are no truth. Annotations
    that were begun from a prediction are listed, and count in no figure.

    Parameters
    ----------
    truths : StudyTruths
    predictions : mapping of str to Prediction
        Of one checkpoint, by the volume's id.
    checkpoint : CheckpointDescription, optional
        Tells which keypoints it cannot tell, since they lie beyond its range; else it should have found all.
    unjudged : sequence of UnjudgedVolume
        Volumes of which the table is to say why they have no prediction.
    """
    judged: list[JudgedPrediction] = []
    refused = list(unjudged)
    for volume_id, truth in truths.by_volume.items():
        prediction = predictions.get(volume_id)
        if prediction is None:
            continue
        if reason := _why_not(prediction, truth, truths.tool):
            refused.append(UnjudgedVolume(volume=volume_id, reason=reason))
        else:
            judged.append(_judged(volume_id, truth, prediction, checkpoint))
    refused += [
        UnjudgedVolume(volume=volume_id, reason=reason)
        for volume_id, reason in truths.silent.items()
        if volume_id in predictions
    ]
    independent = {each.volume_id for each in judged if not each.begun_from}
    human = None if truths.floor is None else truths.floor.of(independent)
    return error_table(
        judged,
        truths.tool,
        title=truths.title,
        human=human,
        unjudged=refused,
        checkpoint=next((each.checkpoint for each in predictions.values()), None),
    )


def _judged(
    volume_id: str, truth: VolumeTruth, prediction: Prediction, checkpoint: CheckpointDescription | None
) -> JudgedPrediction:
    truth_um = true_positions_um(truth.annotation, truth.tool)
    judged = JudgedPrediction(
        volume_id, prediction, truth_um, truth.whose, begun_from=truth.annotation.begun_from
    )
    if checkpoint is None:
        return judged
    return replace(
        judged,
        out_of_range=out_of_range(checkpoint, truth_um, prediction.volume.spacing_um),
        # A checkpoint refuses volumes in which the light travels along another axis.
        depth_axis=checkpoint.sampling.depth_axis,
    )


def out_of_range(
    checkpoint: CheckpointDescription, truth_um: Mapping[str, Vector], volume_spacing_um: Vector
) -> frozenset[str]:
    """Return the keypoints at positions in µm that a checkpoint cannot tell: they are beyond its range."""
    if not truth_um:
        return frozenset()
    in_range = checkpoint.in_range(list(truth_um.values()), volume_spacing_um)
    return frozenset(name for name, is_told in zip(truth_um, in_range.tolist(), strict=True) if not is_told)


def true_positions_um(annotation: Annotation, tool: ToolSpecification) -> Mapping[str, Vector]:
    """Return the positions in µm of the keypoints that an annotation gives and no network did, by name."""
    return {
        keypoint.name: keypoint.position_um
        for keypoint in keypoints_of(annotation, tool)
        if keypoint.position_um is not None and keypoint.source != "predicted"
    }


def _why_not(prediction: Prediction, truth: VolumeTruth, tool: ToolSpecification) -> str:
    """Return why a prediction cannot be held against an annotation; empty where it can."""
    seen, annotated = prediction.volume, truth.annotation.volume
    unknown = [each.name for each in prediction.keypoints if each.name not in tool.keypoint_names]
    if unknown:
        return f"the checkpoint's tool {prediction.tool!r} has {unknown[0]!r}, and the study's has not"
    if seen.fingerprint != annotated.fingerprint:
        return f"what was predicted is not what {truth.whose} annotated (the fingerprints differ)"
    spacings_um = zip(seen.spacing_um, annotated.spacing_um, strict=True)
    if not all(math.isclose(one, other, rel_tol=_SAME_SPACING) for one, other in spacings_um):
        return (
            f"it was predicted with the spacing {seen.spacing_um} µm, and annotated with "
            f"{annotated.spacing_um} µm"
        )
    return ""
