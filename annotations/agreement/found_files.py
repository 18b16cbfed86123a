"""The files of a comparison: those of a study by their names, those of any other folder by their content."""

import os
from collections.abc import Iterator
from pathlib import Path

_FAMILY = b"oct-annotation/"
_LOOKED_AT_BYTES = 2**16


def files_of_study(folder: Path) -> list[str]:
    """Return the ``.json`` files in the annotators' folders of a study, in order, relative to the study's."""
    above = folder / "annotations"
    people = sorted(entry.name for entry in os.scandir(above) if entry.is_dir()) if above.is_dir() else []
    return [
        f"annotations/{person}/{name}"
        for person in people
        for name in _json_names([entry.name for entry in os.scandir(above / person)])
    ]


def files_below(folder: Path) -> list[str]:
    """Return all ``.json`` files in and below a folder, in order, relative to it and with forward slashes."""
    return list(_walked(folder))


def _walked(folder: Path) -> Iterator[str]:
    for place, folders, names in os.walk(folder):
        folders.sort()
        relative = Path(place).relative_to(folder)
        yield from ((relative / name).as_posix() for name in _json_names(names))


def _json_names(names: list[str]) -> list[str]:
    return sorted(name for name in names if name.endswith(".json"))


def begins_like_annotation(path: Path) -> bool:
    """Say whether a file may be an annotation, whatever its name: by its first field, which is the schema."""
    try:
        with path.open("rb") as file:
            return _FAMILY in file.read(_LOOKED_AT_BYTES)
    except OSError:
        # Who reads it will say what the matter is.
        return True
