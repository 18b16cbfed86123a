"""The needle's surface in one volume of the needle trial, found by brightness alone."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

SPACING_UM = (5.9, 76.0, 51.0)
"""Of the data set's volumes, about, as fitted from the robot's poses by others."""
DEPTH_AXIS = 0
FIRST_ROW = 24
"""Above lie reflections of the optics: rows 0 to 7, and once more, fainter, rows 21 and 22."""
BRIGHT = 128
"""The data were thresholded by their makers: nearly every voxel is 0 or 255."""
_BLOCK_ROWS = 8
_IN_BLOCK = 2
_GAP_ROWS = 3
_TIP_POINTS = 12

Points = NDArray[np.float64]


def surface_um(voxels: NDArray[np.uint8]) -> Points:
    """Return where the light first meets the needle in each column, and again below each gap.

    Parameters
    ----------
    voxels : ndarray of uint8, shape (depth, rows, columns)

    Returns
    -------
    ndarray, shape (n, 3)
        In µm, in the volume's frame.
    """
    bright = voxels[FIRST_ROW:] >= BRIGHT
    depth, rows, columns = bright.shape
    # Noise is in single voxels: blocks of a column that hold several of them are joined to bodies.
    blocks = bright[: depth - depth % _BLOCK_ROWS].reshape(-1, _BLOCK_ROWS, rows, columns).sum(1) >= _IN_BLOCK
    bodies, count = ndimage.label(blocks, np.ones((3, 3, 3)))
    if count == 0:
        return np.empty((0, 3))
    needle = 1 + int(np.argmax(np.bincount(bodies.ravel())[1:]))
    bright[: depth - depth % _BLOCK_ROWS] &= np.repeat(bodies == needle, _BLOCK_ROWS, axis=0)
    bright[depth - depth % _BLOCK_ROWS :] = False
    filled = ndimage.binary_closing(bright, np.ones((_GAP_ROWS, 1, 1)))
    begins = filled[1:] & ~filled[:-1]
    # What begins in the first row was cut there.
    index = np.argwhere(begins) + np.array([FIRST_ROW + 1, 0, 0])
    return np.asarray(index * np.array(SPACING_UM))


def farthest_um(points_um: Points, direction: Points, *, count: int = _TIP_POINTS) -> Points:
    """Return the middle of the points that lie farthest in a direction, shape (3,)."""
    order = np.argsort(points_um @ direction)
    return np.asarray(np.median(points_um[order[-count:]], axis=0))


def common_direction(surfaces_um: list[Points]) -> Points:
    """Return the unit vector along which the needle lies, on the whole, towards its tip.

    It comes in through the face at index 0 of axis 1, and its tip is inside the volume.
    """
    directions = []
    for points_um in surfaces_um:
        _, _, axes = np.linalg.svd(points_um - points_um.mean(0), full_matrices=False)
        directions.append(axes[0] * np.sign(axes[0][1]))
    mean = np.median(directions, axis=0)
    return np.asarray(mean / np.linalg.norm(mean))
