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
        self._count = 0
        self._ends_um = np.empty((0, 2, 3))
        self._colors = np.empty((0, 3), dtype=np.uint8)
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
        if len(wanted[0]) != self._count:
            self._make_room(len(wanted[0]))
        self._ends_um[:] = [(segment.first_um, segment.second_um) for segment in wanted[0]]
        self._colors[:] = [segment.color for segment in wanted[0]]
        self._lines.GetPoints().GetData().Modified()
        self._lines.GetCellData().GetScalars().Modified()
        self._lines.Modified()

    def _make_room(self, count: int) -> None:
        """Make lines whose ends and colours VTK reads where numpy writes them: in a drag only they change."""
        self._count = count
        self._ends_um = np.zeros((count, 2, 3))
        self._colors = np.zeros((count, 3), dtype=np.uint8)
        points = vtk.vtkPoints()
        points.SetData(numpy_to_vtk(self._ends_um.reshape(-1, 3)))
        cells = vtk.vtkCellArray()
        offsets, ids = np.arange(0, 2 * count + 1, 2, dtype=np.int64), np.arange(2 * count, dtype=np.int64)
        cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(ids, deep=True))
        self._lines.SetPoints(points)
        self._lines.SetLines(cells)
        self._lines.GetCellData().SetScalars(numpy_to_vtk(self._colors))


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
