"""What a path leads to: in a study, and above all in a blind one, to the annotator's own queue."""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from annotations.documents.permission import permission
from annotations.documents.queue import queue
from annotations.documents.record import Method
from annotations.documents.study import (
    CONSENSUS,
    STUDY_FILE,
    AnnotationName,
    Study,
    annotation_name,
    load_study,
    study_folder_of,
)
from annotations.errors import UserError
from annotator.session.volumes.worklist import Worklist, is_moved, read_worklist

_LEFT_OUT = "What leads into a study that cannot be read is not listed: {}"


class LookNeeded(UserError):  # noqa: N818 - a question rather than an error
    """The path is another person's annotation, which may be looked at before one's own is done."""


class IdentityNeeded(UserError):  # noqa: N818 - a question rather than an error
    """The path leads into a study that does not name the person who opens it.

    Attributes
    ----------
    folder : Path
        The study's.
    study : Study
    """

    def __init__(self, folder: Path, study: Study, person: str) -> None:
        super().__init__(f"{person} neither annotates nor reviews in “{study.title}”", where=folder)
        self.folder = folder
        self.study = study


class KeptFromView(UserError):  # noqa: N818 - named for what happened
    """The path leads to what the annotator is not to see by name, or not yet."""


class RulesUnknown(KeptFromView):
    """The path leads into a study that cannot be read."""

    def __init__(self, folder: Path) -> None:
        super().__init__(
            "it cannot be read, so that nobody knows whether you may know the study's volumes by name",
            where=folder / STUDY_FILE,
            remedy="Open the study's folder to be told what is wrong",
        )


def read_path(
    path: Path,
    annotator: str,
    method: Method,
    *,
    looks_anyway: bool = False,
    is_settled: Callable[[Path, str], bool] = lambda _folder, _person: True,
) -> Worklist:
    """Find out what a path offers to an annotator, as `read_worklist`; in a study by its rules.

    A volume of a study leads to its place in the queue. So does another person's annotation for one of the
    study's annotators: it is shown over the own one. Whoever does not annotate in the study sees the file,
    or, of the consensus, its place in the list of the consensus. Outside of a study, see `without_kept`.

    Parameters
    ----------
    looks_anyway : bool
        Whether `LookNeeded` has been answered with yes.
    is_settled : callable
        From a study's folder and the annotator to whether they are not to be asked who they are.

    Raises
    ------
    KeptFromView, LookNeeded
        The study's rules forbid it, or want to be asked first.
    IdentityNeeded
        The study has annotators, and does not name this one.
    UserError
        The path is absent, or holds nothing that can be annotated.
    """
    path = path.absolute()
    # Of a study's own folder as well, in which no study lies as a rule.
    folder = study_folder_of(path / STUDY_FILE)
    real = _real(path)
    linked = study_folder_of(real / STUDY_FILE)
    if folder is None and linked is not None and load_study(linked).blind:
        # A link from outside would lead around the rules of blind work.
        path, folder = real, linked
    if folder is None:
        return without_kept(read_worklist(path, annotator, method), annotator, is_settled)
    study = load_study(folder)
    if study.annotators and not study.names(annotator) and not is_settled(folder, annotator):
        raise IdentityNeeded(folder, study, annotator)
    if path in (folder, folder / STUDY_FILE):
        return read_worklist(path, annotator, method)
    name = annotation_name(path)
    if path.parent.parent == folder / "annotations" and name is not None:
        return _of_annotation(study, folder, path, name, annotator, looks_anyway=looks_anyway)
    _refuse_if_blind(study, annotator)
    ids = [volume.id for volume in study.volumes if _real(folder / volume.path) == real]
    if not ids:
        return without_kept(read_worklist(path, annotator, method), annotator, is_settled)
    return _at(read_worklist(folder, annotator, method), ids[0])


def without_kept(
    worklist: Worklist, person: str, is_settled: Callable[[Path, str], bool], wanted: int | None = None
) -> Worklist:
    """Return a list without the links to what a person is not to see by name.

    Such a link would give a volume of a blind study a name, and its annotation a place outside of the study.

    Parameters
    ----------
    is_settled : callable
        See `read_path`.
    wanted : int, optional
        The place of what is to be opened, and nothing in its stead: it becomes the first. Without it that is
        the first of the list, but for a folder's.

    Raises
    ------
    KeptFromView, IdentityNeeded
        It is what is wanted, or nothing else is in the list.
    """
    if wanted is None and not worklist.is_folder:
        wanted = worklist.first
    first = worklist.first if wanted is None else wanted
    kept = _kept(worklist, person, is_settled)
    if kept and (first in kept if wanted is not None else len(kept) == len(worklist.items)):
        raise kept[first]
    places = [place for place in range(len(worklist.items)) if place not in kept]
    first = next((at for at, place in enumerate(places) if place >= first), 0)
    items = worklist.items if not kept else tuple(worklist.items[place] for place in places)
    unreadable = {str(each.where): None for each in kept.values() if isinstance(each, RulesUnknown)}
    left_out = _LEFT_OUT.format(", ".join(unreadable)) if unreadable else ""
    return replace(worklist, items=items, first=first, left_out=left_out)


