"""The files of a comparison: those of a study by their names, those of any other folder by their content."""

import os
from pathlib import Path

from annotations.agreement.results import LeftOut

_FAMILY = b"oct-annotation/"
_LOOKED_AT_BYTES = 2**16


Found = tuple[list[str], list[LeftOut]]
"""Files, in order, relative to what is compared and with forward slashes; and folders that cannot be read."""


def files_of_study(folder: Path) -> Found:
    """Find the ``.json`` files in the annotators' folders of a study."""
    files: list[str] = []
    unread: list[LeftOut] = []
    above = folder / "annotations"
    try:
        people = sorted(entry.name for entry in os.scandir(above) if entry.is_dir())
    except FileNotFoundError:
        people = []
    except OSError as error:
        return [], [_unread("annotations", error)]
    for person in people:
        try:
            names = [entry.name for entry in os.scandir(above / person)]
        except OSError as error:
            unread.append(_unread(f"annotations/{person}", error))
        else:
            files += (f"annotations/{person}/{name}" for name in _json_names(names))
    return files, unread


def files_below(folder: Path) -> Found:
    """Find all ``.json`` files in and below a folder."""
    files: list[str] = []
    unread: list[LeftOut] = []

    def note(error: OSError) -> None:
        unread.append(_unread(Path(error.filename).relative_to(folder).as_posix(), error))

    for place, folders, names in os.walk(folder, onerror=note):
        folders.sort()
        relative = Path(place).relative_to(folder)
        files += ((relative / name).as_posix() for name in _json_names(names))
    return files, unread


def _unread(relative: str, error: OSError) -> LeftOut:
    return LeftOut(path=plain_text(relative), reason=f"the folder could not be read ({error.strerror})")


def _json_names(names: list[str]) -> list[str]:
    return sorted(name for name in names if name.endswith(".json"))


def plain_text(text: str) -> str:
    """Return text that any file can hold: a name on Linux may have bytes that are no Unicode."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return text.encode(errors="replace").decode()
    return text


def begins_like_annotation(path: Path) -> bool:
    """Say whether a file may be an annotation, whatever its name: by its first field, which is the schema."""
    try:
        with path.open("rb") as file:
            return _FAMILY in file.read(_LOOKED_AT_BYTES)
    except OSError:
        # Who reads it will say what the matter is.
        return True
