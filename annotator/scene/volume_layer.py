"""The volume as light passes through it, or its brightest sample along each ray."""

import math
from dataclasses import dataclass, replace

import numpy as np
import vtk
from vtkmodules.util.numpy_support import numpy_to_vtk

from annotations.geometry.frames import Vector
from annotations.volumes import Level
from annotator.looks.colormaps import COLORMAPS
from annotator.session.viewing.opacity import FAINT, OPAQUE
from annotator.session.viewing.view import Rendering

MOVING_RAY_PX = 4.0
"""Distance of rays on the screen while something moves, without a GPU; at rest there is one a pixel."""

_FARTHEST_RAY_PX = 8.0
_MOVING_FRAME_S = 0.05

# The first of all computes a table of directions, as the first mapper would do. That holds Python's lock for
# 17 ms: better now, as a part of the import, than in a step of the window's own.
vtk.vtkSphericalDirectionEncoder()

_COLORS = 32  # of a colour map of 256: straight lines between them cannot be told from it


@dataclass(frozen=True)
class VolumeLook:
    """All that the volume's picture depends on, besides the camera.

    Attributes
    ----------
    level : Level
        Levels are equal only to themselves.
    ray_px : float
        Distance of the rays on the screen.
    """

    level: Level
    window: tuple[float, float]
    opacity_threshold: float
    rendering: Rendering
    colormap: str
    cropping_um: tuple[Vector, Vector] | None
    ray_px: float


class VolumeLayer:
    """The volume's actor.

    Attributes
    ----------
    actor : vtkVolume
    """

    def __init__(self, *, software: bool) -> None:
        if software:
            self._mapper = vtk.vtkFixedPointVolumeRayCastMapper()
        else:
            self._mapper = vtk.vtkGPUVolumeRayCastMapper()
            self._mapper.UseJitteringOn()
        self._mapper.AutoAdjustSampleDistancesOff()
        self._mapper.SetCroppingRegionFlagsToSubVolume()
        self._colors = vtk.vtkColorTransferFunction()
        self._opacity = vtk.vtkPiecewiseFunction()
        appearance = vtk.vtkVolumeProperty()
        appearance.SetColor(self._colors)
        appearance.SetScalarOpacity(self._opacity)
        appearance.SetInterpolationTypeToLinear()
        self._appearance = appearance
        self.actor = vtk.vtkVolume()
        self.actor.SetMapper(self._mapper)
        self.actor.SetProperty(appearance)
        self._look: VolumeLook | None = None

    def show(self, look: VolumeLook) -> None:
        """Make the actor look so; does nothing where it does already."""
        before, self._look = self._look, look
        if look == before:
            return
        if before is None or look.level is not before.level:
            self._load(look.level)
        self._mapper.SetImageSampleDistance(look.ray_px)
        self._mapper.SetCropping(look.cropping_um is not None)
        if look.cropping_um is not None:
            low, high = look.cropping_um
            self._mapper.SetCroppingRegionPlanes(low[0], high[0], low[1], high[1], low[2], high[2])
        if before is None or replace(before, ray_px=look.ray_px) != look:
            self._color(look)

    def _load(self, level: Level) -> None:
        image = vtk.vtkImageData()
        image.SetDimensions(level.data.shape)
        image.SetSpacing(level.spacing_um)
        image.SetOrigin(level.origin_um)
        # VTK's x runs fastest, as a level's first axis does: nothing is copied.
        image.GetPointData().SetScalars(numpy_to_vtk(level.stored.values.ravel(order="F")))
        self._mapper.SetInputData(image)
        # World units: VTK's default of 1 would be 1 µm.
        step_um = float(np.mean(level.spacing_um))
        self._mapper.SetSampleDistance(step_um)
        self._appearance.SetScalarOpacityUnitDistance(step_um)

    def _color(self, look: VolumeLook) -> None:
        stored = look.level.stored
        low, high = (stored.of(intensity) for intensity in look.window)
        high = max(high, low + 1e-6)
        threshold = stored.of(look.opacity_threshold)
        table = COLORMAPS[look.colormap][np.linspace(0, 255, _COLORS).astype(int), :3] / 255
        self._colors.RemoveAllPoints()
        for intensity, color in zip(np.linspace(low, high, _COLORS), table, strict=True):
            self._colors.AddRGBPoint(intensity, *color)
        self._opacity.RemoveAllPoints()
        # The last point below the threshold and the first one at it: a step, not a slope.
        self._opacity.AddPoint(threshold - 1e-3, 0.0)
        if look.rendering == "mip":
            self._mapper.SetBlendModeToMaximumIntensity()
            self._opacity.AddPoint(threshold, 1.0 if threshold > low else 0.0)
            self._opacity.AddPoint(max(threshold, low + (high - low) / 4) + 1e-3, 1.0)
        else:
            self._mapper.SetBlendModeToComposite()
            brightest = max(high, threshold + 1e-3)
            self._opacity.AddPoint(threshold, FAINT)
            self._opacity.AddPoint(brightest, OPAQUE)


def next_moving_ray_px(ray_px: float, took_s: float) -> float:
    """Return the distance of rays for the next frame of a motion, after one that took so long.

    The time goes with the number of rays. A slow computer, or a large window, gets coarser pictures rather
    than fewer; none gets finer ones than `MOVING_RAY_PX`.
    """
    wanted_px = ray_px * math.sqrt(took_s / _MOVING_FRAME_S)
    return float(np.clip(round(2 * wanted_px) / 2, MOVING_RAY_PX, _FARTHEST_RAY_PX))