def neutral_label(annotation_path: Path, annotator: str) -> str:
    """Return under which number an annotation is known to its annotator; empty where that is not blind.

    One whose folder is not there any more is named after the folder above: that may be of a blind study.
    """
    folder, name = study_folder_of(annotation_path), annotation_name(annotation_path)
    if is_moved(annotation_path):
        return f"An annotation in {annotation_path.parents[2].name}, which is not there any more"
    if folder is None or name is None:
        return ""
    try:
        study = load_study(folder)
    except UserError:
        return ""
    if not study.is_blind_for(annotator):
        return ""
    for place in queue(study, annotator, name.method):
        if (place.volume.id, place.repeat) == (name.volume_id, name.repeat):
            return f"Volume {place.number} of {study.title}"
    return f"A volume of {study.title}"


def _of_annotation(
    study: Study, folder: Path, path: Path, name: AnnotationName, annotator: str, *, looks_anyway: bool
) -> Worklist:
    known = any(volume.id == name.volume_id for volume in study.volumes)
    if path.parent.name == annotator or not known or annotator not in study.annotators:
        _refuse_if_blind(study, annotator)
        owner = CONSENSUS if path.parent.name == CONSENSUS else annotator
        queued = read_worklist(folder, owner, name.method)
        paths = [item.annotation_path for item in queued.items]
        return replace(queued, first=paths.index(path)) if path in paths else read_worklist(path, annotator)
    rules = permission(study, folder, annotator, name.volume_id)
    if not rules.may_see and not rules.may_look:
        is_too_early = study.ever_shows_others_to(annotator)
        remedy = "Finish your own annotation first, from the study's queue" if is_too_early else ""
        raise KeptFromView(rules.reason, remedy=remedy)
    if not rules.may_see and not looks_anyway:
        raise LookNeeded(rules.reason, remedy="Looking anyway is written into your annotation")
    return _at(read_worklist(folder, annotator, name.method), name.volume_id)


def _at(worklist: Worklist, volume_id: str) -> Worklist:
    """Return the list with the first pass over a volume that is not done as the one to open."""
    places = [index for index, item in enumerate(worklist.items) if item.volume_id == volume_id]
    left = [index for index in places if worklist.items[index].status != "done"]
    return replace(worklist, first=(left or places)[0])


def _kept(
    worklist: Worklist, person: str, is_settled: Callable[[Path, str], bool]
) -> dict[int, KeptFromView | IdentityNeeded]:
    """Return why a person is not to see them, by the places of links into studies that keep names."""
    refusals: dict[Path, KeptFromView | IdentityNeeded | None] = {}
    kept = {}
    for place, item in enumerate(worklist.items if worklist.study is None else ()):
        folder = study_folder_of(_real(item.volume_path)) if item.volume_path.is_symlink() else None
        if folder is None:
            continue
        if folder not in refusals:
            refusals[folder] = _refusal(folder, person, is_settled)
        if (refusal := refusals[folder]) is not None:
            kept[place] = refusal
    return kept


def _refusal(
    folder: Path, person: str, is_settled: Callable[[Path, str], bool]
) -> KeptFromView | IdentityNeeded | None:
    """Return why a study keeps its volumes' names from a person; None where it does not."""
    try:
        study = load_study(folder)
    except UserError:
        return RulesUnknown(folder)
    is_known = not study.annotators or study.names(person) or is_settled(folder, person)
    if study.blind and not is_known:
        return IdentityNeeded(folder, study, person)
    if study.is_blind_for(person):
        return KeptFromView(
            "it leads into a study in which you are not to know the volumes by name",
            remedy="Open the study's folder: its queue leads to every volume",
        )
    return None


def _refuse_if_blind(study: Study, annotator: str) -> None:
    if study.is_blind_for(annotator):
        raise KeptFromView(
            f"it belongs to “{study.title}”, in which you annotate without knowing the volumes by name",
            remedy="Open the study's folder: its queue leads to every volume",
        )


def _real(path: Path) -> Path:
    """Return where a path leads; links in a circle, which `Path.resolve` refuses, lead to themselves."""
    return Path(os.path.realpath(path))
