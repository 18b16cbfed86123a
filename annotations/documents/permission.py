"""Whether a person may see the others' work on a volume now, by the rules of the study."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from annotations.documents.files import load_annotation
from annotations.documents.study import AnnotationName, Study, annotation_path
from annotations.errors import UserError


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


def while_at_work(study: Study) -> Permission:
    """Return what an annotator may see of a volume as long as the own work on it is not done."""
    reason = "Your own annotation of this volume is not done yet"
    return Permission(may_see=False, may_look=study.viewing.may_look, reason=reason)


def permission(study: Study, folder: Path, person: str, volume_id: str) -> Permission:
    """Return what a person may see of a volume; the files of that person are read.

    A person's own work on a volume is done when every pass by each of their methods is: whoever has seen
    the others' keypoints does not place boxes blindly any more.
    """
    if study.is_reviewer(person) and person not in study.annotators:
        return FREE
    if any(True for _ in _unfinished(study, folder, person, volume_id)):
        return while_at_work(study)
    if study.viewing.others == "never" and not study.is_reviewer(person):
        return Permission(may_see=False, reason="In this study annotators do not see each other's work")
    return FREE


def _unfinished(study: Study, folder: Path, person: str, volume_id: str) -> Iterator[AnnotationName]:
    volume = study.volume(volume_id)
    for method in study.methods_of(person):
        for repeat in range(volume.repeats + 1):
            status = None
            with contextlib.suppress(UserError):
                path = annotation_path(folder, person, volume_id, method, repeat)
                status = load_annotation(path)[0].status
            if status != "done":
                yield AnnotationName(volume_id, method, repeat)
