"""Slicer's ``.fcsv`` files: a list of labelled points in the patient's frame, one a line."""

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from annotations.errors import UserError

PatientVector = tuple[float, float, float]
"""Three numbers in mm along the patient's right, anterior and superior directions (RAS)."""

_TO_RAS: Mapping[str, PatientVector] = {
    "0": (1.0, 1.0, 1.0),
    "RAS": (1.0, 1.0, 1.0),
    "1": (-1.0, -1.0, 1.0),
    "LPS": (-1.0, -1.0, 1.0),
}
"""The signs that turn a position into RAS, by what a file's header says of its frame."""

_NEEDED = ("x", "y", "z", "label")
_DEFINED = "2"
"""Slicer 5 writes a point's status after the columns that the header names: 2 where it has a position."""

_LARGEST_FILE = 64 * 2**20
_EXPORT_AGAIN = "Save the point list in Slicer again"


class FcsvError(UserError):
    """A file that cannot be read as one of Slicer's ``.fcsv``."""


@dataclass(frozen=True)
class Fiducial:
    """One point of a list.

    Attributes
    ----------
    label, description : str
        As in the file; people type them.
    position_ras_mm : (float, float, float) or None
        In mm, in the patient's frame RAS, whichever frame the file is in; None for a point that is listed but
        was not placed.
    """

    label: str
    description: str
    position_ras_mm: PatientVector | None


def read_fcsv(path: Path) -> tuple[Fiducial, ...]:
    """Read the points of a ``.fcsv`` file, in its order.

    The header's ``columns`` say where the numbers and the label stand, and its ``CoordinateSystem`` in which
    frame they are: ``0`` or ``RAS``, ``1`` or ``LPS``.

    Raises
    ------
    FcsvError
        The file cannot be read, is in neither frame, or has a broken line; with the line.
    """
    lines = _lines(path)
    header = _header(lines)
    signs = _TO_RAS.get(header.get("CoordinateSystem", "").upper())
    if signs is None:
        raise FcsvError(
            f"its header says CoordinateSystem = {header['CoordinateSystem']}, which is neither RAS nor LPS"
            if "CoordinateSystem" in header
            else "its header does not say in which frame the positions are (CoordinateSystem)",
            where=path,
            remedy=_EXPORT_AGAIN,
        )
    columns = [name.strip() for name in header.get("columns", "").split(",")]
    absent = [name for name in _NEEDED if name not in columns]
    if absent:
        raise FcsvError(f"its header names no column {', '.join(absent)}", where=path, remedy=_EXPORT_AGAIN)
    return tuple(
        _fiducial(line, columns, signs, f"{path}, line {number}")
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.startswith("#")
    )


def _lines(path: Path) -> list[str]:
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise FcsvError("it is too large for a list of points", where=path, remedy="Choose an .fcsv file")
        # Universal newlines, and no others: a description may hold any character that some call a line's end.
        with path.open(encoding="utf-8-sig") as stream:
            return [line.rstrip("\n") for line in stream]
    except (OSError, UnicodeDecodeError) as error:
        raise FcsvError(
            f"it could not be read ({error})", where=path, remedy="Choose an .fcsv file of Slicer"
        ) from error


def _header(lines: Sequence[str]) -> dict[str, str]:
    said: dict[str, str] = {}
    for line in lines:
        match = re.fullmatch(r"#\s*(?P<name>[^=]+?)\s*=\s*(?P<value>.*?)\s*", line)
        if match is not None:
            said.setdefault(match["name"], match["value"])
    return said


def _fiducial(line: str, columns: Sequence[str], signs: PatientVector, where: str) -> Fiducial:
    try:
        [fields] = csv.reader([line], strict=True)
    except csv.Error as error:
        raise FcsvError(
            f"it is not comma-separated text ({error})", where=where, remedy=_EXPORT_AGAIN
        ) from None
    if len(fields) < len(columns):
        raise FcsvError(
            f"it has {len(fields)} fields, and the header names {len(columns)} columns",
            where=where,
            remedy=_EXPORT_AGAIN,
        )
    named = dict(zip(columns, fields, strict=False))
    further = fields[len(columns) :]
    is_placed = not further or further[0].strip() in ("", _DEFINED)
    position = tuple(_numbers(named, where)) if is_placed else None
    return Fiducial(
        label=named["label"],
        description=named.get("desc", ""),
        position_ras_mm=None
        if position is None
        else (position[0] * signs[0], position[1] * signs[1], position[2] * signs[2]),
    )


def _numbers(named: Mapping[str, str], where: str) -> Iterator[float]:
    for name in ("x", "y", "z"):
        try:
            number = float(named[name])
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise FcsvError(
                f"{name} is {named[name]!r}, which is no finite number", where=where, remedy=_EXPORT_AGAIN
            )
        yield number
