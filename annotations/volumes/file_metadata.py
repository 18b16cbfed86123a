"""What a file's own metadata say about its voxels, under the names that programs in use give it.

Only what carries a unit, or a name with a unit, is trusted: a bare ``resolution = (1, 1, 1)`` means nothing.
"""

import logging
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from annotations.volumes.spacing import SpacingUm, validate_spacing_um
from annotations.volumes.volume import VolumeError

_log = logging.getLogger(__name__)

_STEMS = ("spacing", "voxel_size", "voxelsize", "element_size", "pixel_size", "resolution")
_SUFFIXES = {"nm": 1e-3, "um": 1.0, "mm": 1e3, "cm": 1e4, "m": 1e6}
_UNIT_NAMES = ("unit", "units")
_DEPTH_AXIS = "depth_axis"

_UM_PER_UNIT = {
    **dict.fromkeys(("å", "angstrom"), 1e-4),
    **dict.fromkeys(("nm", "nanometer", "nanometre", "nanometers", "nanometres"), 1e-3),
    **dict.fromkeys(("um", "µm", "μm", "micron", "microns"), 1.0),
    **dict.fromkeys(("micrometer", "micrometre", "micrometers", "micrometres"), 1.0),
    **dict.fromkeys(("mm", "millimeter", "millimetre", "millimeters", "millimetres"), 1e3),
    **dict.fromkeys(("cm", "centimeter", "centimetre", "centimeters", "centimetres"), 1e4),
    **dict.fromkeys(("in", "inch", "inches"), 25_400.0),
    **dict.fromkeys(("m", "meter", "metre", "meters", "metres"), 1e6),
}

SPACING_NAMES = tuple(f"{stem}_{suffix}" for stem in _STEMS for suffix in _SUFFIXES)
"""Attributes that give a spacing together with its unit: ``spacing_um``, ``element_size_um``, …"""

NAMES = (
    *SPACING_NAMES,
    *_STEMS,
    *(f"{stem}_{unit}" for stem in _STEMS for unit in _UNIT_NAMES),
    *_UNIT_NAMES,
    _DEPTH_AXIS,
)
"""Every name that this module reads."""


def um_per_unit(unit: object) -> float | None:
    """Return how many µm a unit of length has, or None where it is none that is known.

    Parameters
    ----------
    unit : object
        A name (``"micrometer"``, ``"µm"``), as text or bytes, in any case; ImageJ's escaped µ included.
    """
    text = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else str(unit)
    return _UM_PER_UNIT.get(text.strip().lower().replace("\\u00b5", "µ"))


def spacing_from_attributes(attributes: Mapping[str, Any], where: object) -> SpacingUm | None:
    """Return the spacing in µm that attributes of an array give, or None.

    ``spacing_um``, ``voxel_size_mm``, ``element_size_um`` and the like are read (see `SPACING_NAMES`), and
    ``spacing``, ``resolution`` … beside ``spacing_unit``, ``unit`` or ``units``. The three numbers stand in
    the order of the array's axes. An impossible spacing counts as none, and is logged.

    Parameters
    ----------
    attributes : mapping
    where : object
        The file, for the log.
    """
    for stem in _STEMS:
        for suffix, um in _SUFFIXES.items():
            name = f"{stem}_{suffix}"
            if name in attributes:
                return scaled_spacing(attributes[name], (um, um, um), where)
    for stem in _STEMS:
        if stem not in attributes:
            continue
        for name in (*(f"{stem}_{unit}" for unit in _UNIT_NAMES), *_UNIT_NAMES):
            if name in attributes:
                units = np.atleast_1d(np.asarray(attributes[name])).tolist()
                known = [um_per_unit(unit) for unit in (units * 3 if len(units) == 1 else units)]
                return scaled_spacing(attributes[stem], known, where)
    return None


def scaled_spacing(values: Any, um: Iterable[float | None], where: object) -> SpacingUm | None:
    """Return three lengths in µm, or None where they, or a unit, make no sense (and log it).

    Parameters
    ----------
    values : array-like
        Three lengths, in units of their own.
    um : iterable of float or None
        How many µm each of the units has; None where it is not known.
    where : object
        The file, for the log.
    """
    try:
        lengths = np.atleast_1d(np.asarray(values, dtype=np.float64)).ravel().tolist()
        factors = list(um)
        if None in factors or len(factors) != len(lengths):
            return None
        return validate_spacing_um(
            (length * factor for length, factor in zip(lengths, factors, strict=True) if factor is not None),
            where=where,
        )
    except (VolumeError, TypeError, ValueError) as error:
        _log.warning("The spacing that %s gives is ignored: %s", where, error)
        return None


def depth_axis_from_attributes(attributes: Mapping[str, Any]) -> int | None:
    """Return the attribute ``depth_axis``, or None where it is absent or is none of 0, 1, 2."""
    try:
        value = int(np.asarray(attributes[_DEPTH_AXIS]).item())
    except (KeyError, TypeError, ValueError):
        return None
    return value if 0 <= value <= 2 else None
