"""How far apart voxels are, in µm: the scanner's usual figures, and a person's answers beside the volumes."""

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from annotations.durable_files import replace_durably
from annotations.volumes.volume import VolumeError, unreadable

SpacingUm = tuple[float, float, float]

OMES_SPACING_UM: SpacingUm = (15.9, 13.5, 9.4)
"""The full volume of the OMES 4D MHz-OCT scanner."""

OMES_REALTIME_SPACING_UM: SpacingUm = (622.0, 13.5, 9.4)
"""Its real-time volume: 28 planes, taken to cover the same workspace."""

OMES_DEPTH_AXIS = 2
"""Along which its light travels."""

_REALTIME_PLANES = 28
_SCHEMA = "oct-volume/1"
_FIELDS = ("schema", "spacing_um", "depth_axis")
_FOLDER_SCHEMA = "oct-volumes/1"
_MEND = "Mend it, or delete it to be asked again"


@dataclass(frozen=True)
class Sidecar:
    """What a person said about a volume that its file leaves out.

    Attributes
    ----------
    spacing_um : tuple of float or None
        Along array axes 0, 1, 2.
    depth_axis : int or None
    """

    spacing_um: SpacingUm | None = None
    depth_axis: int | None = None


def offered_spacing_um(shape: Sequence[int]) -> SpacingUm:
    """Return the spacing to offer, never to assume, for a volume of unknown spacing.

    Parameters
    ----------
    shape : sequence of int
        28 planes along axis 0 are taken for a real-time volume.
    """
    return OMES_REALTIME_SPACING_UM if shape[0] == _REALTIME_PLANES else OMES_SPACING_UM


def validate_spacing_um(values: Iterable[object], *, where: object = None) -> SpacingUm:
    """Return a spacing as three positive, finite floats.

    Parameters
    ----------
    values : iterable
        Three numbers, µm, along array axes 0, 1, 2.
    where : object, optional
        The file or field they come from, for the error.

    Raises
    ------
    VolumeError
        They are not three, or one is no number, not finite, zero or negative.
    """
    remedy = "Give three positive numbers in µm, along axes 0, 1, 2"
    given = list(values) if not isinstance(values, str) else [values]
    if len(given) != 3:
        raise VolumeError(f"a spacing has three numbers, not {len(given)}", where=where, remedy=remedy)
    numbers = []
    for axis, value in enumerate(given):
        try:
            if isinstance(value, (bool, str, bytes)):
                raise TypeError
            number = float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            raise VolumeError(
                f"the spacing along axis {axis} is no number: {value!r}", where=where, remedy=remedy
            ) from None
        if not (math.isfinite(number) and number > 0):
            raise VolumeError(
                f"the spacing along axis {axis} is {number:g} µm, which no voxel can have",
                where=where,
                remedy=remedy,
            )
        numbers.append(number)
    return (numbers[0], numbers[1], numbers[2])


def sidecar_path(volume_path: Path) -> Path:
    """Return where a volume's sidecar lies: ``v001.npy.volume.toml`` beside ``v001.npy``."""
    return volume_path.with_name(f"{volume_path.name}.volume.toml")


def write_sidecar(volume_path: Path, spacing_um: Iterable[float], depth_axis: int) -> Path:
    """Write a person's answer beside the volume, durably, and return where it lies.

    Parameters
    ----------
    volume_path : pathlib.Path
    spacing_um : iterable of float
        Along array axes 0, 1, 2.
    depth_axis : int
        0, 1 or 2.

    Raises
    ------
    VolumeError
        The spacing or the axis is impossible.
    annotations.durable_files.SaveError
        The folder cannot be written to.
    """
    path = sidecar_path(volume_path)
    content = {
        "schema": _SCHEMA,
        "spacing_um": list(validate_spacing_um(spacing_um)),
        "depth_axis": _validate_depth_axis(depth_axis, None),
    }
    replace_durably(path, tomli_w.dumps(content).encode())
    return path


