"""Where a network takes keypoints to be: clouds of two nested surfaces each.

A cloud that is cast like a volume would cost a frame 50 ms without a GPU. Surfaces in one colour cost little,
and may be drawn in any order: nothing is sorted when the camera moves.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import vtk
from PySide6.QtGui import QColor
from vtkmodules.util.numpy_support import numpy_to_vtk

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.heatmap_cloud import HeatmapCloud

_OUTER, _INNER = 0.16, 0.34
"""Opacity of the surfaces that hold 95 % and 50 % of the probability."""


class HeatmapLayer:
    """Translucent clouds in the prediction's colour."""

    def __init__(self) -> None:
        self._surfaces = (_Surface(_OUTER), _Surface(_INNER))
        self._shown: tuple[HeatmapCloud, ...] = ()

    @property
    def actors(self) -> tuple[vtk.vtkActor, ...]:
        """What is drawn."""
        return tuple(surface.actor for surface in self._surfaces)

    def show(self, clouds: "Sequence[HeatmapCloud]", color: QColor) -> None:
        """Draw these clouds and no others."""
        outer, inner = self._surfaces
        if tuple(clouds) != self._shown:
            self._shown = tuple(clouds)
            outer.show((cloud, cloud.most) for cloud in clouds)
            inner.show((cloud, cloud.half) for cloud in clouds)
        for surface in self._surfaces:
            surface.actor.GetProperty().SetColor(color.redF(), color.greenF(), color.blueF())


class _Surface:
    def __init__(self, opacity: float) -> None:
        self._mapper = vtk.vtkPolyDataMapper()
        self._mapper.ScalarVisibilityOff()
        self.actor = vtk.vtkActor()
        self.actor.SetMapper(self._mapper)
        self.actor.GetProperty().LightingOff()
        self.actor.GetProperty().BackfaceCullingOn()
        self.actor.GetProperty().SetOpacity(opacity)
        self.actor.PickableOff()
        self.actor.VisibilityOff()

    def show(self, clouds: "Iterable[tuple[HeatmapCloud, float]]") -> None:
        together = vtk.vtkAppendPolyData()
        for cloud, level in clouds:
            together.AddInputData(surface(cloud, level))
        is_any = together.GetNumberOfInputConnections(0) > 0
        self.actor.SetVisibility(is_any)
        if is_any:
            together.Update()
            self._mapper.SetInputData(together.GetOutput())


def surface(cloud: "HeatmapCloud", level: float) -> vtk.vtkPolyData:
    """Return the surface, facing outwards, at which a cloud has a likelihood."""
    grid = vtk.vtkImageData()
    grid.SetDimensions(cloud.likelihood.shape)
    grid.SetOrigin(cloud.origin_um)
    grid.SetSpacing(cloud.spacing_um)
    grid.GetPointData().SetScalars(numpy_to_vtk(np.ravel(cloud.likelihood, order="F"), deep=True))
    edges = vtk.vtkFlyingEdges3D()
    edges.SetInputData(grid)
    edges.ComputeScalarsOff()
    edges.ComputeGradientsOff()
    edges.SetValue(0, level)
    edges.Update()
    return edges.GetOutput()
