"""The surface of a body as the eye sees it: which way it faces, its outline, and what is nearest."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector
from annotations.geometry.meshes import Mesh, box_mesh
from annotator.scene.camera import Camera
from annotator.session.editing.solids import Solid

Array = NDArray[np.float64]

_UNTURNED = (1.0, 0.0, 0.0, 0.0)

_SHARP = math.cos(math.radians(40))
"""Cosine between the normals of two triangles below which the edge between them is a sharp one."""

_EDGE_ON = 1e-9
"""Cosine from which on a triangle faces the eye: what is seen from its edge alone has no edges of its own."""


@dataclass(frozen=True, eq=False)
class Facets:
    """A body's triangles, with normals that are smooth where the surface is.

    Attributes
    ----------
    corners_um : ndarray of float64, shape (m, 3, 3)
        Of each triangle, in the volume's frame.
    normals : ndarray of float64, shape (m, 3)
        Outward unit vectors of the triangles.
    corner_normals : ndarray of float64, shape (m, 3, 3)
        Those of the surface at each triangle's corners.
    edges_um : ndarray of float64, shape (k, 2, 3)
        Each edge once.
    beside : ndarray of int64, shape (k, 2)
        The two triangles at each edge.
    sharp : ndarray of bool, shape (k,)
        Which edges are sharp ones.
    """

    corners_um: Array
    normals: Array
    corner_normals: Array
    edges_um: Array
    beside: NDArray[np.int64]
    sharp: NDArray[np.bool_]

    def facing(self, camera: Camera) -> Array:
        """Return the cosine between the surface and the eye at each corner, shape (m, 3): 1 is face on."""
        return -np.einsum("ijk,ijk->ij", self.corner_normals, _sight(self.corners_um, camera))

    def depths_um(self, camera: Camera) -> Array:
        """Return how far behind the focal point each triangle's middle is, shape (m,)."""
        return (self.corners_um.mean(axis=1) - camera.focal_um) @ np.asarray(camera.forward)

    def outline_um(self, camera: Camera) -> Array:
        """Return the edges between what faces the eye and what does not, and the sharp ones that it sees.

        Returns
        -------
        ndarray of float64, shape (n, 2, 3)
        """
        middles_um = self.corners_um.mean(axis=1)
        front = np.einsum("ij,ij->i", self.normals, _sight(middles_um, camera)) < -_EDGE_ON
        one, other = self.beside.T
        seen = (front[one] != front[other]) | (self.sharp & front[one] & front[other])
        return self.edges_um[seen]


@lru_cache(maxsize=64)
def facets(solid: Solid) -> Facets:
    """Return the facets of a body; those of bodies that were drawn lately are kept."""
    shape = _shape(solid.box.size_um, solid.is_round)
    # A body that moves keeps its shape: only where its corners are, and which way they face, is new.
    center_um, turn = np.asarray(solid.box.center_um), solid.box.axes.T
    return replace(
        shape,
        corners_um=center_um + shape.corners_um @ turn,
        normals=shape.normals @ turn,
        corner_normals=shape.corner_normals @ turn,
        edges_um=center_um + shape.edges_um @ turn,
    )


@lru_cache(maxsize=64)
def _shape(size_um: Vector, is_round: bool) -> Facets:
    """Return the facets of a body of a size, about its centre and along its own axes."""
    mesh = box_mesh(Box((0.0, 0.0, 0.0), size_um, _UNTURNED), is_round=is_round)
    corners = mesh.vertices_um[mesh.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    ends, beside = _edges(mesh)
    one, other = beside.T
    sharp = np.einsum("ij,ij->i", normals[one], normals[other]) < _SHARP
    return Facets(corners, normals, _smooth(mesh, normals), mesh.vertices_um[ends], beside, sharp)


def _smooth(mesh: Mesh, normals: Array) -> Array:
    """Return the mean normal at each corner over the triangles there that are not beyond a sharp edge."""
    count = len(mesh.triangles)
    touches = np.zeros((len(mesh.vertices_um), count), dtype=bool)
    touches[mesh.triangles, np.arange(count)[:, None]] = True
    alike = normals @ normals.T >= _SHARP
    sums = (touches[mesh.triangles] & alike[:, None, :]).astype(np.float64) @ normals
    return sums / np.linalg.norm(sums, axis=2, keepdims=True)


def _edges(mesh: Mesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the vertices of each edge of a closed surface, and the triangles at it, shape (k, 2) each."""
    pairs = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(pairs.T)
    # On a closed surface every edge belongs to two triangles: sorted, they come in pairs.
    return pairs[order[::2]], (order // 3).reshape(-1, 2)


def _sight(positions_um: Array, camera: Camera) -> Array:
    """Return the direction in which the eye sees each position: unit vectors, of the positions' shape."""
    if camera.parallel:
        return np.broadcast_to(np.asarray(camera.forward), positions_um.shape)
    ways = positions_um - np.asarray(camera.eye_um)
    return ways / np.linalg.norm(ways, axis=-1, keepdims=True)
