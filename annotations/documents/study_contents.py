"""What lies in a study's folder ``annotations``: annotation files, and what else there should not be."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from annotations.documents.checks import Finding
from annotations.documents.locks import TAKEOVER_LOG
from annotations.documents.study import AnnotationName, StudyError, annotation_name

Located = tuple[Path | None, Finding]
"""A finding, and the file or folder that it is about; None where it is about no single one."""

# A save takes no longer.
_SAVING_S = 60.0
# What desktops put into folders.
_OF_DESKTOPS = frozenset({"thumbs.db", "desktop.ini"})
_LOCK = ".lock"


@dataclass(frozen=True)
class KeptFile:
    """A file that is named like an annotation of a study.

    Attributes
    ----------
    path : Path
    person : str
        Whose folder it lies in.
    name : AnnotationName
    """

    path: Path
    person: str
    name: AnnotationName


@dataclass(frozen=True)
class StudyContents:
    """The files below a study's ``annotations``, told apart by their names.

    Attributes
    ----------
    files : tuple of KeptFile
    people : tuple of str
        Whose folders there are.
    locks : tuple of Path
    strays : tuple of Located
        What belongs to no annotation, or is left of one.
    """

    files: tuple[KeptFile, ...]
    people: tuple[str, ...]
    locks: tuple[Path, ...]
    strays: tuple[Located, ...]


def read_contents(folder: Path) -> StudyContents:
    """Look through a study's folder ``annotations``; StudyError where it may not be read.

    A person's folder that may not be read is among the strays.
    """
    above = folder / "annotations"
    files: list[KeptFile] = []
    people: list[str] = []
    locks: list[Path] = []
    strays: list[Located] = [
        (path, found) for path in _listed(folder) if (found := _left_by_saving(path)) is not None
    ]
    try:
        entries = _listed(above) if above.exists() else []
    except OSError as error:
        raise StudyError(
            f"it could not be read ({error.strerror or error})",
            where=above,
            remedy="Check that you may read it",
        ) from error
    for entry in entries:
        if not entry.is_dir():
            strays += _stray(entry, "belongs to nobody: only the annotators' folders are here")
            continue
        people.append(entry.name)
        try:
            inside = _listed(entry)
        except OSError as error:
            problem = f"it could not be read ({error.strerror or error}): what is in it is not checked"
            strays.append((entry, Finding("file", problem)))
            continue
        for path in inside:
            name = annotation_name(path)
            if path.suffix == _LOCK and annotation_name(path.with_suffix("")) is not None:
                locks.append(path)
            elif name is not None and path.is_file():
                files.append(KeptFile(path, entry.name, name))
            else:
                strays += _left_of_annotation(path)
    return StudyContents(tuple(files), tuple(people), tuple(locks), tuple(strays))


def _listed(folder: Path) -> list[Path]:
    return sorted(folder.iterdir())


def _left_of_annotation(path: Path) -> Iterator[Located]:
    if path.name == TAKEOVER_LOG:
        yield path, Finding("note", "it says whose locks were taken over here")
    elif path.name.endswith(".theirs.bak"):
        problem = "another version of an annotation, which somebody chose to overwrite, is kept here"
        yield path, Finding("note", problem)
    elif path.suffix == ".bak":
        kept = path.with_suffix("")
        if annotation_name(kept) is None:
            yield from _stray(path, "is no annotation's backup")
        elif not kept.exists():
            problem = f"{kept.name} is gone, and this backup is what is left of it"
            yield path, Finding("missing", problem)
    else:
        expected = "<volume id>.<method>.json or <volume id>.<method>.repeatN.json"
        yield from _stray(path, f"is not named like an annotation, {expected}")


def _stray(path: Path, problem: str) -> Iterator[Located]:
    left = _left_by_saving(path)
    if left is not None:
        yield path, left
    elif not path.name.startswith(".") and path.name.casefold() not in _OF_DESKTOPS:
        yield path, Finding("stray", f"it {problem}")


def _left_by_saving(path: Path) -> Finding | None:
    """Return what is to be said of a temporary file that no save is at work on any more."""
    if path.suffix != ".partial":
        return None
    try:
        age_s = time.time() - path.stat().st_mtime
    except OSError:
        # It has taken its real name meanwhile.
        return None
    return Finding("stray", "a save that was cut short left it: delete it") if age_s > _SAVING_S else None
