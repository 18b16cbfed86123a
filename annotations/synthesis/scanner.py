"""How an OCT scanner sees a surface: from the depth that the light reaches to grey values."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.body import Surface
from annotations.synthesis.grey_noise import GREATEST_GREY, GreyNoise
from annotations.synthesis.grid import Grid

_STEPS_PER_GREY = 64
"""Grey values are added up as integers of this fineness, because that is several times faster."""
_LEAST_FACING = 0.05
"""The steepest surface, as a cosine, whose smear over depth is still told apart."""


@dataclass(frozen=True, eq=False)
class Depths:
    """Depths in µm, and the share of the light's power that comes back from there, shapes alike, float32."""

    z_um: NDArray[np.float32]
    through: NDArray[np.float32]

    def __getitem__(self, index: NDArray[np.intp]) -> "Depths":
        return Depths(self.z_um[index], self.through[index])


@dataclass(frozen=True)
class Scanner:
    """A simple model of image formation along the depth axis, in powers relative to the noise floor.

    Power at depth z under a surface at depth h, with the attenuation T(z) that ends at `signal_end_um`:

        above:  1 + M T(z)
        around: 1 + S R(facing) T(z) σ₀/σ exp(−(z − h)² / 2σ²)
        below:  1 + S R(facing) T(z) b exp(−(z − h) / ℓ)

    The light's beam has a width, so that it meets a steep surface at many depths: σ² = σ₀² + (w tan θ)² below
    the surface. Above it σ = σ₀, for the smear would rise above the upper edge of a steep face.
    M is the medium's faint scattering, which the shadow below a surface lacks. The detected power is this
    mean times speckle, then compressed by the logarithm; Gaussian noise is added to the grey value.

    Attributes
    ----------
    signal_end_um, signal_edge_um : float
        Depth at which the signal ends, and the width of that end.
    attenuation_db_per_mm : float
        Loss with depth.
    surface_db : float
        Power of a surface at depth zero that faces the scanner.
    grazing_share : float
        Share of it that a surface seen from the side still returns.
    body_db, body_decay_um : float
        Power just below the surface against that of the surface, and the depth in which it falls to 1/e.
    medium_db : float
        Power of the medium at depth zero.
    axial_sigma_um, beam_sigma_um : float
        Standard deviations σ₀ and w of the point spread along and across the light; half a voxel at least.
    looks : float
        Independent speckle patterns that are averaged.
    noise_grey, grey_per_db : float
        Grey value of the noise floor, and grey values a decibel.
    noise_sigma_grey : float
        Standard deviation of the Gaussian noise.
    """

    signal_end_um: float = 6000.0
    signal_edge_um: float = 60.0
    attenuation_db_per_mm: float = 3.5
    surface_db: float = 46.0
    grazing_share: float = 0.03
    body_db: float = -7.0
    body_decay_um: float = 220.0
    medium_db: float = 3.0
    axial_sigma_um: float = 9.0
    beam_sigma_um: float = 15.0
    looks: float = 2.0
    noise_grey: float = 24.0
    grey_per_db: float = 4.6
    noise_sigma_grey: float = 0.0

    @property
    def noise(self) -> GreyNoise:
        """What is random in a grey value."""
        return GreyNoise(self.looks, self.grey_per_db, self.noise_sigma_grey)

    @property
    def reach_um(self) -> float:
        """How far below a surface the body returns less than a hundredth of the noise floor's power."""
        nepers = math.log(10) * (self.surface_db + self.body_db + 20) / 10
        return max(nepers * self.body_decay_um, 4 * self.beam_sigma_um / _LEAST_FACING)

    def depths(self, z_um: NDArray[np.float64]) -> "Depths":
        """Return depths in µm, shape (nz,), with what is left of the light there."""
        end = 1 / (1 + np.exp(np.clip((z_um - self.signal_end_um) / self.signal_edge_um, -50, 50)))
        through = end * _power(-self.attenuation_db_per_mm * z_um / 1000)
        return Depths(z_um.astype(np.float32), np.asarray(through, dtype=np.float32))

    def mean_power(self, surface: Surface, grid: Grid, depths: "Depths | None" = None) -> NDArray[np.float32]:
        """Return the mean power over that of the noise floor, before noise.

        Parameters
        ----------
        surface : Surface
            Of shape (n,): what the light meets in each of n columns.
        grid : Grid
            How finely the scanner sees.
        depths : Depths, optional
            Of shape (nz,), or (n, nz) for columns of which each has depths of its own; those of the grid by
            default.

        Returns
        -------
        ndarray of float32, shape (n, nz)
        """
        depths = depths or self.depths(grid.axis_um(2))
        z_um, through = depths.z_um, depths.through
        medium = _power(self.medium_db) * through
        power = np.empty((len(surface.depth_um), z_um.shape[-1]), dtype=np.float32)
        power[:] = 1 + medium
        struck = np.flatnonzero(np.isfinite(surface.depth_um))
        if z_um.ndim > 1:
            z_um, through = z_um[struck], through[struck]
        below = z_um - surface.depth_um[struck, None].astype(np.float32)
        facing = surface.facing[struck, None].astype(np.float32)
        axial = np.float32(max(self.axial_sigma_um, grid.spacing_um[2] / 2))
        across = np.float32(max(self.beam_sigma_um, min(grid.spacing_um[:2]) / 2))
        slope = np.sqrt(1 - np.square(facing)) / np.maximum(facing, _LEAST_FACING)
        sigma = np.hypot(axial, across * slope)
        inside = below > 0
        profile = np.exp(np.square(below / np.where(inside, sigma, axial)) / -2) * (axial / sigma)
        profile += inside * np.exp(np.minimum(-below, 0) / self.body_decay_um) * _power(self.body_db)
        returned = self.grazing_share + (1 - self.grazing_share) * np.square(facing)
        profile *= returned * _power(self.surface_db) * through
        power[struck] = np.where(inside, 1, power[struck]) + profile
        return power

    def mean_grey(self, surface: Surface, grid: Grid, depths: "Depths | None" = None) -> NDArray[np.float32]:
        """Return the grey value of the mean power, before noise; see `mean_power`."""
        grey = np.log10(self.mean_power(surface, grid, depths))
        grey *= 10 * self.grey_per_db
        grey += self.noise_grey
        return grey

    def image(
        self,
        surface: Surface,
        grid: Grid,
        bits: NDArray[np.uint16],
        depths: "Depths | None" = None,
    ) -> NDArray[np.uint8]:
        """Return the grey values of n columns, shape (n, nz).

        Parameters
        ----------
        surface : Surface
            Of shape (n,).
        grid : Grid
            How finely the scanner sees.
        bits : ndarray of uint16, shape (n, nz)
            Random numbers over the whole range of their type: the noise.
        depths : Depths, optional
            As for `mean_power`.
        """
        grey = self.mean_grey(surface, grid, depths)
        total = np.empty(grey.shape, dtype=np.int16)
        # In one go, which is as fast as the conversion alone.
        np.multiply(grey, np.float32(_STEPS_PER_GREY), out=total, casting="unsafe")
        total += _noise_steps(self.noise)[bits]
        total >>= _STEPS_PER_GREY.bit_length() - 1
        return np.clip(total, 0, GREATEST_GREY).astype(np.uint8)


def _power(decibels: float | NDArray[np.float64]) -> NDArray[np.float32]:
    return np.asarray(10 ** (np.asarray(decibels) / 10), dtype=np.float32)


@lru_cache(maxsize=64)
def _noise_steps(noise: GreyNoise) -> NDArray[np.int16]:
    """Return the noise as steps of grey, one for each value of 16 random bits."""
    return np.asarray(np.rint(noise.quantiles(65536) * _STEPS_PER_GREY), dtype=np.int16)
