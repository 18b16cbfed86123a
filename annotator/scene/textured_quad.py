"""A picture between four corners, as VTK takes it: for what is flat on the screen and what lies in space."""

from collections.abc import Iterable, Sequence

import numpy as np
import vtk
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk

_PLACES = np.array(((0, 0), (1, 0), (1, 1), (0, 1)), dtype=np.float32)


class TexturedQuad:
    """Four corners and the picture between them.

    Attributes
    ----------
    surface : vtkPolyData
        For a mapper.
    texture : vtkTexture
        For an actor; its pixels have sharp edges.
    """

    def __init__(self) -> None:
        self._picture = vtk.vtkImageData()
        self.texture = vtk.vtkTexture()
        self.texture.SetInputData(self._picture)
        self.texture.InterpolateOff()
        self._corners = vtk.vtkPoints()
        self._corners.SetNumberOfPoints(4)
        self.surface = vtk.vtkPolyData()
        self.surface.SetPoints(self._corners)
        cells = vtk.vtkCellArray()
        cells.InsertNextCell(4, (0, 1, 2, 3))
        self.surface.SetPolys(cells)
        self.surface.GetPointData().SetTCoords(numpy_to_vtk(_PLACES, deep=True))

    def show(self, pixels: NDArray[np.uint8], corners: Iterable[Sequence[float]]) -> None:
        """Show another picture between other corners.

        Parameters
        ----------
        pixels : numpy.ndarray
            Red, green, blue and alpha, shape (height, width, 4).
        corners : iterable of (float, float, float)
            The two ends of the first row, then those of the last one in the opposite order.
        """
        height, width, _ = pixels.shape
        for index, corner in enumerate(corners):
            self._corners.SetPoint(index, *corner)
        self._corners.Modified()
        self._picture.SetDimensions(width, height, 1)
        self._picture.GetPointData().SetScalars(
            numpy_to_vtk(np.ascontiguousarray(pixels).reshape(-1, 4), deep=True)
        )
        self._picture.Modified()
