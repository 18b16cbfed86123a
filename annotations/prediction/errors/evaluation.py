"""A checkpoint judged by volumes of which the truth is known: a study's, or synthetic ones made meanwhile."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from annotations.app_folders import tool_folder
from annotations.documents.annotation import VolumeReference
from annotations.documents.files import DocumentError
from annotations.documents.record import changed
from annotations.documents.study import load_study
from annotations.errors import Cancelled, UserError
from annotations.geometry.kinematics import keypoints_um
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotations.interchange.speaking_documents import LeftOut, SpeakingDocument, speaking_documents
from annotations.interchange.split import SplitRule, split_of
from annotations.prediction.errors.error_table import (
    ErrorTable,
    JudgedPrediction,
    UnjudgedVolume,
    error_table,
)
from annotations.prediction.errors.study_errors import Truth, out_of_range, study_errors
from annotations.prediction.predicted_pose import fit_prediction
from annotations.prediction.prediction import Prediction, prediction_of
from annotations.prediction.prediction_file import load_prediction, study_prediction_path
from annotations.prediction.predictor import Predictor
from annotations.prediction.volume_prediction import predict_volume, reference_to_checkpoint
from annotations.synthesis.conditions import PLAIN_CONDITIONS, TRAINING_CONDITIONS, SceneConditions
from annotations.synthesis.network_volume import network_volume
from annotations.synthesis.scanner import Scanner
from annotations.synthesis.scene import Scene, SceneSeed, random_scene
from annotations.volumes import fingerprint, open_volume

SplitName = Literal["train", "validation", "test"]

_TRUTH = "truth"


@dataclass(frozen=True)
class HeldOut:
    """The part of a study on which a checkpoint is judged.

    Attributes
    ----------
    split : str
        ``train``, ``validation`` or ``test``.
    rule : SplitRule
        That of the training.
    trained_on : frozenset of str
        Fingerprints of volumes that the checkpoint was trained on, as far as it says. They are for ``train``
        alone, wherever the rule puts them: it is applied to the volumes that are annotated now, which may be
        others than at the training.
    named : frozenset of str or None
        Fingerprints of the volumes of this part, where they are known: of a split of several studies together
        the rule does not find the part that lies in one of them. None to go by the rule.
    """

    split: SplitName
    rule: SplitRule
    trained_on: frozenset[str] = frozenset()
    named: frozenset[str] | None = None


@dataclass(frozen=True)
class SyntheticVolumes:
    """Volumes that are made to judge a checkpoint, at the resolution of its network.

    Attributes
    ----------
    count : int
    seed : int
        Number of their series.
    conditions : SceneConditions
    """

    count: int
    seed: int
    conditions: SceneConditions = TRAINING_CONDITIONS

    @property
    def title(self) -> str:
        """What they are, so that a figure can be quoted: the conditions, speckle and noise, and the seed."""
        speckle = {"looks": self.conditions.looks, "noise_sigma_grey": self.conditions.noise_sigma_grey}
        kinds = {"plain": PLAIN_CONDITIONS, "training": TRAINING_CONDITIONS}
        kind = next(
            (name for name, usual in kinds.items() if usual.model_copy(update=speckle) == self.conditions),
            "other",
        )
        scanner = Scanner()
        looks = _range_in_words(self.conditions.looks, scanner.looks)
        noise = _range_in_words(self.conditions.noise_sigma_grey, scanner.noise_sigma_grey)
        return (
            f"synthetic volumes, {kind} conditions, looks {looks}, noise sigma {noise} grey, seed {self.seed}"
        )


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A checkpoint judged.

    Attributes
    ----------
    table : ErrorTable
    predictions : mapping of str to Prediction
        Of each volume that it could predict, by its id.
    tool : ToolSpecification
        That of the study, or of the checkpoint where there is none.
    unread : tuple of DocumentError
        Why predictions that the study keeps were made again: their files cannot be read.
    """

    table: ErrorTable
    predictions: Mapping[str, Prediction]
    tool: ToolSpecification
    unread: tuple[DocumentError, ...] = ()


