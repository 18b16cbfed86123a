"""A posed mesh as a body before the scanner."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from annotations.geometry.body import Surface
from annotations.geometry.kinematics import LinkFrame
from annotations.geometry.meshes import Mesh
from annotations.synthesis.column_crossings import crossings

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeshShape:
    """A closed mesh in a frame of its own, whose origin is the base of a link.

    Attributes
    ----------
    mesh : Mesh
    """

    mesh: Mesh

    @cached_property
    def outermost_um(self) -> Array:
        """The vertices of the convex hull, shape (k, 3): they alone decide how much room a pose takes."""
        return np.asarray(self.mesh.vertices_um[ConvexHull(self.mesh.vertices_um).vertices])


@dataclass(frozen=True, eq=False)
class MeshBody:
    """A closed mesh where it stands in the volume; light ends on it as on a `LinkBody`.

    Attributes
    ----------
    shape : MeshShape
    frame : LinkFrame
        Where its own frame stands in the volume's.
    """

    shape: MeshShape
    frame: LinkFrame

    @cached_property
    def mesh(self) -> Mesh:
        """The mesh in the volume's frame."""
        return Mesh(self._placed_um(self.shape.mesh.vertices_um), self.shape.mesh.triangles)

    def bounds_um(self) -> tuple[Array, Array]:
        """Return the lowest and the highest position in µm along each axis, shape (3,) each."""
        outermost_um = self._placed_um(self.shape.outermost_um)
        return outermost_um.min(axis=0), outermost_um.max(axis=0)

    def first_hit(self, x_um: ArrayLike, y_um: ArrayLike) -> Surface:
        """Return where light along +z meets this body in columns at x and y in µm, shapes (n,)."""
        x, y = np.asarray(x_um, dtype=np.float64), np.asarray(y_um, dtype=np.float64)
        surface = Surface(np.full(len(x), np.inf), np.zeros(len(x)))
        for found in crossings(self.mesh, x, y):
            np.minimum.at(surface.depth_um, found.column, found.depth_um)
            first = found.depth_um == surface.depth_um[found.column]
            surface.facing[found.column[first]] = self._facing[found.triangle[first]]
        return surface

    def _placed_um(self, positions_um: Array) -> Array:
        return np.asarray(self.frame.base_um + positions_um @ self.frame.axes.T)

    @cached_property
    def _facing(self) -> Array:
        """Cosine between each triangle's outward normal and the way back, (m,), where light meets it."""
        corner, second, third = (self.mesh.vertices_um[self.mesh.triangles[:, index]] for index in range(3))
        normal = np.cross(second - corner, third - corner)
        length = np.linalg.norm(normal, axis=1)
        return np.asarray(np.abs(normal[:, 2]) / np.where(length > 0, length, 1))
