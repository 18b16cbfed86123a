"""Which volumes are kept from a person's view, together with what is predicted of them."""

import contextlib
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from annotations.documents.permission import permission
from annotations.documents.study import STUDY_FILE, Study, load_study, study_folder_of
from annotations.errors import UserError
from annotations.volumes import volume_paths
from annotator.session.volumes.worklist import Worklist

_BY_NUMBER = (
    "In this study predictions by volumes' names are kept from you, who know them by their numbers: "
    "choose other volumes"
)
_NEVER = "In this study predictions are kept from all who annotate: choose other volumes"
_NOT_YET = "In this study predictions are kept from you until your own work is done: choose other volumes"
_UNREADABLE = "They lie in a study that cannot be read, so that nobody knows whether you may see them"

_NAMELESS = "The study “{}” does not name {}: open it first, and say who you are"

_FileId = tuple[int, int]


def kept_from_view(study: Study, person: str) -> str:
    """Say why volumes of a study are kept from a person's view, without a full stop."""
    if study.is_blind_for(person):
        return _BY_NUMBER
    return _NOT_YET if study.ever_shows_others_to(person) else _NEVER


class KeptVolumes:
    """Asks the rules of every study that a file belongs to, however the file is reached.

    They are the study that is open, and those in whose folders the file lies by its name, or, where it is a
    link, in truth. Rules are asked once: make another one when something may have changed.

    Parameters
    ----------
    worklist : Worklist
        What is open.
    person : str
    is_settled : callable
        See `read_path`: whoever would be asked who they are is kept from the study's volumes until then.
    """

    def __init__(self, worklist: Worklist, person: str, is_settled: Callable[[Path, str], bool]) -> None:
        self._person = person
        self._is_settled = is_settled
        self._studies: dict[Path, Study | None] = {}
        self._open: Path | None = None
        if worklist.study is not None:
            self._open = worklist.folder.resolve()
            self._studies[self._open] = worklist.study
        self._around: dict[Path, Path | None] = {}
        self._ids: dict[Path, Mapping[_FileId, list[str]]] = {}
        self._is_seen: dict[tuple[Path, str], bool] = {}

    def refusal(self, path: Path) -> str:
        """Return why a volume, or a folder of volumes, is kept from view, without a full stop; else empty."""
        # Not `Path.resolve`, which refuses links that lead in a circle.
        real = Path(os.path.realpath(path))
        for folder in dict.fromkeys(self._folders(path, real)):
            ids = self._ids_in(folder).get(_file_id(path) or (0, 0), [])
            is_inside = folder == real or folder in real.parents
            if (ids or is_inside) and (reason := self._refusal_by(folder, ids)):
                return reason
        return ""

    def refusal_of_all(self, folder: Path) -> str:
        """Return why a folder, or any of the volumes in there, is kept from view; likewise."""
        volumes: list[Path] = []
        with contextlib.suppress(UserError):
            # Whoever reads it will say that it is not there.
            volumes = volume_paths(folder)
        return next((reason for path in (folder, *volumes) if (reason := self.refusal(path))), "")

    def _folders(self, path: Path, real: Path) -> Iterator[Path]:
        if self._open is not None:
            yield self._open
        for each in (path.absolute(), real):
            # Volumes of one folder are asked about one after the other.
            beside = each if each.is_dir() else each.parent
            if beside not in self._around:
                folder = study_folder_of(beside / STUDY_FILE)
                self._around[beside] = None if folder is None else folder.resolve()
            if (around := self._around[beside]) is not None:
                yield around

    def _refusal_by(self, folder: Path, ids: list[str]) -> str:
        study = self._study(folder)
        if study is None:
            return _UNREADABLE
        is_named = not study.annotators or study.names(self._person)
        if not is_named and not self._is_settled(folder, self._person):
            return _NAMELESS.format(study.title, self._person)
        is_seen = not study.is_blind_for(self._person) and all(
            self._may_see(study, folder, each) for each in ids
        )
        return "" if is_seen else kept_from_view(study, self._person)

    def _study(self, folder: Path) -> Study | None:
        if folder not in self._studies:
            self._studies[folder] = None
            with contextlib.suppress(UserError):
                self._studies[folder] = load_study(folder)
        return self._studies[folder]

    def _may_see(self, study: Study, folder: Path, volume_id: str) -> bool:
        # Where volumes come again, all have the same answer, for which all of the person's files are read.
        asked = (folder, "" if study.has_repeats else volume_id)
        if asked not in self._is_seen:
            self._is_seen[asked] = permission(study, folder, self._person, volume_id).may_see
        return self._is_seen[asked]

    def _ids_in(self, folder: Path) -> Mapping[_FileId, list[str]]:
        """Return the ids of a study's volumes by what their files are, whatever they are called."""
        if folder not in self._ids:
            ids: dict[_FileId, list[str]] = {}
            study = self._study(folder)
            for volume in study.volumes if study is not None else ():
                if (file_id := _file_id(folder / volume.path)) is not None:
                    ids.setdefault(file_id, []).append(volume.id)
            self._ids[folder] = ids
        return self._ids[folder]


def _file_id(path: Path) -> _FileId | None:
    """Return what two paths of one file, links included, have in common; None where there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
