"""The annotators of a study in the order in which they are shown, and their names in one to three letters."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import takewhile

from annotations.documents.study import CONSENSUS

# With more letters it is no abbreviation any more.
_LONGEST_TAIL = 2


def in_order(names: Iterable[str], listed: Sequence[str] = (), last: Iterable[str] = ()) -> tuple[str, ...]:
    """Return annotators in the order in which they are shown: as they are listed, then by name.

    Parameters
    ----------
    names : iterable of str
        All of them.
    listed : sequence of str
        Those that come first, as far as they are among the names.
    last : iterable of str
        Those that come after all others, as the study's consensus does: it is nobody's own.
    """
    known, behind = set(names), {*last, CONSENSUS}
    first = dict.fromkeys(name for name in listed if name in known)
    ordered = [*first, *sorted(known - first.keys(), key=lambda name: (name.casefold(), name))]
    return tuple(sorted(ordered, key=lambda name: name in behind))


def initials(names: Sequence[str]) -> Mapping[str, str]:
    """Return a short name for each annotator, all different.

    Those who share a first letter get the letters after it in which they differ: rater01 and rater02 are
    R1 and R2.
    """
    made: dict[str, str] = {}
    for number, name in enumerate(names):
        sharing = [other for other in names if other[:1].casefold() == name[:1].casefold()]
        short = name[:1].upper() + _telling_tail(name, sharing).upper()
        made[name] = f"{name[:1].upper()}{number + 1}" if short in made.values() else short
    return made


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
