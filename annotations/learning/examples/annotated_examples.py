"""Examples from the annotated volumes of studies. Needs no torch."""

import hashlib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from annotations.app_folders import tool_folder
from annotations.documents.study import Study, load_study
from annotations.documents.volume_link import compare
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotations.interchange.speaking_documents import (
    Choice,
    LeftOut,
    SpeakingDocument,
    speaking_documents,
)
from annotations.interchange.split import split_of
from annotations.learning.examples.examples import AnnotatedExamples, Example
from annotations.learning.settings.training_settings import AnnotatedSettings
from annotations.prediction.errors.prediction_errors import positions_array_um
from annotations.prediction.errors.study_errors import true_positions_um
from annotations.volumes import Volume, VolumeError, fingerprint, open_volume
from annotations.volumes.sampling import Sampling, check_fits, sample_volume
from annotations.volumes.spacing import SpacingUm


@dataclass(frozen=True)
class FoundStudy:
    """A study, with the tool that it names.

    Attributes
    ----------
    folder : Path
    study : Study
    tool : ToolSpecification
    """

    folder: Path
    study: Study
    tool: ToolSpecification


def find_studies(folders: Sequence[Path]) -> tuple[FoundStudy, ...]:
    """Return the studies in folders, which must be of one tool.

    Raises
    ------
    UserError
        A study or its tool cannot be read, or two studies are of different tools.
    """
    found: list[FoundStudy] = []
    for folder in folders:
        study = load_study(folder)
        tool = find_tool(study.tool, (folder / "tools", tool_folder()))
        if found and tool.fingerprint != found[0].tool.fingerprint:
            raise UserError(
                f"its tool is another than that of {found[0].folder}: {tool.name!r}, not "
                f"{found[0].tool.name!r}, or one with other measures",
                where=folder,
                remedy="Train on the studies of one tool at a time",
            )
        found.append(FoundStudy(folder, study, tool))
    return tuple(found)


def annotated_examples(
    studies: Sequence[FoundStudy],
    sampling: Sampling,
    settings: AnnotatedSettings,
    say: Callable[[str], None] = lambda _line: None,
    stopped: Callable[[], bool] = lambda: False,
    learned: Collection[str] = (),
) -> AnnotatedExamples:
    """Sample the volumes for which an annotation speaks; they are read once and kept in memory.

    A position that is itself a network's, and that nobody has touched since, is no label: a network shall not
    learn its own errors.

    Parameters
    ----------
    studies : sequence of FoundStudy
    sampling : Sampling
    settings : AnnotatedSettings
        Whose annotations, and which volumes are held out.
    say : callable, optional
        Told what is read, and what is left out and why.
    stopped : callable, optional
        Asked before each volume whether to stop.
    learned : collection of str, optional
        Fingerprints of volumes that the network has learned from before. Wherever the split puts them, they
        are for training: they would flatter it.

    Raises
    ------
    UserError
        No volume has such an annotation; a volume cannot be read, or is not the one that was annotated.
    Cancelled
        `stopped` returned true.
    """
    found: list[tuple[FoundStudy, SpeakingDocument]] = []
    for one in studies:
        choice = Choice(settings.method, settings.annotator)
        tool_folders = (one.folder / "tools", tool_folder())
        documents, left_out = speaking_documents(one.study, one.folder, one.tool, tool_folders, choice)
        for said in _left_out(left_out):
            say(f"{one.folder}: {said}")
        if not documents:
            raise UserError(
                f"no volume has an annotation by {settings.method} to train on",
                where=one.folder,
                remedy="Finish annotations, make the consensus, or say whose to take (annotated.annotator)",
            )
        found += [(one, document) for document in documents]
    fingerprints = [document.annotation.volume.fingerprint for _, document in found]
    splits = split_of(
        [
            (f"{studies.index(one)}/{document.volume.id}", of_volume)
            for (one, document), of_volume in zip(found, fingerprints, strict=True)
        ],
        settings.rule,
    )
    splits = tuple(
        "train" if of_volume in learned else split
        for split, of_volume in zip(splits, fingerprints, strict=True)
    )
    sampled: dict[str, list[Example]] = {"train": [], "validation": []}
    for number, ((one, document), split) in enumerate(zip(found, splits, strict=True)):
        if stopped():
            raise Cancelled
        if split in sampled:
            sampled[split].append(_example(one, document, sampling))
            if (number + 1) % 10 == 0 or number + 1 == len(found):
                say(f"read {number + 1} of {len(found)} annotated volumes")
    described = "\n".join(
        f"{split} {document.sha256}" for (_, document), split in zip(found, splits, strict=True)
    )
    return AnnotatedExamples(
        tuple(sampled["train"]),
        tuple(sampled["validation"]),
        tuple(one.study.title for one in studies),
        hashlib.sha256(described.encode()).hexdigest(),
        *(
            tuple(sorted({each for each, split in zip(fingerprints, splits, strict=True) if split == wanted}))
            for wanted in sampled
        ),
    )


def _example(found: FoundStudy, document: SpeakingDocument, sampling: Sampling) -> Example:
    reference = document.annotation.volume
    with open_volume(found.folder / document.volume.path, dataset=document.volume.dataset) as volume:
        for finding in compare(reference, volume, fingerprint(volume)):
            raise UserError(
                finding.problem,
                where=volume.path,
                remedy=f"Say with 'annotations check {found.folder}' what else is wrong, and mend it",
            )
        _check_fits(volume, reference.spacing_um, sampling)
        samples = sample_volume(volume, reference.spacing_um, sampling)
    (keypoints_um,) = positions_array_um([true_positions_um(document.annotation, document.tool)], found.tool)
    return Example(
        # Half the memory, and exact enough for the means of bytes.
        samples.astype(np.float16) if sampling.dtype == "uint8" else samples,
        keypoints_um,
        reference.spacing_um,
    )


def _check_fits(volume: Volume, spacing_um: SpacingUm, sampling: Sampling) -> None:
    try:
        check_fits(volume, spacing_um, sampling)
    except VolumeError as error:
        # Its own remedy is for those who have a checkpoint already.
        raise UserError(
            error.problem,
            where=error.where,
            remedy="Say in the settings how such volumes are sampled ([sampling]), or correct what this one "
            "says of itself",
        ) from error


def _left_out(left_out: Sequence[LeftOut]) -> list[str]:
    """Say what is left out: one by one where a person should look at it, else how many."""
    said = [
        f"left out, {one.volume_id}: {one.reason}" for one in left_out if one.kind in ("several", "unusable")
    ]
    others = len(left_out) - len(said)
    return [*said, f"left out, {others} without a finished annotation"] if others else said
