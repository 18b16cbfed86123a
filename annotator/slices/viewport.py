"""From widget pixels to micrometres and back, for one plane: pure numbers, no widget."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

from annotations.geometry.frames import Vector
from annotator.slices.projection import Plane

# Left free at each side when the whole plane is shown.
MARGIN = 0.03
# A voxel may fill this many pixels; beyond that there is nothing more to see.
LARGEST_VOXEL_PX = 80.0
# The plane may shrink to this part of the scale at which it fits.
SMALLEST_OF_FIT = 0.5


@dataclass(frozen=True)
class Area:
    """The part of the widget, in logical pixels, that the slice is drawn in."""

    left: float
    top: float
    width: float
    height: float

    @property
    def middle(self) -> tuple[float, float]:
        """The middle of the area."""
        return (self.left + self.width / 2, self.top + self.height / 2)

    def nearest(self, x: float, y: float) -> tuple[float, float]:
        """Return a pixel itself, or the nearest one in the area."""
        return (
            min(max(x, self.left), self.left + self.width),
            min(max(y, self.top), self.top + self.height),
        )

    def contains(self, x: float, y: float, margin: float = 0.0) -> bool:
        """Say whether a pixel lies in the area, and at least ``margin`` from its edges."""
        return (
            self.left + margin <= x <= self.left + self.width - margin
            and self.top + margin <= y <= self.top + self.height - margin
        )


@dataclass(frozen=True)
class Viewport:
    """What part of a plane is seen, and how large. One scale for both axes: shapes are the physical ones.

    Attributes
    ----------
    plane : Plane
    area : Area
        Where on the widget.
    center_um : (float, float)
        Coordinates along the horizontal and vertical axis at the area's middle.
    scale : float
        Logical pixels per µm.
    """

    plane: Plane
    area: Area
    center_um: tuple[float, float]
    scale: float

    @classmethod
    def fitted(cls, plane: Plane, area: Area) -> Self:
        """Return the viewport that shows the whole plane, as large as possible."""
        middle = tuple((low + high) / 2 for low, high in zip(plane.low_um, plane.high_um, strict=True))
        return cls(plane, area, (middle[0], middle[1]), fitting_scale(plane, area))

    @property
    def is_fitted(self) -> bool:
        """Whether the whole plane is shown, as large as possible."""
        return self == Viewport.fitted(self.plane, self.area)

    def voxels_per_pixel(self, pixel_ratio: float) -> tuple[int, int]:
        """Return how many voxels one pixel of the screen covers, whole ones, and at least one.

        Along the two array axes of the plane, in their order.

        Parameters
        ----------
        pixel_ratio : float
            Device pixels per logical pixel.
        """
        first, second = sorted((self.plane.horizontal, self.plane.vertical))
        pixel_um = 1 / (self.scale * pixel_ratio)
        return (
            max(1, int(pixel_um / self.plane.spacing_um[first])),
            max(1, int(pixel_um / self.plane.spacing_um[second])),
        )

    def pixel(self, position_um: Sequence[float]) -> tuple[float, float]:
        """Return where on the widget a position lies, whatever its distance from the plane."""
        return self.pixel_of_flat(self.plane.flat(position_um))

    def pixel_of_flat(self, flat_um: tuple[float, float]) -> tuple[float, float]:
        """Return where on the widget coordinates in the plane lie."""
        x, y = self.area.middle
        return (
            x + (flat_um[0] - self.center_um[0]) * self.scale,
            y + (flat_um[1] - self.center_um[1]) * self.scale,
        )

    def flat_um(self, x: float, y: float) -> tuple[float, float]:
        """Return the coordinates in the plane, in µm, of a pixel of the widget."""
        middle_x, middle_y = self.area.middle
        return (
            self.center_um[0] + (x - middle_x) / self.scale,
            self.center_um[1] + (y - middle_y) / self.scale,
        )

    def position_um(self, x: float, y: float, through_um: float) -> Vector:
        """Return the position of a pixel of the widget, given its coordinate along the plane's axis."""
        return self.plane.lifted(self.flat_um(x, y), through_um)

    def shows(self, position_um: Sequence[float], margin_px: float = 0.0) -> bool:
        """Say whether a position's projection is on the widget."""
        return self.area.contains(*self.pixel(position_um), margin_px)

    def zoomed(self, factor: float, x: float, y: float) -> Self:
        """Return the viewport with its scale multiplied, and what is under a pixel still under it."""
        return self.scaled(self.scale * factor, x, y)

    def scaled(self, scale: float, x: float, y: float) -> Self:
        """Return the viewport with a scale, kept in its limits, and what is under a pixel still under it."""
        low, high = self._scale_limits()
        kept = min(max(scale, low), high)
        under = self.flat_um(x, y)
        middle_x, middle_y = self.area.middle
        center = (under[0] - (x - middle_x) / kept, under[1] - (y - middle_y) / kept)
        return replace(self, scale=kept, center_um=self._clamped(center))

    def panned(self, dx: float, dy: float) -> Self:
        """Return the viewport with its content moved by some pixels; the plane cannot be lost from sight."""
        center = (self.center_um[0] - dx / self.scale, self.center_um[1] - dy / self.scale)
        return replace(self, center_um=self._clamped(center))

    def centered(self, position_um: Sequence[float]) -> Self:
        """Return the viewport with a position in its middle."""
        return replace(self, center_um=self._clamped(self.plane.flat(position_um)))

    def resized(self, area: Area) -> Self:
        """Return the viewport for another area: fitted if it was, else with the same middle and scale."""
        if self.is_fitted:
            return type(self).fitted(self.plane, area)
        return replace(self, area=area)

    def _clamped(self, center_um: tuple[float, float]) -> tuple[float, float]:
        across, down = (
            min(max(value, low), high)
            for value, low, high in zip(center_um, self.plane.low_um, self.plane.high_um, strict=True)
        )
        return (across, down)

    def _scale_limits(self) -> tuple[float, float]:
        finest = min(self.plane.spacing_um[self.plane.horizontal], self.plane.spacing_um[self.plane.vertical])
        fit = fitting_scale(self.plane, self.area)
        return (fit * SMALLEST_OF_FIT, max(LARGEST_VOXEL_PX / finest, fit))


def fitting_scale(plane: Plane, area: Area) -> float:
    """Return the scale, in pixels per µm, at which the whole plane just fits an area."""
    width_um, height_um = (high - low for low, high in zip(plane.low_um, plane.high_um, strict=True))
    room = 1 - 2 * MARGIN
    return min(max(area.width, 1.0) * room / width_um, max(area.height, 1.0) * room / height_um)
