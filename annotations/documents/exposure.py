"""What a person may know of the others' work on a volume, as far as the study's files show it."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from annotations.documents.annotation import Annotation
from annotations.documents.files import load_annotation
from annotations.documents.permission import permission
from annotations.documents.provenance import Viewing
from annotations.documents.study import AnnotationName, Study, annotation_path
from annotations.errors import UserError


@dataclass(frozen=True)
class Exposure:
    """What a person may know of the others' work on one volume.

    Attributes
    ----------
    could_see : bool
        The others' annotations can be shown to that person, or could be at an earlier time: so that a change
        of what was done may have been shaped by them.
    viewings : tuple of Viewing
        What was shown while any of the person's documents of the volume was open, oldest first: whoever has
        seen the others' keypoints does not place boxes blindly any more.
    """

    could_see: bool
    viewings: tuple[Viewing, ...]


def exposure(study: Study, folder: Path, person: str, volume_id: str) -> Exposure:
    """Return what a person may know of a volume; the study's files are looked at."""
    own = tuple(_own_documents(study, folder, person, volume_id))
    viewings = sorted(
        (viewing for document in own for viewing in document.viewings), key=lambda viewing: viewing.moment
    )
    was_shown = any(viewing.shown == "annotations" for viewing in viewings)
    could_see = was_shown or any(document.reopened is not None for document in own)
    if not could_see and permission(study, folder, person, volume_id).may_see:
        could_see = any(_others_files(study, folder, person, volume_id))
    return Exposure(could_see, tuple(viewings))


def _own_documents(study: Study, folder: Path, person: str, volume_id: str) -> Iterator[Annotation]:
    for name in _names(study, volume_id):
        with contextlib.suppress(UserError):
            yield load_annotation(annotation_path(folder, person, volume_id, name.method, name.repeat))[0]


def _others_files(study: Study, folder: Path, person: str, volume_id: str) -> Iterator[Path]:
    # Asked for by name: in a large study listing every file would take seconds.
    names = [name.file_name for name in _names(study, volume_id)]
    for theirs in folder.glob("annotations/*"):
        if theirs.name != person:
            yield from (theirs / name for name in names if (theirs / name).is_file())


def _names(study: Study, volume_id: str) -> Iterator[AnnotationName]:
    # By any method: somebody may have worked by another one before the assignments were changed.
    for method in study.methods:
        for repeat in range(study.volume(volume_id).repeats + 1):
            yield AnnotationName(volume_id, method, repeat)
