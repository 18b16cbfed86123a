"""Whether a person may see the others' work on a volume now, by the rules of the study."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from annotations.documents.files import load_annotation
from annotations.documents.queue import queue
from annotations.documents.study import AnnotationName, Study, annotation_path
from annotations.errors import Cancelled, UserError

_NEVER = "In this study annotators see neither each other's work nor predictions"


@dataclass(frozen=True)
class Permission:
    """What a person may do about other people's annotations, and a network's predictions, of one volume.

    Attributes
    ----------
    may_see : bool
        They can be shown.
    may_look : bool
        They can be shown although the person's own work is not done, and that is written into the document.
    reason : str
        Why they cannot be shown, as a sentence without its full stop; empty where they can.
    """

    may_see: bool
    may_look: bool = False
    reason: str = ""


FREE = Permission(may_see=True)
"""Outside a study nobody is kept from seeing anything."""


def while_at_work(study: Study, person: str) -> Permission:
    """Return what an annotator may see of a volume as long as the own work on it is not done."""
    if study.viewing.others == "always":
        return FREE
    if not study.ever_shows_others_to(person):
        reason = _NEVER
    elif study.has_repeats:
        # The same words for every volume: which ones come again is not to be known.
        reason = "You see the others' work and predictions once all of your own work in this study is done"
    elif len(study.methods_of(person)) > 1:
        reason = "Your own annotation of this volume is not done yet by each of your methods"
    else:
        reason = "Your own annotation of this volume is not done yet"
    return Permission(may_see=False, may_look=study.viewing.may_look, reason=reason)


def permission(study: Study, folder: Path, person: str, volume_id: str) -> Permission:
    """Return what a person may see of a volume; the files of that person are read.

    A person's own work on a volume is done when it is by each of their methods: whoever has seen the others'
    keypoints does not place boxes blindly any more. Where volumes come again, it is all of the person's work
    in the study that must be done: else what is shown would tell which of them are still to come.
    """
    if study.is_reviewer(person) and person not in study.annotators:
        return FREE
    if any(True for _ in _unfinished(study, folder, person, volume_id)):
        return while_at_work(study, person)
    if not study.ever_shows_others_to(person):
        return Permission(may_see=False, reason=_NEVER)
    return FREE


def keeps_passes_apart(study: Study, folder: Path, person: str) -> bool:
    """Say whether a person is not to know yet which volumes come again; the files of that person are read.

    So it is in blind work, until all of it is done.
    """
    if not (study.is_blind_for(person) and study.has_repeats):
        return False
    return any(True for _ in _unfinished(study, folder, person))


def check_may_see_all(
    study: Study, folder: Path, person: str, problem: str, cancelled: Callable[[], bool] = lambda: False
) -> None:
    """Look whether a person may see everybody's work on every volume, by whichever method.

    Parameters
    ----------
    problem : str
        What is said where the person may not yet.
    cancelled : callable, optional
        Asked before each volume whether to stop.

    Raises
    ------
    UserError
        The person's own work is not done, or the study shows it to reviewers alone.
    Cancelled
        `cancelled` returned true.
    """
    # Where volumes come again, all have the same answer, for which all files are read.
    for volume in study.volumes[:1] if study.has_repeats else study.volumes:
        if cancelled():
            raise Cancelled
        if not permission(study, folder, person, volume.id).may_see:
            if not study.ever_shows_others_to(person):
                raise UserError(f"{problem}. {_NEVER}", remedy="Leave this to the study's reviewers")
            raise UserError(
                problem, remedy="Finish your own work in this study first, by each of your methods"
            )


def _unfinished(
    study: Study, folder: Path, person: str, volume_id: str | None = None
) -> Iterator[AnnotationName]:
    """Yield what the person has not done: of a volume; of all, where none is named or some come again."""
    of_all = volume_id is None or study.has_repeats
    for method in study.methods_of(person):
        # From the end: that is where most is left, and the first that is found is enough.
        for place in reversed(queue(study, person, method)):
            if of_all or place.volume.id == volume_id:
                name = AnnotationName(place.volume.id, method, place.repeat)
                if not _is_done(annotation_path(folder, person, name.volume_id, method, name.repeat)):
                    yield name


def _is_done(path: Path) -> bool:
    with contextlib.suppress(UserError):
        document, _ = load_annotation(path)
        # An empty one that is called done is no work of one's own.
        return document.status == "done" and any(part.anchor_um is not None for part in document.parts)
    return False
