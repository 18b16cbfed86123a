"""The annotators of a study in the order in which they are shown, and their names in one to three letters."""

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import groupby, takewhile
from pathlib import Path

from annotations.documents.annotation import Annotation
from annotations.documents.files import load_annotation
from annotations.documents.standing import standing
from annotations.documents.study import CONSENSUS, annotation_files
from annotations.errors import UserError

# With more letters it is no abbreviation any more.
_LONGEST_TAIL = 2
# No letter, so that it is nobody's.
_CONSENSUS = "≡"


def has_placed(document: Annotation) -> bool:
    """Say whether a person placed anything in a document: a synthetic volume's truth is nobody's."""
    return any(standing(part) == "counted" for part in document.parts)


def people_of(folder: Path) -> tuple[str, ...]:
    """Return whose files below a folder say anything that a person placed, as the report counts them.

    The consensus is among them, where there is one.
    """
    return tuple(
        name
        for name, paths in groupby(annotation_files(folder), lambda path: path.parent.name)
        if any(_says_anything(path) for path in paths)
    )


def _says_anything(path: Path) -> bool:
    try:
        return _file_says_anything(path, path.stat().st_mtime_ns)
    except OSError:
        return False


# Of one whose files are all a program's, every file is looked at, for every volume that is opened.
@lru_cache(maxsize=4096)
def _file_says_anything(path: Path, _mtime_ns: int) -> bool:
    try:
        return has_placed(load_annotation(path)[0])
    except UserError:
        return False


def in_order(names: Iterable[str], listed: Sequence[str] = ()) -> tuple[str, ...]:
    """Return annotators in the order in which they are shown: as they are listed, then by name.

    Parameters
    ----------
    names : iterable of str
        All of them.
    listed : sequence of str
        Those that come first, as far as they are among the names. The study's consensus comes last, so that
        nobody is drawn otherwise once there is one: it is nobody's own.
    """
    known = set(names)
    first = dict.fromkeys(name for name in listed if name in known)
    ordered = [*first, *sorted(known - first.keys(), key=lambda name: (name.casefold(), name))]
    return tuple(sorted(ordered, key=lambda name: name == CONSENSUS))


def initials(names: Sequence[str]) -> Mapping[str, str]:
    """Return a short name for each annotator, all different.

    Those who share a first letter get the letters after it in which they differ: rater01 and rater02 are
    R1 and R2. The consensus shares with nobody.
    """
    made: dict[str, str] = {}
    people = [name for name in names if name != CONSENSUS]
    for number, name in enumerate(people):
        sharing = [other for other in people if other[:1].casefold() == name[:1].casefold()]
        short = name[:1].upper() + _telling_tail(name, sharing).upper()
        made[name] = f"{name[:1].upper()}{number + 1}" if short in made.values() else short
    return made | {name: _CONSENSUS for name in names if name == CONSENSUS}


def _telling_tail(name: str, sharing: Sequence[str]) -> str:
    """Return as few letters as tell a name from those that begin alike."""
    if len(sharing) == 1:
        return ""
    folded = [other.casefold() for other in sharing]
    shared = sum(1 for _ in takewhile(_are_one, zip(*folded, strict=False)))
    for length in range(1, _LONGEST_TAIL):
        if len({other[shared : shared + length] for other in folded}) == len(folded):
            return name[shared : shared + length]
    return name[shared : shared + _LONGEST_TAIL]


def _are_one(letters: tuple[str, ...]) -> bool:
    return len(set(letters)) == 1
