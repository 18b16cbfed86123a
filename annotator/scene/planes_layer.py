"""The three slice planes: their outlines, the lines in which they meet, and the coarse slices themselves."""

from dataclasses import dataclass

import numpy as np
import vtk
from numpy.typing import NDArray

from annotations.geometry.frames import Vector, nearest_voxel, voxel_to_um
from annotations.volumes import Level
from annotator.looks.colormaps import COLORMAPS
from annotator.scene.colors import axis_colors, rgb
from annotator.scene.segments import Segment, Segments, segments
from annotator.scene.textured_quad import TexturedQuad

_OUTLINE_DARKER = 130  # percent: the crosshair stands out
_BLACK = np.array((0, 0, 0, 255), dtype=np.uint8)


@dataclass(frozen=True)
class PlanesLook:
    """Where the planes are, and what of them is drawn as lines.

    Attributes
    ----------
    box_um : ((float, float, float), (float, float, float)) or None
        Outer corners of the volume that they run through; None where there is none.
    outlined, crossed : bool
        Whether the planes' outlines and the crosshair's lines are drawn.
    """

    crosshair_um: Vector
    box_um: tuple[Vector, Vector] | None
    outlined: bool
    crossed: bool
    ratio: float


class PlanesLayer:
    """The outlines of three planes, and the three lines in which they meet."""

    def __init__(self) -> None:
        self._outlines = Segments(width_px=1)
        self._crosshair = Segments(width_px=1)
        self._look: PlanesLook | None = None

    @property
    def actors(self) -> tuple[vtk.vtkProp, ...]:
        """What is drawn."""
        return (self._outlines.actor, self._crosshair.actor)

    def show(self, look: PlanesLook) -> None:
        """Make the planes look so; does nothing where they do already."""
        if look == self._look:
            return
        self._look = look
        outlines: list[Segment] = []
        crosshair: list[Segment] = []
        low, high = (np.array(corner) for corner in look.box_um or (look.crosshair_um, look.crosshair_um))
        for axis, color in enumerate(axis_colors() if look.box_um else ()):
            corners = _plane_corners(axis, look.crosshair_um, low, high)
            sides = np.stack((corners, np.roll(corners, -1, axis=0)), axis=1)
            outlines += segments(sides, rgb(color.darker(_OUTLINE_DARKER)))
            ends = np.tile(np.asarray(look.crosshair_um, dtype=np.float64), (1, 2, 1))
            ends[0, :, axis] = low[axis], high[axis]
            crosshair += segments(ends, rgb(color))
        self._outlines.show(outlines if look.outlined else (), look.ratio)
        self._crosshair.show(crosshair if look.crossed else (), look.ratio)


@dataclass(frozen=True)
class SlicesLook:
    """All that the slices' picture depends on.

    Attributes
    ----------
    level : Level
        What the slices are cut from; levels are equal only to themselves.
    """

    level: Level
    crosshair_um: Vector
    window: tuple[float, float]
    colormap: str


class SlicesLayer:
    """The three slices of a level through the crosshair, as pictures in space, in the volume's place."""

    def __init__(self) -> None:
        self._slices = [_Slice(axis) for axis in range(3)]
        self._look: SlicesLook | None = None

    @property
    def actors(self) -> tuple[vtk.vtkProp, ...]:
        """What is drawn."""
        return tuple(shown.actor for shown in self._slices)

    def show(self, look: SlicesLook) -> None:
        """Make the slices look so; does nothing where they do already."""
        if look != self._look:
            self._look = look
            for shown in self._slices:
                shown.show(look)


def _plane_corners(
    axis: int, through_um: Vector, low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the corners of a plane across an axis, shape (4, 3), in the order of a slice's picture."""
    across, down = (other for other in range(3) if other != axis)
    corners = np.tile(np.asarray(through_um, dtype=np.float64), (4, 1))
    corners[:, across] = (low[across], high[across], high[across], low[across])
    corners[:, down] = (low[down], low[down], high[down], high[down])
    return corners


class _Slice:
    """One slice of a level, as a picture on a rectangle in space."""

    def __init__(self, axis: int) -> None:
        self._axis = axis
        self._quad = TexturedQuad()
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputData(self._quad.surface)
        self.actor = vtk.vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.SetTexture(self._quad.texture)
        self.actor.GetProperty().LightingOff()

    def show(self, look: SlicesLook) -> None:
        axis, level = self._axis, look.level
        from_level = np.subtract(look.crosshair_um, level.origin_um)
        index = nearest_voxel(from_level, level.spacing_um, level.data.shape)[axis]
        values = np.moveaxis(level.data, axis, 0)[index]
        half = np.asarray(level.spacing_um) / 2
        low = np.asarray(level.origin_um) - half
        high = low + voxel_to_um(level.data.shape, level.spacing_um)
        pixels = colored(values, look.window, look.colormap).transpose(1, 0, 2)
        self._quad.show(pixels, _plane_corners(axis, look.crosshair_um, low, high))


def colored(values: NDArray, window: tuple[float, float], colormap: str) -> NDArray[np.uint8]:
    """Return a slice's colours, shape (..., 4); what is not a number is black."""
    low, high = window
    parts = (values.astype(np.float64) - low) / max(high - low, 1e-12)
    numbers = ~np.isnan(parts)
    indices = (np.clip(np.where(numbers, parts, 0), 0, 1) * 255).astype(np.uint8)
    return np.where(numbers[..., None], COLORMAPS[colormap][indices], _BLACK)
