"""How much of a tool lies outside a volume, counted point by point along its links."""

import numpy as np

from annotations.geometry.kinematics import ToolPose, link_frames
from annotations.geometry.tool import ToolSpecification
from annotations.synthesis.grid import Grid


def share_out_of_view(pose: ToolPose, tool: ToolSpecification, grid: Grid) -> float:
    """Return the share of the length of the links' axes, to within 1/8000 of a link's length an end."""
    steps = (np.arange(4000) + 0.5) / 4000
    outside_um, whole_um = 0.0, 0.0
    for name, frame in link_frames(pose, tool).items():
        length_um = tool.link(name).length_um
        index = (frame.base_um + np.outer(steps, frame.axes[:, 0]) * length_um) / grid.spacing_um
        beside = np.any((index < -0.5) | (index > np.array(grid.shape) - 0.5), axis=1)
        outside_um, whole_um = outside_um + beside.mean() * length_um, whole_um + length_um
    return float(outside_um / whole_um)
