"""What the program says in blind work: the volumes' neutral numbers in place of their names and paths."""

import os
import re
from collections.abc import Iterator

from annotations.documents.study import AnnotationName, annotation_name
from annotations.errors import UserError
from annotator.session.volumes.worklist import NAMELESS, WorkItem, Worklist

_SHORTEST_TELLING_WORD = 3
_BEGINNING = re.compile(r"(?<!\w)(?=\S)")
# Backups, locks and sidecars lie beside a file and are called after it.
_ENDINGS = re.compile(r"(?:\.[A-Za-z0-9_]+)*")
# A folder whose name has a space in it is taken off only if it is known.
_UNKNOWN_FOLDERS = re.compile(r"[^\s'\"“”‘’]*[/\\]\Z")
_OUTSIDE_PATHS = re.compile(r"[\n'\"“”‘’]")
_QUOTES = frozenset("'\"“”‘’")


class NeutralWords:
    """Replaces whatever a volume or its annotations are called in a text.

    A volume that is met more than once has as many numbers: in a text about the volume alone it is called by
    that of the item at hand, or else by none, so that no text ever says that two numbers are one volume.

    Parameters
    ----------
    worklist : Worklist
        Where it is not blind, every text stays as it is.
    item : WorkItem or None
        The item at hand: the one that is open, or being opened.
    """

    def __init__(self, worklist: Worklist, item: WorkItem | None) -> None:
        self._labels: dict[str, str] = {}
        self._lengths: list[int] = []
        self._folders: list[str] = []
        if not worklist.is_blind:
            return
        # The item at hand last: its words win.
        for each in (*worklist.items, *([item] if item else [])):
            for name in _names_of_annotation(each):
                self._labels[name] = each.label
            for name in _names_of_volume(worklist, each):
                is_known = self._labels.get(name, each.label) == each.label
                self._labels[name] = each.label if is_known or each == item else NAMELESS
        # Not one pattern of all the names, which takes a second to compile for some hundred volumes.
        self._lengths = sorted({len(name) for name in self._labels}, reverse=True)
        self._folders = _folders(worklist)

    def text(self, text: str) -> str:
        """Return a text in neutral words."""
        if not self._lengths:
            return text
        pieces, told = [], 0
        for beginning in _BEGINNING.finditer(text):
            found = self._named_at(text, beginning.start(), told) if beginning.start() >= told else None
            if found is not None:
                begin, end, label = found
                pieces += [text[told:begin], label]
                told = end
        return "".join((*pieces, text[told:]))

    def error(self, error: UserError) -> UserError:
        """Return an error of the same kind in neutral words, without what caused it."""
        if not self._lengths:
            return error
        neutral = type(error).__new__(type(error))
        neutral.__dict__.update(error.__dict__)
        neutral.problem = self.text(error.problem)
        neutral.where = None if error.where is None else self.text(str(error.where))
        neutral.remedy = self.text(error.remedy)
        neutral.args = (neutral.problem,)
        return neutral

    def _named_at(self, text: str, start: int, told: int) -> tuple[int, int, str] | None:
        """Return where the longest name at a place begins and ends with its folders, and its neutral one."""
        for length in self._lengths:
            name = text[start : start + length]
            if name not in self._labels:
                continue
            ending = _ENDINGS.match(text, start + length)
            end = ending.end() if ending is not None else start + length
            if text[end : end + 1].isalnum() or text[end : end + 1] == "_":
                continue
            begin = self._beginning_of_path(text, start, told)
            is_file = begin < start or end > start + length
            is_quoted = bool(_QUOTES & {text[start - 1 : start], text[end : end + 1]})
            if is_file or is_quoted or _is_telling(name):
                return begin, end, self._labels[name]
        return None

    def _beginning_of_path(self, text: str, start: int, told: int) -> int:
        if text[start - 1 : start] not in ("/", "\\"):
            return start
        before = text[told:start]
        known = max(before.rfind(f"{folder}{separator}") for folder in self._folders for separator in "/\\")
        if known >= 0 and not _OUTSIDE_PATHS.search(before, known):
            return told + known
        unknown = _UNKNOWN_FOLDERS.search(before)
        return told + unknown.start() if unknown is not None else start


def _names_of_annotation(item: WorkItem) -> Iterator[str]:
    yield item.annotation_path.name
    name = annotation_name(item.annotation_path)
    if name is not None:
        yield name.file_name.removesuffix(".json")


def _names_of_volume(worklist: Worklist, item: WorkItem) -> Iterator[str]:
    path = item.volume_path
    stem = path.name.split(".")[0] or path.name
    yield from {path.name, stem, str(path), os.path.relpath(path, worklist.folder)}
    if item.dataset is not None:
        yield item.dataset
    if item.volume_id is not None:
        yield item.volume_id
        for method in ("keypoints", "boxes"):
            if method != worklist.method:
                # As this list counts: there the same pass may have another number.
                yield AnnotationName(item.volume_id, method, item.repeat).file_name


def _folders(worklist: Worklist) -> list[str]:
    folders = {worklist.folder, worklist.folder.resolve()}
    folders |= {item.volume_path.parent for item in worklist.items}
    folders |= {item.annotation_path.parent for item in worklist.items}
    return sorted(map(str, folders))


def _is_telling(name: str) -> bool:
    """Whether it is no word of the language, which an id may be as well."""
    return len(name) >= _SHORTEST_TELLING_WORD and not name.isalpha() and not name.isdigit()
