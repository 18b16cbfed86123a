"""What a person answers when nothing says how far apart a volume's voxels are."""

from dataclasses import dataclass
from typing import Literal

from annotations.geometry.frames import Vector

Scope = Literal["once", "file", "folder"]


@dataclass(frozen=True)
class SpacingAnswer:
    """A person's answer.

    Attributes
    ----------
    spacing_um : (float, float, float)
        Between voxel centres along array axes 0, 1, 2.
    depth_axis : int
        The array axis along which the light travels.
    scope : str
        What it is remembered for: nothing, the file, or all volumes of the same shape in its folder.
    """

    spacing_um: Vector
    depth_axis: int = 2
    scope: Scope = "file"
