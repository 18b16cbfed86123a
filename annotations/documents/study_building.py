"""Building studies: from a folder of volumes, and with more volumes, annotators and repeats later on.

What has been handed out stays: ids, numbers in the queues, and the files of annotations that exist.
"""

import hashlib
import os
import random
import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from annotations.documents.files import ships
from annotations.documents.record import Method, R, changed
from annotations.documents.study import (
    STUDY_FILE,
    Study,
    StudyError,
    StudyVolume,
    load_study,
    save_study,
    study_folder_of,
)
from annotations.documents.write_guard import writing_beside
from annotations.errors import first_problem
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import load_tool, write_tool
from annotations.volumes import VolumeError, volume_paths
from annotations.volumes.opening import SUFFIXES

# A person can read one of these out to another.
_SEEDS = 1_000_000
_NOT_OF_VOLUMES = frozenset({"annotations", "masks", "predictions", "tools"})
_ZARR_SUFFIXES = (".ome.zarr", ".zarr")
_NAMELESS = "volume"


class StudyChanged(StudyError):  # noqa: N818 - named for what happened
    """Somebody else has changed the study meanwhile.

    Attributes
    ----------
    present : Study
        As it is now.
    """

    def __init__(self, path: Path, present: Study) -> None:
        super().__init__(
            "somebody has changed the study since it was opened here, and nothing was written",
            where=path,
            remedy="Open the study again, and make the change in what is there now",
        )
        self.present = present


@dataclass(frozen=True)
class Enlarged:
    """A study with more volumes.

    Attributes
    ----------
    study : Study
    added : tuple of StudyVolume
        The new ones, in a batch of their own.
    already_there : int
        How many paths were passed over because the study has them.
    """

    study: Study
    added: tuple[StudyVolume, ...]
    already_there: int


def find_volumes(folder: Path) -> tuple[Path, ...]:
    """Return the volumes in a folder and in its direct sub-folders, each folder's in natural order.

    A study's own folders ``annotations``, ``masks``, ``predictions`` and ``tools`` are left out, and so are
    hidden folders and those that may not be read.

    Raises
    ------
    VolumeError
        The folder does not exist or may not be read.
    """
    found = volume_paths(folder)
    # A Zarr volume is itself a folder.
    volumes = set(found)
    for below in sorted(folder.iterdir()):
        if below in volumes or below.name.startswith(".") or below.name in _NOT_OF_VOLUMES:
            continue
        try:
            found += volume_paths(below) if below.is_dir() else []
        except (VolumeError, OSError):
            # One folder that is someone else's does not hide the volumes beside it.
            continue
    return tuple(found)