def evaluate_study(
    predictor: Predictor,
    folder: Path,
    truth: Truth,
    held_out: HeldOut | None = None,
    *,
    takes_kept: bool = True,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Evaluation:
    """Predict the annotated volumes of a study, and return the errors; nothing is written.

    Parameters
    ----------
    predictor : Predictor
    folder : Path
        The study's.
    truth : Truth
        Whose annotations.
    held_out : HeldOut, optional
        All annotated volumes by default.
    takes_kept : bool
        Take what the study keeps of this very checkpoint (`prediction_file`) where the volume and its spacing
        are the same: predicting them again would say the same.
    progress, cancelled : callable
        Told the share that is done, and asked whether to stop, before each volume.

    Raises
    ------
    UserError
        The study or its tool is wrong, or none of the volumes that are asked for has an annotation.
    Cancelled
        `cancelled` returned true.
    """
    study = load_study(folder)
    folders = (folder / "tools", tool_folder())
    tool = find_tool(study.tool, folders)
    documents, left_out = speaking_documents(study, folder, tool, folders, truth.choice(study))
    unusable = {one.volume_id: one for one in left_out if one.kind == "unusable"}
    trained_on = 0
    if held_out is not None:
        in_part = _part(documents, held_out)
        documents = _unseen(in_part, held_out)
        trained_on = len(in_part) - len(documents)
    if not documents:
        if unusable:
            raise _nothing_usable(list(unusable.values()), folder)
        part = "" if held_out is None else f" in its part for {held_out.split}"
        others = f" and is none of the {trained_on} that it was trained on" if trained_on else ""
        raise UserError(
            f"no volume{part} has an annotation that speaks for it{others}",
            where=folder,
            remedy="Finish annotations, make the consensus, or name an annotator (--annotator)",
        )
    predictions: dict[str, Prediction] = {}
    unread: list[DocumentError] = []
    spoken_for = {document.volume.id for document in documents}
    unjudged = [
        UnjudgedVolume(volume=one.volume_id, reason=one.reason.rstrip("."))
        for one in unusable.values()
        if one.volume_id not in spoken_for
    ]
    for number, document in enumerate(documents):
        if cancelled():
            raise Cancelled
        progress(number / len(documents))
        try:
            predictions[document.volume.id] = _predict(
                predictor, folder, document, unread.append if takes_kept else None
            )
        except UserError as error:
            unjudged.append(UnjudgedVolume(volume=document.volume.id, reason=str(error).rstrip(".")))
    description = predictor.checkpoint.description
    table = study_errors(folder, predictions, truth, description, unjudged=unjudged, cancelled=cancelled)
    progress(1.0)
    return Evaluation(changed(table, trained_on=trained_on), predictions, tool, tuple(unread))


def evaluate_synthetic(
    predictor: Predictor,
    volumes: SyntheticVolumes,
    progress: Callable[[float], None] = lambda _share: None,
) -> Evaluation:
    """Make synthetic volumes of the checkpoint's tool, predict each, and return the errors.

    They depend on the seed, the conditions and the tool alone. They are not the ones of `write_study` with
    the same seed, whose noise is another.

    Parameters
    ----------
    predictor : Predictor
    volumes : SyntheticVolumes
    progress : callable
        Told the share that is done before each volume.

    Raises
    ------
    UserError
        The tool has no links, or does not fit into the workspace.
    """
    description = predictor.checkpoint.description
    tool = description.tool
    judged = []
    for number in range(volumes.count):
        progress(number / volumes.count)
        scene = random_scene(tool, SceneSeed(volumes.seed, number), conditions=volumes.conditions)
        truth_um = keypoints_um(scene.pose, tool)
        judged.append(
            JudgedPrediction(
                f"s{number + 1:05}",
                _predict_scene(predictor, scene),
                truth_um,
                _TRUTH,
                out_of_range(description, truth_um, scene.grid.spacing_um),
            )
        )
    progress(1.0)
    table = error_table(judged, tool, title=volumes.title)
    return Evaluation(table, {each.volume_id: each.prediction for each in judged}, tool)


def _range_in_words(drawn: tuple[float, float] | None, else_always: float) -> str:
    least, greatest = (else_always, else_always) if drawn is None else drawn
    return f"{least:g}" if least == greatest else f"{least:g}–{greatest:g}"


def _part(documents: tuple[SpeakingDocument, ...], held_out: HeldOut) -> tuple[SpeakingDocument, ...]:
    if (named := held_out.named) is not None:
        return tuple(one for one in documents if one.annotation.volume.fingerprint in named)
    splits = split_of(
        [(one.volume.id, one.annotation.volume.fingerprint) for one in documents], held_out.rule
    )
    return tuple(one for one, split in zip(documents, splits, strict=True) if split == held_out.split)


def _unseen(documents: tuple[SpeakingDocument, ...], held_out: HeldOut) -> tuple[SpeakingDocument, ...]:
    if held_out.split == "train":
        return documents
    return tuple(one for one in documents if one.annotation.volume.fingerprint not in held_out.trained_on)


def _nothing_usable(unusable: Sequence[LeftOut], folder: Path) -> UserError:
    more = f". {len(unusable) - 1} more volumes have none either" if len(unusable) > 1 else ""
    return UserError(
        f"no volume has an annotation that can be used: {unusable[0].reason.rstrip('.')}{more}",
        where=folder,
        remedy="annotations check STUDY names each file",
    )


def _predict(
    predictor: Predictor,
    folder: Path,
    document: SpeakingDocument,
    on_unread: Callable[[DocumentError], None] | None,
) -> Prediction:
    """Return what is kept, if that may be taken: if `on_unread` is there to be told what cannot be read."""
    wanted, checkpoint = document.volume, predictor.checkpoint
    path = study_prediction_path(folder, checkpoint.description.name, checkpoint.sha256, wanted.id)
    # As in the application, the annotation's own spacing comes first: its positions were made with it.
    spacing_um = document.annotation.volume.spacing_um
    with open_volume(folder / wanted.path, dataset=wanted.dataset) as volume:
        if on_unread is not None and path.exists():
            try:
                kept = load_prediction(path)
            except DocumentError as error:
                on_unread(error)
            else:
                is_kept_of_it = kept.is_of(checkpoint.sha256, fingerprint(volume))
                if is_kept_of_it and kept.volume.spacing_um == spacing_um:
                    return kept
        return predict_volume(predictor, volume, spacing_um, path)


def _predict_scene(predictor: Predictor, scene: Scene) -> Prediction:
    description = predictor.checkpoint.description
    samples = network_volume(scene, description.sampling)
    predicted = predictor.predict_samples(samples, scene.grid.spacing_um)
    name = f"synthetic-{scene.seed.series}-{scene.seed.scene}.npy"
    reference = VolumeReference(
        path=name,
        shape=scene.grid.shape,
        dtype=description.sampling.dtype,
        spacing_um=scene.grid.spacing_um,
        # There is no volume whose content could be known by.
        fingerprint=hashlib.sha256(samples.tobytes()).hexdigest(),
    )
    return prediction_of(
        predicted,
        fit_prediction(predicted, description),
        reference,
        reference_to_checkpoint(predictor.checkpoint, Path(name)),
        scene.tool,
    )
