"""Straight lines in space: what links, outlines, the crosshair and rays are drawn with."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import vtk
from numpy.typing import ArrayLike, NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

from annotations.geometry.frames import Vector
from annotator.scene.colors import Rgb

# Of the corners of a block, counted in binary along its axes: those that differ in one digit.
_BLOCK_EDGES = [
    (first, second) for first, second in combinations(range(8), 2) if (first ^ second) in (1, 2, 4)
]


@dataclass(frozen=True)
class Segment:
    """A straight line between two positions in µm."""

    first_um: Vector
    second_um: Vector
    color: Rgb


class Segments:
    """An actor that draws segments of one width.

    Attributes
    ----------
    actor : vtkActor
    """

    def __init__(self, width_px: float) -> None:
        self._width_px = width_px
        self._shown: tuple[tuple[Segment, ...], float] | None = None
        self._lines = vtk.vtkPolyData()
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputData(self._lines)
        self.actor = vtk.vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.GetProperty().LightingOff()
        self.actor.PickableOff()

    def show(self, segments: Iterable[Segment], ratio: float) -> None:
        """Draw these segments and no others; ``ratio``: the screen's pixels for one of Qt's."""
        wanted = (tuple(segments), ratio)
        if wanted == self._shown:
            return
        self._shown = wanted
        self.actor.SetVisibility(bool(wanted[0]))
        if not wanted[0]:
            return
        self.actor.GetProperty().SetLineWidth(self._width_px * ratio)
        ends = np.array([(segment.first_um, segment.second_um) for segment in wanted[0]], dtype=np.float64)
        points = vtk.vtkPoints()
        points.SetData(numpy_to_vtk(ends.reshape(-1, 3), deep=True))
        cells = vtk.vtkCellArray()
        offsets = np.arange(0, 2 * len(ends) + 1, 2, dtype=np.int64)
        ids = np.arange(2 * len(ends), dtype=np.int64)
        cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(ids, deep=True))
        self._lines.SetPoints(points)
        self._lines.SetLines(cells)
        colors = np.array([segment.color for segment in wanted[0]], dtype=np.uint8)
        self._lines.GetCellData().SetScalars(numpy_to_vtk(colors, deep=True))
        self._lines.Modified()


def box_edges(low_um: ArrayLike, high_um: ArrayLike, color: Rgb) -> Sequence[Segment]:
    """Return the twelve edges of a box along the volume's axes."""
    sides = zip(np.asarray(low_um), np.asarray(high_um), strict=True)
    return block_edges(np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1), color)


def block_edges(corners_um: NDArray[np.float64], color: Rgb) -> Sequence[Segment]:
    """Return the twelve edges of a block, given its corners, shape (2, 2, 2, 3)."""
    return segments(corners_um.reshape(8, 3)[_BLOCK_EDGES], color)


def segments(lines_um: NDArray[np.float64], color: Rgb) -> list[Segment]:
    """Return lines of one colour, given their ends, shape (n, 2, 3)."""
    return [Segment(tuple(first), tuple(second), color) for first, second in lines_um.tolist()]
