"""Which voxels of a volume lie inside a closed mesh."""

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.meshes import Mesh
from annotations.synthesis.column_crossings import crossings
from annotations.synthesis.grid import Grid


def occupancy(mesh: Mesh, grid: Grid) -> NDArray[np.bool_]:
    """Return which voxels' centres lie inside a closed mesh in the volume's frame.

    By column parity: on the way down a column, each crossing of the surface leads in or out. A voxel on the
    surface belongs to the body where the body lies beyond it along an axis, so that two bodies that touch
    share no voxel. Where parts of one mesh overlap an even number of times, it is hollow.

    Parameters
    ----------
    mesh : Mesh
        Closed: each edge belongs to an even number of triangles, as `read_mesh` sees to.
    grid : Grid

    Returns
    -------
    ndarray of bool
        Of the grid's shape.
    """
    inside = np.zeros(grid.shape, dtype=np.uint8)
    low, high = mesh.vertices_um.min(axis=0), mesh.vertices_um.max(axis=0)
    axes = [grid.axis_um(axis) for axis in range(3)]
    # Beyond its bounds the mesh has no crossing, or all of them.
    block = tuple(slice(*np.searchsorted(axis, ends)) for axis, *ends in zip(axes, low, high, strict=True))
    x_um, y_um, z_um = (axis[part] for axis, part in zip(axes, block, strict=True))
    turns = np.zeros((len(x_um), len(y_um), len(z_um)), dtype=np.uint8)
    columns = np.meshgrid(x_um, y_um, indexing="ij")
    for found in crossings(mesh, columns[0].ravel(), columns[1].ravel()):
        voxel = np.searchsorted(z_um, found.depth_um)
        reached = voxel < len(z_um)
        place = found.column[reached] * len(z_um) + voxel[reached]
        np.bitwise_xor.at(turns.reshape(-1), place, np.uint8(1))
    np.bitwise_xor.accumulate(turns, axis=2, out=inside[block])
    return inside.view(np.bool_)
