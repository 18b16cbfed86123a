"""Which voxels of a volume lie inside a body: a closed mesh, or the body of a link."""

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.body import LinkBody
from annotations.geometry.meshes import Mesh
from annotations.synthesis.column_crossings import crossings

Axes = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Ascending positions in µm of voxels' centres along axes 0, 1, 2: of a volume, or of a block of one."""

_BLOCK = 8
"""Voxels along each axis of the blocks that are decided together where they can be."""
_ROUNDING_UM = 1e-3


def occupancy(mesh: Mesh, axes_um: Axes) -> NDArray[np.bool_]:
    """Return which voxels' centres lie inside a closed mesh in the volume's frame.

    By column parity: on the way down a column, each crossing of the surface leads in or out. A voxel on the
    surface belongs to the body where the body lies beyond it along an axis, so that two bodies that touch
    share no voxel. Where parts of one mesh overlap an even number of times, it is hollow.

    Parameters
    ----------
    mesh : Mesh
        Closed: each edge belongs to an even number of triangles, as `read_mesh` sees to.
    axes_um : (ndarray, ndarray, ndarray)
        Of shapes (nx,), (ny,), (nz,).

    Returns
    -------
    ndarray of bool, shape (nx, ny, nz)
    """
    x_um, y_um, z_um = axes_um
    turns = np.zeros((len(x_um), len(y_um), len(z_um)), dtype=np.uint8)
    columns = np.meshgrid(x_um, y_um, indexing="ij")
    for found in crossings(mesh, columns[0].ravel(), columns[1].ravel()):
        voxel = np.searchsorted(z_um, found.depth_um)
        reached = voxel < len(z_um)
        place = found.column[reached] * len(z_um) + voxel[reached]
        np.bitwise_xor.at(turns.reshape(-1), place, np.uint8(1))
    return np.bitwise_xor.accumulate(turns, axis=2, out=turns).view(np.bool_)


def body_occupancy(body: LinkBody, axes_um: Axes) -> NDArray[np.bool_]:
    """Return which voxels' centres lie inside a link's body or on it; as `occupancy` does."""
    # No surface is nearer than the distance from it: most blocks are decided by their first voxels.
    firsts_um = np.stack(np.meshgrid(*(axis_um[::_BLOCK] for axis_um in axes_um), indexing="ij"), axis=-1)
    distance_um = body.distance_um(firsts_um)
    reaches_um = []
    for axis, axis_um in enumerate(axes_um):
        whole = range(len(axis_um))
        distance_um = np.repeat(distance_um, _BLOCK, axis=axis).take(whole, axis=axis)
        reaches_um.append(np.max(axis_um - np.repeat(axis_um[::_BLOCK], _BLOCK)[whole], initial=0.0))
    inside = distance_um <= 0
    undecided = np.abs(distance_um) <= np.linalg.norm(reaches_um) + _ROUNDING_UM
    inside[undecided] = body.distance_um(positions_um(axes_um, undecided)) <= 0
    return np.asarray(inside)


def positions_um(axes_um: Axes, chosen: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the positions in µm of chosen voxels' centres, shape (n, 3), in C order."""
    voxels = np.nonzero(chosen)
    return np.stack([axis_um[index] for axis_um, index in zip(axes_um, voxels, strict=True)], axis=-1)
