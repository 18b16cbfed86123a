"""``annotations predict``: what a checkpoint says of volumes. Needs no torch."""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from annotations.cli.output import complain, show_progress, write_json, write_text
from annotations.documents.study import StudyVolume, load_study
from annotations.durable_files import check_writable
from annotations.errors import UserError
from annotations.prediction.checkpoint import Checkpoint, load_checkpoint
from annotations.prediction.prediction import Prediction
from annotations.prediction.prediction_file import (
    checkpoint_folder,
    loose_prediction_path,
    save_prediction,
    study_prediction_path,
)
from annotations.prediction.predictor import Predictor
from annotations.prediction.runtime import Runtime
from annotations.prediction.shipped import find_checkpoint
from annotations.prediction.volume_prediction import predict_volume
from annotations.volumes import DatasetChoiceNeeded, SpacingUm, Volume, open_volume, validate_spacing_um


@dataclass(frozen=True)
class _Wanted:
    """A volume to predict.

    Attributes
    ----------
    path : Path
    dataset : str or None
    spacing_um : (float, float, float) or None
        What its study says.
    volume_id : str
        In the study; empty outside.
    """

    path: Path
    dataset: str | None
    spacing_um: SpacingUm | None = None
    volume_id: str = ""


def run(arguments: argparse.Namespace) -> int:
    """Predict each volume; return the exit code."""
    _check_use(arguments)
    wanted = list(_wanted(arguments))
    checkpoint = load_checkpoint(find_checkpoint(arguments.checkpoint))
    # Before anything is predicted.
    check_writable(_folder(checkpoint, arguments))
    predictor = Predictor(checkpoint, Runtime(checkpoint))
    code = 0
    for number, volume in enumerate(wanted):
        show_progress(number / len(wanted))
        try:
            fields, words = _predict(volume, predictor, arguments)
        except UserError as error:
            complain(error)
            fields, words, code = {"path": str(volume.path), "error": str(error)}, "", 1
        if arguments.json:
            write_json(fields)
        elif words:
            write_text(words)
    show_progress(1.0)
    return code


def _check_use(arguments: argparse.Namespace) -> None:
    if bool(arguments.volumes) == (arguments.study is not None):
        arguments.misuse("name volumes, or a study with --study, and not both")
    if arguments.volumes and arguments.output is None:
        arguments.misuse("-o/--output says where the predictions of volumes go")
    if arguments.study is not None:
        for option, value in (("-o/--output", arguments.output), ("--dataset", arguments.dataset)):
            if value is not None:
                arguments.misuse(f"{option} is for volumes: a study says that itself")


def _wanted(arguments: argparse.Namespace) -> Iterator[_Wanted]:
    if arguments.study is None:
        for path in arguments.volumes:
            yield _Wanted(path, arguments.dataset)
        return
    volumes: tuple[StudyVolume, ...] = load_study(arguments.study).volumes
    if not volumes:
        raise UserError("the study has no volumes", where=arguments.study, remedy="Add some to it first")
    for volume in volumes:
        yield _Wanted(arguments.study / volume.path, volume.dataset, volume.spacing_um, volume.id)


def _predict(
    wanted: _Wanted, predictor: Predictor, arguments: argparse.Namespace
) -> tuple[dict[str, Any], str]:
    """Predict one volume, and keep it; return what is to be said as fields and in words."""
    try:
        volume = open_volume(wanted.path, dataset=wanted.dataset)
    except DatasetChoiceNeeded as error:
        remedy = "Choose one of them by its name: --dataset NAME, or dataset in study.toml"
        raise UserError(error.problem, where=error.where, remedy=remedy) from error
    with volume:
        path = _prediction_path(volume, wanted.volume_id, predictor.checkpoint, arguments)
        spacing_um = _spacing_um(volume, wanted.spacing_um, arguments.spacing_um)
        prediction = predict_volume(predictor, volume, spacing_um, path)
    save_prediction(prediction, path)
    fields = {
        "path": str(wanted.path),
        "prediction": str(path),
        "keypoints": {each.name: each.position_um for each in prediction.keypoints},
        "angles_deg": dict(prediction.pose.angles_deg) if prediction.pose else None,
        "rms_um": prediction.pose.rms_um if prediction.pose else None,
        "left_out": list(prediction.pose.left_out) if prediction.pose else [],
    }
    return fields, _in_words(prediction, wanted.path, path)


def _folder(checkpoint: Checkpoint, arguments: argparse.Namespace) -> Path:
    if arguments.study is None:
        return Path(arguments.output)
    return checkpoint_folder(arguments.study, checkpoint.description.name, checkpoint.sha256)


def _prediction_path(
    volume: Volume, volume_id: str, checkpoint: Checkpoint, arguments: argparse.Namespace
) -> Path:
    if volume_id:
        return study_prediction_path(
            arguments.study, checkpoint.description.name, checkpoint.sha256, volume_id
        )
    return loose_prediction_path(arguments.output, volume)


def _spacing_um(
    volume: Volume, of_study_um: SpacingUm | None, given_um: Sequence[float] | None
) -> SpacingUm | None:
    """Return the spacing by the same precedence as the application."""
    if given_um is not None:
        return validate_spacing_um(given_um)
    if of_study_um is None or volume.spacing_source in ("sidecar", "file"):
        return volume.spacing_um
    return of_study_um


def _in_words(prediction: Prediction, volume_path: Path, path: Path) -> str:
    lines = [str(volume_path), f"  prediction   {path}"]
    unseen = [
        f"{each.name} ({each.state.replace('_', ' ')})"
        for each in prediction.keypoints
        if each.state != "placed"
    ]
    if unseen:
        lines.append(f"  not in view  {', '.join(unseen)}")
    pose = prediction.pose
    if pose is None:
        lines.append("  pose         unknown: the keypoints do not tell it")
    else:
        angles = ", ".join(f"{name} {angle_deg:.1f}°" for name, angle_deg in pose.angles_deg.items())
        lines.append(
            f"  pose         {angles + ', ' if angles else ''}{pose.rms_um:.0f} µm from the keypoints"
        )
        if pose.left_out:
            lines.append(f"  left out     {', '.join(pose.left_out)}: the tool cannot have them there")
    return "\n".join(lines)