def read_sidecar(volume_path: Path) -> Sidecar | None:
    """Return what a person said about a volume, or None where nobody did.

    A sidecar written by hand may leave out its schema, and one of the spacing and the depth axis.

    Raises
    ------
    VolumeError
        The sidecar cannot be read, has an unknown field, or an impossible value.
    """
    path = sidecar_path(volume_path)
    content = _read_toml(path, _SCHEMA)
    return None if content is None else _described(content, _FIELDS, path)


def folder_answers_path(folder: Path) -> Path:
    """Return where a person's answers for all volumes of a folder lie."""
    return folder / "volumes.toml"


def write_folder_answer(
    folder: Path, shape: Sequence[int], spacing_um: Iterable[float], depth_axis: int
) -> Path:
    """Keep a person's answer for all volumes of one shape in a folder, durably, and return where it lies.

    It holds for those whose own file and sidecar do not say; answers for other shapes are kept.

    Raises
    ------
    VolumeError
        The spacing or the axis is impossible, or the file that is there cannot be understood.
    annotations.durable_files.SaveError
        The folder cannot be written to.
    """
    path = folder_answers_path(folder)
    answer = {
        "shape": [int(size) for size in shape],
        "spacing_um": list(validate_spacing_um(spacing_um)),
        "depth_axis": _validate_depth_axis(depth_axis, None),
    }
    others = [entry for entry in _folder_answers(path) if entry.get("shape") != answer["shape"]]
    content = {"schema": _FOLDER_SCHEMA, "volumes": [*others, answer]}
    replace_durably(path, tomli_w.dumps(content).encode())
    return path


def read_folder_answer(folder: Path, shape: Sequence[int]) -> Sidecar | None:
    """Return what a person said about all volumes of a shape in a folder, or None where nobody did.

    Raises
    ------
    VolumeError
        The file cannot be read, has an unknown field, or an impossible value.
    """
    path = folder_answers_path(folder)
    for entry in _folder_answers(path):
        if entry.get("shape") == list(shape):
            return _described(entry, ("shape", "spacing_um", "depth_axis"), path)
    return None


def _folder_answers(path: Path) -> list[dict[str, Any]]:
    entries = (_read_toml(path, _FOLDER_SCHEMA) or {}).get("volumes", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise VolumeError("“volumes” is no list of tables", where=path, remedy=_MEND)
    return entries


def _read_toml(path: Path, known_schema: str) -> dict[str, Any] | None:
    try:
        content: dict[str, Any] = tomllib.loads(path.read_bytes().decode())
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise unreadable(path, error) from error
    except ValueError as error:
        raise VolumeError(f"it is no TOML ({error})", where=path, remedy=_MEND) from error
    schema = content.get("schema", known_schema)
    if schema != known_schema:
        raise VolumeError(
            f"its schema is {schema!r}, and this program knows {known_schema!r}",
            where=path,
            remedy="Use a newer version of the program",
        )
    return content


def _described(content: Mapping[str, Any], fields: Sequence[str], where: Path) -> Sidecar:
    unknown = [name for name in content if name not in fields]
    if unknown:
        raise VolumeError(
            f"unknown field “{unknown[0]}”; the fields are {', '.join(fields)}", where=where, remedy=_MEND
        )
    spacing = content.get("spacing_um")
    if spacing is not None and not isinstance(spacing, list):
        raise VolumeError(f"spacing_um is no list: {spacing!r}", where=where, remedy=_MEND)
    depth_axis = content.get("depth_axis")
    return Sidecar(
        spacing_um=None if spacing is None else validate_spacing_um(spacing, where=where),
        depth_axis=None if depth_axis is None else _validate_depth_axis(depth_axis, where),
    )


def _validate_depth_axis(value: object, where: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= 2:
        raise VolumeError(f"the depth axis is {value!r}", where=where, remedy="Give 0, 1 or 2")
    return value
