"""What VTK gets of a volume, and how coarse the rays are while something moves."""

import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy

from annotations.volumes import Level
from annotations.volumes.levels import displayed
from annotator.scene.volume_layer import MOVING_RAY_PX, VolumeLayer, VolumeLook, next_moving_ray_px


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int16, np.float32])
def test_vtk_draws_what_is_in_memory_already(dtype: type) -> None:
    data = displayed(np.arange(24, dtype=dtype).reshape(2, 3, 4))
    level = Level(data, (3.0, 2.0, 1.0), (0.0, 0.0, 0.0), "strided", (1, 1, 1))
    layer = VolumeLayer(software=True)
    layer.show(VolumeLook(level, (0.0, 24.0), 5.0, "volume", "gray", None, 1.0))
    image = layer.actor.GetMapper().GetInput()
    drawn = vtk_to_numpy(image.GetPointData().GetScalars())
    assert np.shares_memory(drawn, level.stored.values)
    assert image.GetDimensions() == (2, 3, 4)
    assert image.GetScalarComponentAsDouble(1, 2, 3, 0) == level.stored.of(float(data[1, 2, 3]))


def test_slow_frames_get_fewer_rays_and_fast_ones_get_them_back() -> None:
    slow = next_moving_ray_px(MOVING_RAY_PX, 0.3)
    assert slow > MOVING_RAY_PX
    assert next_moving_ray_px(slow, 0.05) == slow
    assert next_moving_ray_px(slow, 0.01) == MOVING_RAY_PX
    assert next_moving_ray_px(slow, 100.0) <= 8
    assert next_moving_ray_px(MOVING_RAY_PX, 0.001) == MOVING_RAY_PX