def volumes_at(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Return the volumes that are named, and those in the folders that are, as `find_volumes` does.

    VolumeError for a folder that cannot be read, StudyError where there is no volume at all.
    """
    found: list[Path] = []
    for path in paths:
        # A Zarr volume is a folder too; of what is not there, looking for volumes says so.
        is_volume = path.is_file() or (
            path.exists() and path.absolute() in volume_paths(path.absolute().parent)
        )
        found += [path] if is_volume else find_volumes(path)
    if not found:
        raise StudyError(
            "there is no volume in this folder or in the folders in it",
            where=", ".join(map(str, paths)) or None,
            remedy="Choose a folder with .npy, .npz, .h5, .tif or .zarr files",
        )
    return tuple(found)


def drawn_seed() -> int:
    """Return a seed for a new study: every study shuffles in its own way, and says in its file which."""
    return random.SystemRandom().randrange(_SEEDS)


def study_of_volumes(
    paths: Sequence[Path], tool: str, study_folder: Path, *, title: str = "", **rules: Any
) -> Study:
    """Propose a study of volumes; nothing is written.

    Where a file holds several arrays, no ``dataset`` is named: the application asks when it is opened.

    Parameters
    ----------
    paths : sequence of Path
        The volumes.
    tool : str
        Name of the tool specification.
    study_folder : Path
        Where ``study.toml`` is to be.
    title : str
        The study folder's name by default.
    **rules
        Other fields of `Study`: methods, annotators, assignments, blind, order, seed, viewing.

    Raises
    ------
    StudyError
        A volume cannot be named relative to the study's folder, or the rules contradict each other.
    """
    plain = _made(Study, title=title or _plain_text(study_folder.absolute().name) or "Study", tool=tool)
    return with_rules(with_volumes(plain, study_folder, paths).study, **rules)


def with_volumes(study: Study, study_folder: Path, paths: Iterable[Path]) -> Enlarged:
    """Return the study with more volumes, after those that it has; StudyError for one that cannot be named.

    They are a batch of their own, so that nobody's numbers change. Paths of volumes that the study has, or
    that are given twice, are passed over.
    """
    known = {(study_folder / volume.path).resolve() for volume in study.volumes}
    given = [Path(path) for path in paths]
    fresh = []
    for path in given:
        if path.resolve() not in known:
            known.add(path.resolve())
            fresh.append(path)
    batch = max((volume.batch for volume in study.volumes), default=-1) + 1
    added = tuple(
        _made(StudyVolume, path, id=volume_id, path=_path_in_study(path, study_folder), batch=batch)
        for path, volume_id in zip(fresh, _ids(fresh, [volume.id for volume in study.volumes]), strict=True)
    )
    enlarged = with_rules(study, volumes=(*study.volumes, *added)) if added else study
    return Enlarged(enlarged, added, len(given) - len(fresh))


def with_annotators(
    study: Study, names: Sequence[str], methods: Mapping[str, tuple[Method, ...]] | None = None
) -> Study:
    """Return the study with more annotators; StudyError for a name that is taken or can be no folder's.

    ``methods`` says by which of the study's methods some of them work; the others work by all of them.
    """
    return with_rules(
        study,
        annotators=(*study.annotators, *names),
        assignments={**study.assignments, **(methods or {})},
    )


def with_repeats(study: Study, count: int, *, seed: int | None = None) -> Study:
    """Return the study in which so many volumes of the newest batch, drawn by a seed, come twice.

    Those of earlier batches stay as they are, for their numbers have been handed out.

    Parameters
    ----------
    count : int
        How many; StudyError where it is negative, or the batch has fewer.
    seed : int, optional
        The study's by default. The same seed draws the same volumes, in whichever order they are listed.
    """
    newest = max((volume.batch for volume in study.volumes), default=0)
    candidates = [volume.id for volume in study.volumes if volume.batch == newest]
    if not 0 <= count <= len(candidates):
        raise StudyError(
            f"{count} volumes cannot be repeated: there are {len(candidates)}",
            remedy=f"Choose a number from 0 to {len(candidates)}",
        )
    drawn_by = study.seed if seed is None else seed
    drawn = sorted(candidates, key=lambda volume_id: _drawn(drawn_by, volume_id))[:count]
    return with_rules(
        study,
        volumes=tuple(
            changed(volume, repeats=int(volume.id in drawn)) if volume.batch == newest else volume
            for volume in study.volumes
        ),
    )


def with_rules(study: Study, **fields: Any) -> Study:
    """Return the study with some fields changed; StudyError, in words, for what cannot be."""
    return _said(lambda: changed(study, **fields))


def why_not_in(folder: Path) -> str:
    """Return why no new study can be kept in a folder, as a sentence without its full stop; else nothing.

    A folder that is not there yet is made when the study is, in the nearest one above it.
    """
    path = folder / STUDY_FILE
    if path.exists():
        return "There is a study in this folder already: choose another one"
    around = study_folder_of(path)
    if around is not None:
        return f"This folder lies inside the study {_called(around)}: choose another one"
    nearest = next((each for each in (folder, *folder.absolute().parents) if each.exists()), folder)
    if not nearest.is_dir():
        return f"{nearest} is not a folder: choose another one"
    if not os.access(nearest, os.W_OK | os.X_OK):
        return f"You may not write in {nearest}: choose another folder to keep the study in"
    return ""


def create_study(study: Study, folder: Path, tool: ToolSpecification) -> None:
    """Write a new study; a tool that does not ship is copied to the study's folder ``tools``.

    ``study.toml`` comes last, so that a folder with one is complete.

    Raises
    ------
    StudyError
        There is a study already, or around the folder, or another tool of that name in its folder ``tools``.
    SaveError
        It cannot be written.
    """
    path = folder / STUDY_FILE
    around = study_folder_of(path)
    if around not in (None, folder.absolute()):
        raise StudyError(
            f"it would lie inside the study {_called(around)}",
            where=folder,
            remedy="Choose a folder of its own, or add the volumes to that study",
        )
    with writing_beside(path):
        if path.exists():
            raise StudyError(
                "there is a study already, and it is not overwritten",
                where=path,
                remedy="Open it and change its settings, or choose another folder",
            )
        own = folder / "tools" / f"{tool.name}.toml"
        if not ships(tool) and not (own.exists() and load_tool(own).fingerprint == tool.fingerprint):
            write_tool(tool, own)
        save_study(study, folder)


def replace_study(study: Study, folder: Path, *, expected: Study) -> None:
    """Write a changed study, unless somebody else has changed it since it was read.

    Raises
    ------
    StudyChanged
        ``study.toml`` does not say what ``expected`` does any more.
    StudyError
        It cannot be read.
    SaveError
        It cannot be written.
    """
    path = folder / STUDY_FILE
    # Before its guard is laid there: in a folder that was moved away nothing is made anew.
    load_study(folder)
    with writing_beside(path):
        present = load_study(folder)
        if present != expected:
            raise StudyChanged(path, present)
        save_study(study, folder)


def _called(study_folder: Path) -> str:
    """Return a study's title in quotation marks; its folder's name where it cannot be read."""
    try:
        return f"“{load_study(study_folder).title}”"
    except StudyError:
        return f"in {study_folder.name}"


def _path_in_study(path: Path, study_folder: Path) -> str:
    path, study_folder = path.absolute(), study_folder.absolute()
    if path.is_relative_to(study_folder) and ".." not in path.parts:
        return path.relative_to(study_folder).as_posix()
    try:
        # A way up from a folder that is a link leads up from where it points to.
        return Path(os.path.relpath(path.resolve(), study_folder.resolve())).as_posix()
    except ValueError:
        raise StudyError(
            f"it lies on another drive than the study's folder {study_folder}",
            where=path,
            remedy="Keep the study on the drive of its volumes: its paths are relative, so that it can move",
        ) from None


def _ids(paths: Sequence[Path], taken: Iterable[str]) -> list[str]:
    """Return an id for each file, after its name; where names are equal, after its folder's as well."""
    plain = [_plain_id(_stem(path)) for path in paths]
    often = Counter(each.casefold() for each in plain)
    used = {each.casefold() for each in taken}
    ids = []
    for path, stem in zip(paths, plain, strict=True):
        is_taken = often[stem.casefold()] > 1 or stem.casefold() in used
        first = f"{_plain_id(path.absolute().parent.name)}-{stem}" if is_taken else stem
        wanted, number = first, 2
        while wanted.casefold() in used:
            wanted, number = f"{first}-{number}", number + 1
        used.add(wanted.casefold())
        ids.append(wanted)
    return ids


def _stem(path: Path) -> str:
    lowered = path.name.casefold()
    suffix = next((each for each in (*_ZARR_SUFFIXES, *SUFFIXES) if lowered.endswith(each)), "")
    return path.name[: len(path.name) - len(suffix)]


def _plain_id(text: str) -> str:
    """Return the nearest thing to a text that can be an id: letters and digits without their accents."""
    # Unicode takes accents off their letters, but has no simpler form of this one.
    ascii_text = unicodedata.normalize("NFKD", text.replace("ß", "ss")).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", ascii_text).strip("-_.") or _NAMELESS


def _plain_text(name: str) -> str:
    # A folder's name that is not Unicode (Linux has such) cannot stand in a TOML file.
    return os.fsencode(name).decode("utf-8", "replace")


def _drawn(seed: int, volume_id: str) -> bytes:
    return hashlib.sha256(f"{seed}\nrepeats\n{volume_id}".encode()).digest()


def _made(kind: type[R], where: object = None, /, **fields: Any) -> R:
    return _said(lambda: kind(**fields), where)


def _said(make: Callable[[], R], where: object = None) -> R:
    """Return what is made; StudyError says what its model refused."""
    try:
        return make()
    except ValidationError as error:
        raise StudyError(first_problem(error), where=where) from error
