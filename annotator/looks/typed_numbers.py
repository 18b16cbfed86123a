"""Numbers and lengths that a person types: read with care, or refused with a sentence that says why."""

import math
import re
from typing import Literal

from annotations.geometry.frames import voxel_to_um

Unit = Literal["um", "voxel"]
SizeUnit = Literal["um", "mm"]

_UM_PER = {"µm": 1.0, "μm": 1.0, "um": 1.0, "mm": 1000.0, "cm": 10_000.0}
_VOXEL_WORDS = ("voxels", "voxel", "vx", "px")
_LENGTH = re.compile(r"(?P<number>.*?)\s*(?P<unit>µm|μm|um|mm|cm|voxels|voxel|vx|px)?", re.IGNORECASE)


class NotUnderstood(ValueError):  # noqa: N818 - named for what happened
    """Typed text that is no number; its text is meant for the person who typed it."""


def parse_number(text: str) -> float:
    """Return a finite number typed with a decimal point.

    A decimal comma is refused rather than read: ``1,234`` would be one thing in London and another in Paris.

    Raises
    ------
    NotUnderstood
        The text is empty, no number, or not finite.
    """
    cleaned = text.strip().replace("\N{MINUS SIGN}", "-")
    if not cleaned:
        raise NotUnderstood("Type a number")
    if "," in cleaned:
        raise NotUnderstood(f"“{text.strip()}”: write decimals with a point, and no thousands separators")
    if "_" in cleaned:
        raise NotUnderstood(f"“{text.strip()}” is not a number")
    try:
        number = float(cleaned)
    except ValueError:
        raise NotUnderstood(f"“{text.strip()}” is not a number") from None
    if not math.isfinite(number):
        raise NotUnderstood(f"“{text.strip()}” is not a finite number")
    return number


def parse_length_um(text: str, unit: Unit, spacing_um: float) -> float:
    """Return a length or coordinate along one axis in µm.

    Parameters
    ----------
    text : str
        A number in the table's unit, or with its own: µm, mm, cm, voxel.
    unit : {"um", "voxel"}
        What a bare number means.
    spacing_um : float
        Of the voxels along this axis.

    Raises
    ------
    NotUnderstood
        As `parse_number`.
    """
    match = _LENGTH.fullmatch(text.strip())
    written = (match["unit"] or "").lower() if match else ""
    number = parse_number(match["number"] if match else text)
    if written in _UM_PER:
        return number * _UM_PER[written]
    if written in _VOXEL_WORDS or unit == "voxel":
        return float(voxel_to_um(number, spacing_um))
    return number


def parse_size_um(text: str, unit: SizeUnit) -> float:
    """Return a size that is not along one axis of the volume in µm.

    Parameters
    ----------
    text : str
        A number in the table's unit, or with its own: µm, mm, cm.
    unit : {"um", "mm"}
        What a bare number means.

    Raises
    ------
    NotUnderstood
        As `parse_number`; the size is in voxels, or not more than zero.
    """
    match = _LENGTH.fullmatch(text.strip())
    written = (match["unit"] or "").lower() if match else ""
    if written in _VOXEL_WORDS:
        raise NotUnderstood("Voxels are not cubes: write a size in µm or mm")
    size_um = parse_number(match["number"] if match else text) * _UM_PER[written or unit]
    if size_um <= 0:
        raise NotUnderstood("A size is more than zero")
    return size_um


def split_triple(text: str) -> tuple[str, str, str] | None:
    """Return the three parts of a pasted position, such as ``[9345.8, 9865.5, 2184.0]``, or None.

    Tabs, semicolons, commas followed by a space, and spaces separate; in brackets, bare commas do too.
    """
    stripped = text.strip()
    inner = stripped.strip("[]()")
    separators = r"\s*[\t;,]\s*|\s+" if inner != stripped else r"\s*[\t;]\s*|,\s+|\s+"
    parts = re.split(separators, inner.strip())
    if len(parts) != 3 or not all(re.search(r"\d", part) for part in parts):
        return None
    return (parts[0], parts[1], parts[2])
