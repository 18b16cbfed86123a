"""What lies under the cursor: position, voxel, and the intensity in full resolution."""

from dataclasses import dataclass

import numpy as np

from annotations.geometry.frames import Vector, is_inside, nearest_voxel
from annotations.volumes import SliceImage
from annotator.slices.viewport import Viewport

WAITING = "…"
OUTSIDE = "outside"


@dataclass(frozen=True)
class Readout:
    """What lies under a pixel of a slice view.

    Attributes
    ----------
    position_um : (float, float, float)
    index_voxel : (int, int, int) or None
        None outside the volume.
    intensity : str
        Of that voxel, as the file has it; an ellipsis until it is read.
    """

    position_um: Vector
    index_voxel: tuple[int, int, int] | None
    intensity: str

    @property
    def text(self) -> str:
        """All of it on one line, what is looked for most often first: the end may not find room."""
        millimetres = ", ".join(f"{value / 1000:.3f}" for value in self.position_um)
        if self.index_voxel is None:
            return f"{self.intensity} · {millimetres} mm"
        voxel = ", ".join(map(str, self.index_voxel))
        return f"intensity {self.intensity} · voxel {voxel} · {millimetres} mm"


def read_out(viewport: Viewport, index: int, image: SliceImage | None, x: float, y: float) -> Readout:
    """Return what lies under a pixel of the widget that shows the plane with an index.

    The intensity never comes from a coarse slice: it would be a mean, or another voxel's.
    """
    plane = viewport.plane
    position_um = viewport.position_um(x, y, plane.depth_um(index))
    if not is_inside(position_um, plane.shape, plane.spacing_um):
        return Readout(position_um, None, OUTSIDE)
    voxel = nearest_voxel(position_um, plane.spacing_um, plane.shape)
    if image is None or not image.sharp or image.index != index:
        return Readout(position_um, voxel, WAITING)
    first, second = (voxel[axis] for axis in range(3) if axis != plane.axis)
    return Readout(position_um, voxel, intensity_text(image.data[first, second]))


def intensity_text(value: np.generic) -> str:
    """Return an intensity as a person writes it."""
    number = value.item()
    return str(number) if isinstance(number, int) else f"{number:.6g}"
