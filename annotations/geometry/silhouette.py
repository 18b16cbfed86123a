"""The outline of a convex body seen along an axis."""

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.meshes import Mesh


def silhouette_um(mesh: Mesh, axes: tuple[int, int]) -> NDArray[np.float64]:
    """Return the outline of a convex body, seen along the axis that is left out.

    Corners lie on it where a triangle that faces the viewer meets one that does not. Convex outlines go round
    their middle, so that the angle there puts the corners in order.

    Parameters
    ----------
    mesh : Mesh
        Its surface.
    axes : (int, int)
        The array axes that stay, in this order.

    Returns
    -------
    ndarray of float64, shape (n, 2)
        Corners in µm, one after the other around the outline; the last is joined to the first.
    """
    places_um = mesh.vertices_um[:, list(axes)]
    first, second, third = (places_um[mesh.triangles[:, corner]] for corner in range(3))
    (across, up), (wide, high) = (second - first).T, (third - first).T
    is_facing = across * high > up * wide
    in_front, behind = np.zeros(len(places_um), dtype=bool), np.zeros(len(places_um), dtype=bool)
    in_front[mesh.triangles[is_facing]] = True
    behind[mesh.triangles[~is_facing]] = True
    corners_um = places_um[in_front & behind]
    right, down = (corners_um - corners_um.mean(axis=0)).T
    return np.asarray(corners_um[np.argsort(np.arctan2(down, right), kind="stable")])
