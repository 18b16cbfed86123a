"""Intensities as volumes are drawn from: whole numbers of 16 bits at most."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from annotations.volumes.volume import Array


@dataclass(frozen=True, eq=False)
class StoredIntensities:
    """Intensities that were shifted, then scaled.

    Attributes
    ----------
    values : numpy.ndarray of uint8 or uint16
        In the shape, and in the order in memory, of the intensities.
    lowest : float
        Intensity that is kept as 0.
    per_unit : float
        What one unit of intensity becomes.
    """

    values: NDArray[np.unsignedinteger]
    lowest: float
    per_unit: float

    def of(self, intensity: float) -> float:
        """Return what is kept of an intensity."""
        return float(np.clip((intensity - self.lowest) * self.per_unit, -1e9, 1e9))


def stored_intensities(data: Array) -> StoredIntensities:
    """Return values that both of VTK's mappers take, and how they come about.

    Unsigned integers of 8 and 16 bits stay as they are, and are not copied. All else is scaled to 16 bits:
    the mappers' tables are no finer, and an intensity that is not finite would make them read beyond their
    ends. NaN is kept as the lowest intensity.
    """
    if data.dtype in (np.uint8, np.uint16):
        return StoredIntensities(data, 0.0, 1.0)
    finite = data[np.isfinite(data)]
    if finite.size == 0:
        return StoredIntensities(np.zeros_like(data, np.uint16), 0.0, 1.0)
    lowest, highest = float(finite.min()), float(finite.max())
    # Halved, because the difference of two numbers of this type may be too large for it.
    half_range = highest / 2 - lowest / 2
    per_unit = 32767.5 / half_range if half_range > 0 else 1.0
    stored = np.empty_like(data, np.uint16)
    # Plane by plane: the whole volume in double precision would take eight times its own memory.
    for plane, kept in zip(np.moveaxis(data, -1, 0), np.moveaxis(stored, -1, 0), strict=True):
        limited = np.nan_to_num(plane.astype(np.float64), nan=lowest, posinf=highest, neginf=lowest)
        kept[:] = np.rint((limited - lowest) * per_unit)
    return StoredIntensities(stored, lowest, per_unit)
