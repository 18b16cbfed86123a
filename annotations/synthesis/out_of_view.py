"""Poses with a chosen share of the tool beside the volume."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.frames import vector
from annotations.geometry.kinematics import ToolPose, link_frames
from annotations.geometry.tool import ToolSpecification
from annotations.synthesis.grid import Grid

Array = NDArray[np.float64]

_HALVINGS = 25
"""To within 2 nm."""


def moved_out_of_view(
    pose: ToolPose, tool: ToolSpecification, grid: Grid, share: float, heading_deg: float
) -> ToolPose:
    """Return a pose moved across the light until a share of the tool lies beside the volume.

    Parameters
    ----------
    pose : ToolPose
        Whose tool lies inside.
    tool : ToolSpecification
    grid : Grid
    share : float
        Of the length of the links' axes, in [0, 1).
    heading_deg : float
        Which way it is moved, from axis 0 towards axis 1.
    """
    axes = _Axes(pose, tool, grid)
    heading = np.array([math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg)), 0.0])
    # Each point leaves once and for all, so that the share grows with the distance.
    low_um, high_um = 0.0, 2 * float(np.linalg.norm(grid.extent_um))
    for _ in range(_HALVINGS):
        middle_um = (low_um + high_um) / 2
        if axes.share_outside(middle_um * heading) < share:
            low_um = middle_um
        else:
            high_um = middle_um
    return replace(pose, position_um=vector(np.asarray(pose.position_um) + low_um * heading))


class _Axes:
    """The axes of a posed tool's links in voxels, from the outer corner of voxel (0, 0, 0)."""

    def __init__(self, pose: ToolPose, tool: ToolSpecification, grid: Grid) -> None:
        frames = link_frames(pose, tool)
        self._spacing_um = np.array(grid.spacing_um)
        self._end = np.array(grid.shape)
        self._length_um = np.array([tool.link(name).length_um for name in frames])
        along = np.array([frame.axes[:, 0] for frame in frames.values()]) * self._length_um[:, None]
        self._base = np.array([frame.base_um for frame in frames.values()]) / self._spacing_um + 0.5
        self._along = along / self._spacing_um

    def share_outside(self, shift_um: Array) -> float:
        """Return the share of their length outside of the volume once the tool is shifted."""
        base = self._base + shift_um / self._spacing_um
        with np.errstate(divide="ignore", invalid="ignore"):
            first, second = -base / self._along, (self._end - base) / self._along
        # Along an axis that a link lies across, it is inside for its whole length or not at all.
        across = self._along == 0
        inside = (base >= 0) & (base <= self._end)
        entered = np.where(across, np.where(inside, 0, 1), np.minimum(first, second)).max(axis=1)
        left = np.where(across, 1, np.maximum(first, second)).min(axis=1)
        seen = np.clip(np.minimum(left, 1) - np.maximum(entered, 0), 0, None)
        return float(1 - (seen * self._length_um).sum() / self._length_um.sum())
