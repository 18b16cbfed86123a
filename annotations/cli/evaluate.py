"""``annotations evaluate``: how far a checkpoint's keypoints are from what people say, or from the truth."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from annotations.agreement.report.labels import listed
from annotations.cli.output import remark, show_progress, write_json, write_text
from annotations.documents.files import document_bytes
from annotations.documents.study import load_study
from annotations.durable_files import replace_durably
from annotations.errors import UserError, first_problem
from annotations.interchange.split import SplitRule, split_rule
from annotations.learning.training.stages import learned_fingerprints, said_settings, seen_seeds
from annotations.prediction.checkpoint import Checkpoint, load_checkpoint
from annotations.prediction.checkpoint_description import TrainingSummary
from annotations.prediction.errors.evaluation import (
    Evaluation,
    HeldOut,
    SyntheticVolumes,
    evaluate_study,
    evaluate_synthetic,
)
from annotations.prediction.errors.study_errors import Truth
from annotations.prediction.predictor import Predictor
from annotations.prediction.report.exporting import check_report_places, export_errors
from annotations.prediction.report.file_names import report_paths
from annotations.prediction.report.material import ReportMaterial, report_material
from annotations.prediction.report.text_report import text_of
from annotations.prediction.runtime import Runtime
from annotations.prediction.shipped import find_checkpoint
from annotations.synthesis.conditions import PLAIN_CONDITIONS, TRAINING_CONDITIONS, SceneConditions

_SEED = 2_000_003
_OF_SYNTHETIC = ("seed", "conditions", "looks", "noise_sigma_grey")
_OF_STUDIES = ("annotator", "method", "shares", "split_seed", "anew")


def run(arguments: argparse.Namespace) -> int:
    """Predict and compare; return the exit code: 1 where nothing could be compared, or a volume could not."""
    _check_use(arguments)
    if arguments.report is not None:
        # Before everything is predicted.
        check_report_places(report_paths(arguments.report))
    paths = (arguments.checkpoint, *(arguments.against or ()))
    checkpoints = [load_checkpoint(find_checkpoint(path)) for path in paths]
    if len({checkpoint.sha256 for checkpoint in checkpoints}) < len(checkpoints):
        arguments.misuse("a checkpoint cannot be compared with itself: name each once")
    evaluations, about, besides = (_on_study if arguments.synthetic is None else _on_synthetic)(
        arguments, checkpoints
    )
    material = report_material(
        evaluations[0].tool,
        Truth() if arguments.study is None else _truth(arguments, checkpoints[0]),
        [each.table for each in evaluations],
        [each.predictions for each in evaluations],
        arguments.study,
        remarks=[besides] if besides else (),
    )
    _write(arguments.json, material, {"checkpoint": str(arguments.checkpoint), **about}, besides)
    if arguments.report is not None:
        export_errors(material, arguments.study, report_paths(arguments.report), progress=show_progress)
    return 1 if any(table.unjudged or not table.independent_rows for table in material.tables) else 0


def _on_synthetic(
    arguments: argparse.Namespace, checkpoints: Sequence[Checkpoint]
) -> tuple[list[Evaluation], dict[str, Any], str]:
    """Judge checkpoints by the same synthetic volumes; return what is to be said of these besides."""
    if len({checkpoint.description.tool.fingerprint for checkpoint in checkpoints}) > 1:
        raise UserError(
            "the checkpoints are for several tools, and synthetic volumes are made of one",
            where=arguments.checkpoint,
            remedy="Compare those of one tool",
        )
    # Each is asked: none may have seen them in its training.
    made, *_ = [_synthetic(arguments, checkpoint) for checkpoint in checkpoints]
    evaluations = [
        evaluate_synthetic(Predictor(checkpoint, Runtime(checkpoint)), made, _progress(place, checkpoints))
        for place, checkpoint in enumerate(checkpoints)
    ]
    about = {
        "synthetic": {
            "count": made.count,
            "seed": made.seed,
            "conditions": made.conditions.model_dump(mode="json"),
        }
    }
    return evaluations, about, _conditions_in_words(made.conditions)


def _on_study(
    arguments: argparse.Namespace, checkpoints: Sequence[Checkpoint]
) -> tuple[list[Evaluation], dict[str, Any], str]:
    """Judge checkpoints by the same annotations; return what is to be said of these besides."""
    held_out = _held_out(arguments, checkpoints)
    truth = _truth(arguments, checkpoints[0])
    evaluations = [
        evaluate_study(
            Predictor(checkpoint, Runtime(checkpoint)),
            arguments.study,
            truth,
            held_out,
            takes_kept=not arguments.anew,
            progress=_progress(place, checkpoints),
        )
        for place, checkpoint in enumerate(checkpoints)
    ]
    for each in evaluations:
        for error in each.unread:
            remark(f"{error.where or arguments.study}: {error.problem}. The volume was predicted again")
    about: dict[str, Any] = {"study": str(arguments.study), "split": arguments.split}
    if held_out is not None:
        about |= {"shares": held_out.rule.shares, "split_seed": held_out.rule.seed}
    return evaluations, about, _doubt(arguments, checkpoints)


def _progress(place: int, checkpoints: Sequence[Checkpoint]) -> Callable[[float], None]:
    return lambda share: show_progress((place + share) / len(checkpoints))


def _check_use(arguments: argparse.Namespace) -> None:
    if (arguments.study is None) == (arguments.synthetic is None):
        arguments.misuse("name a study, or say how many volumes to make with --synthetic, and not both")
    is_made = arguments.synthetic is not None
    for name in _OF_STUDIES if is_made else _OF_SYNTHETIC:
        if getattr(arguments, name) is not None:
            arguments.misuse(
                f"--{name.replace('_', '-')} is for {'studies' if is_made else 'synthetic volumes'}"
            )
    if is_made and arguments.split != "all":
        arguments.misuse("--split is for studies")
    if arguments.split == "all" and (arguments.shares is not None or arguments.split_seed is not None):
        arguments.misuse("--shares and --split-seed are for one part of the split: say which with --split")


def _synthetic(arguments: argparse.Namespace, checkpoint: Checkpoint) -> SyntheticVolumes:
    seed = _SEED if arguments.seed is None else arguments.seed
    if seed in seen_seeds(checkpoint.description.training):
        raise UserError(
            f"the checkpoint has seen the volumes of seed {seed} in its training",
            where=checkpoint.path,
            remedy="Take another with --seed",
        )
    conditions = PLAIN_CONDITIONS if arguments.conditions == "plain" else TRAINING_CONDITIONS
    changes = {
        name: (value, value)
        for name in ("looks", "noise_sigma_grey")
        if (value := getattr(arguments, name)) is not None
    }
    try:
        conditions = SceneConditions.model_validate(conditions.model_dump() | changes)
    except ValidationError as error:
        arguments.misuse(f"--looks or --noise-sigma-grey is out of range: {first_problem(error)}")
    return SyntheticVolumes(arguments.synthetic, seed, conditions)


def _conditions_in_words(conditions: SceneConditions) -> str:
    said = conditions.model_dump(mode="json", exclude_none=True)
    return "conditions: " + ", ".join(
        f"{name} {'–'.join(f'{each:g}' for each in value) if isinstance(value, list) else f'{value:g}'}"
        for name, value in said.items()
    )


def _held_out(arguments: argparse.Namespace, checkpoints: Sequence[Checkpoint]) -> HeldOut | None:
    if arguments.split == "all":
        return None
    trainings = [checkpoint.description.training for checkpoint in checkpoints]
    # All are judged by the same volumes, none of which any of them was trained on.
    trained_on = frozenset[str]().union(*map(learned_fingerprints, trainings))
    rule, named = _part_of_training(arguments, checkpoints[0])
    return HeldOut(arguments.split, rule, trained_on, named)


def _truth(arguments: argparse.Namespace, checkpoint: Checkpoint) -> Truth:
    """Return whose annotations are asked for, else those of the training if it was on this study."""
    method, annotator = arguments.method, arguments.annotator
    settings = said_settings(_on_studies(checkpoint))
    if settings is not None and _is_of_training(arguments, checkpoint):
        # With other annotations other volumes would be split.
        method = settings.annotated.method if method is None else method
        annotator = settings.annotated.annotator if annotator is None else annotator
    return Truth(method=method, annotator=annotator)


def _is_of_training(arguments: argparse.Namespace, checkpoint: Checkpoint) -> bool:
    title = load_study(arguments.study).title
    return any(title in stage.studies for stage in checkpoint.description.training.stages)


def _on_studies(checkpoint: Checkpoint) -> TrainingSummary:
    """Return the last training of the checkpoint that was on studies, or the last of all."""
    stages = checkpoint.description.training.stages
    return next((stage for stage in reversed(stages) if stage.studies), stages[-1])


def _part_of_training(
    arguments: argparse.Namespace, checkpoint: Checkpoint
) -> tuple[SplitRule, frozenset[str] | None]:
    """Return the split that was asked for, else that of the training, and if need be the part's volumes."""
    training = _on_studies(checkpoint)
    shares, seed = arguments.shares, arguments.split_seed
    if shares is not None and seed is not None:
        return split_rule(shares, seed), None
    settings = said_settings(training)
    if not training.studies or settings is None:
        raise UserError(
            "the checkpoint does not say that it was trained on a study, and knows of no split",
            where=arguments.checkpoint,
            remedy="Take all volumes, or say what split with --shares and --split-seed",
        )
    rule = split_rule(
        settings.annotated.shares if shares is None else shares,
        settings.annotated.split_seed if seed is None else seed,
    )
    if len(training.studies) == 1:
        return rule, None
    # Split together, so that the rule does not find the parts of one study.
    known = {"train": training.training_fingerprints, "validation": training.validation_fingerprints}
    named = frozenset(known.get(arguments.split, ()))
    if not named or rule != settings.annotated.rule:
        raise UserError(
            "the checkpoint was trained on several studies, whose volumes were split together, and does not "
            "name those of this part",
            where=arguments.checkpoint,
            remedy="Take a study that it was not trained on, or say what split with --shares and "
            "--split-seed",
        )
    return rule, named


def _doubt(arguments: argparse.Namespace, checkpoints: Sequence[Checkpoint]) -> str:
    """Say that volumes of the training are among those that they are judged by; empty where they are not."""
    suspects = [
        checkpoint.description.name for checkpoint in checkpoints if _is_of_training(arguments, checkpoint)
    ]
    if arguments.split != "all" or not suspects:
        return ""
    who = "the checkpoint" if len(checkpoints) == 1 else listed(suspects)
    return (
        f"{who} was trained on volumes of this study: the errors of new ones are larger; "
        "--split validation leaves those of the training out"
    )


def _write(output: Path | None, material: ReportMaterial, about: dict[str, Any], besides: str) -> None:
    first, *others = material.tables
    fields = {**about, "remark": besides, "errors": first.model_dump(mode="json")}
    if others:
        fields["against"] = [table.model_dump(mode="json") for table in others]
    if output == Path("-"):
        write_json(fields)
        return
    write_text(text_of(material).rstrip())
    if output is not None:
        replace_durably(output, document_bytes(fields))
