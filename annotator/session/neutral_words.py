"""What the program says in blind work: the volumes' neutral numbers in place of their names and paths."""

import os
import re
from collections.abc import Iterator

from annotations.documents.study import AnnotationName, annotation_name
from annotations.errors import UserError
from annotator.session.worklist import WorkItem, Worklist

_SHORTEST_TELLING_WORD = 3
# Backups, locks and sidecars lie beside a file and are called after it.
_ENDINGS = r"(?:\.[A-Za-z0-9_]+)*"
_QUOTES = "'\"“”‘’"


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
        self._pattern: re.Pattern[str] | None = None
        if not worklist.is_blind:
            return
        # The item at hand last: its words win.
        for each in (*worklist.items, *([item] if item else [])):
            for name in _names_of_annotation(each):
                self._labels[name] = each.label
            for name in _names_of_volume(worklist, each):
                is_known = self._labels.get(name, each.label) == each.label
                self._labels[name] = each.label if is_known or each == item else "A volume of this study"
        longest_first = sorted(self._labels, key=len, reverse=True)
        if longest_first:
            folders = "|".join(re.escape(folder) for folder in _folders(worklist))
            before = rf"(?:(?:{folders})[/\\](?:[^\n'\"“”:]*?[/\\])??|[^\s'\"“”]*[/\\])?"
            names = "|".join(map(re.escape, longest_first))
            self._pattern = re.compile(rf"(?<!\w)({before})({names})({_ENDINGS})(?!\w)")

    def text(self, text: str) -> str:
        """Return a text in neutral words."""
        return self._pattern.sub(self._neutral, text) if self._pattern is not None else text

    def error(self, error: UserError) -> UserError:
        """Return an error of the same kind in neutral words, without what caused it."""
        if self._pattern is None:
            return error
        neutral = type(error).__new__(type(error))
        neutral.__dict__.update(error.__dict__)
        neutral.problem = self.text(error.problem)
        neutral.where = None if error.where is None else self.text(str(error.where))
        neutral.remedy = self.text(error.remedy)
        neutral.args = (neutral.problem,)
        return neutral

    def _neutral(self, match: re.Match[str]) -> str:
        folder, name, endings = match.groups()
        around = match.string[max(match.start() - 1, 0) : match.start()] + match.string[match.end() :][:1]
        if folder or endings or set(around) & set(_QUOTES) or _is_telling(name):
            return self._labels[name]
        return match[0]


def _names_of_annotation(item: WorkItem) -> Iterator[str]:
    yield item.annotation_path.name
    name = annotation_name(item.annotation_path)
    if name is not None:
        # Not by the other method: there this pass may have another number, and is none of this list's.
        yield name.file_name.removesuffix(".json")


def _names_of_volume(worklist: Worklist, item: WorkItem) -> Iterator[str]:
    path = item.volume_path
    yield from {path.name, path.name.split(".")[0], str(path), os.path.relpath(path, worklist.folder)}
    if item.dataset is not None:
        yield item.dataset
    if item.volume_id is not None:
        yield item.volume_id
        for method in ("keypoints", "boxes"):
            if method != worklist.method:
                yield AnnotationName(item.volume_id, method, item.repeat).file_name


def _folders(worklist: Worklist) -> list[str]:
    folders = {worklist.folder, worklist.folder.resolve()}
    folders |= {item.volume_path.parent for item in worklist.items}
    folders |= {item.annotation_path.parent for item in worklist.items}
    return sorted(map(str, folders), key=len, reverse=True)


def _is_telling(name: str) -> bool:
    """Whether it is no word of the language, which an id may be as well."""
    return len(name) >= _SHORTEST_TELLING_WORD and not name.isalpha() and not name.isdigit()
