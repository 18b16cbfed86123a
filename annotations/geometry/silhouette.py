"""The outline of a link's body seen along an axis."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.boxes import Box
from annotations.geometry.meshes import box_mesh

Array = NDArray[np.float64]


def silhouette_um(box: Box, axes: tuple[int, int], *, is_round: bool) -> Array:
    """Return the outline of a link's body, seen along the axis that is left out.

    Parameters
    ----------
    box : Box
    axes : (int, int)
        The array axes that stay, in this order.
    is_round : bool
        Whether the body is a cylinder, which is drawn with flat sides.

    Returns
    -------
    ndarray of float64, shape (n, 2)
        Corners in µm, one after the other around the outline; the last is joined to the first.
    """
    corners_um = np.asarray(box_mesh(box, is_round=is_round).vertices_um)[:, list(axes)]
    return convex_outline(corners_um)


def convex_outline(points: Array) -> Array:
    """Return the corners of the convex outline around points, shape (n, 2): Andrew's monotone chain."""
    ordered = sorted({(float(first), float(second)) for first, second in points})
    if len(ordered) < 3:
        return np.array(ordered).reshape(-1, 2)
    return np.array([*_chain(ordered)[:-1], *_chain(ordered[::-1])[:-1]])


def _chain(ordered: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    chain: list[tuple[float, float]] = []
    for point in ordered:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0:
            chain.pop()
        chain.append(point)
    return chain


def _turn(start: tuple[float, float], middle: tuple[float, float], end: tuple[float, float]) -> float:
    return (middle[0] - start[0]) * (end[1] - start[1]) - (middle[1] - start[1]) * (end[0] - start[0])
