"""The tool's surface as triangles, cut by planes and met by rays: ghost and boxes are drawn from it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, link_boxes
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]

_SIDES = 32
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed surface of triangles, whose corners turn right-handed about the outward normal.

    Attributes
    ----------
    vertices_um : ndarray of float64, shape (n, 3)
        In the volume's frame.
    triangles : ndarray of int64, shape (m, 3)
        Indices of vertices.
    """

    vertices_um: Array
    triangles: NDArray[np.int64]

    def cut_um(self, axis: int, through_um: float) -> Array:
        """Return where the plane across an axis at a position cuts the surface.

        Returns
        -------
        ndarray of float64, shape (k, 2, 3)
            The ends of line segments in µm, in no order; a triangle that only touches the plane gives none.
        """
        height = self.vertices_um[:, axis] - through_um
        # A vertex on the plane counts as above, so that each edge crosses or does not: none is found twice.
        above = height[self.triangles] >= 0
        crossed = self.triangles[above.any(axis=1) & ~above.all(axis=1)]
        if not len(crossed):
            return np.empty((0, 2, 3))
        is_above = height[crossed] >= 0
        # The corner that is alone on its side comes first: both of its edges cross.
        alone = np.where(is_above.sum(axis=1, keepdims=True) == 1, is_above, ~is_above).argmax(axis=1)
        order = (alone[:, None] + np.arange(3)) % 3
        first, *others = np.take_along_axis(crossed, order, axis=1).T
        ends = []
        for other in others:
            share = height[first] / (height[first] - height[other])
            way = self.vertices_um[other] - self.vertices_um[first]
            ends.append(self.vertices_um[first] + share[:, None] * way)
        return np.stack(ends, axis=1)

    def first_hit_um(self, origin_um: ArrayLike, direction: ArrayLike) -> float | None:
        """Return the distance in µm along a ray (unit direction) to the surface; None where it is missed.

        T. Möller and B. Trumbore, *Fast, minimum storage ray–triangle intersection*, J. Graphics Tools 2,
        1997.
        """
        ray = np.asarray(direction, dtype=np.float64)
        corner, second, third = (self.vertices_um[self.triangles[:, index]] for index in range(3))
        first_edge, second_edge = second - corner, third - corner
        across = np.cross(ray, second_edge)
        determinant = np.einsum("ij,ij->i", first_edge, across)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            offset = np.asarray(origin_um, dtype=np.float64) - corner
            u = np.einsum("ij,ij->i", offset, across) / determinant
            beside = np.cross(offset, first_edge)
            v = beside @ ray / determinant
            distance = np.einsum("ij,ij->i", second_edge, beside) / determinant
            # Rounding must not let a ray through along the edge between two triangles.
            met = (u >= -_ROUNDING) & (v >= -_ROUNDING) & (u + v <= 1 + _ROUNDING) & (distance > 0)
        return float(distance[met].min()) if met.any() else None


def box_mesh(box: Box, *, is_round: bool) -> Mesh:
    """Return a box's surface: a cylinder with elliptic faces if it is round, else the box itself."""
    unit = _unit_cylinder() if is_round else _unit_block()
    vertices_um = np.asarray(box.center_um) + (unit.vertices_um * np.asarray(box.size_um)) @ box.axes.T
    return Mesh(vertices_um, unit.triangles)


def tool_meshes(pose: ToolPose, tool: ToolSpecification) -> Mapping[str, Mesh]:
    """Return the surface of each link of the posed tool, by the link's name."""
    return {
        name: box_mesh(box, is_round=tool.link(name).is_round) for name, box in link_boxes(pose, tool).items()
    }


@lru_cache(maxsize=1)
def _unit_cylinder() -> Mesh:
    return _prism(
        [(math.cos(turn) / 2, math.sin(turn) / 2) for turn in np.arange(_SIDES) * 2 * np.pi / _SIDES]
    )


@lru_cache(maxsize=1)
def _unit_block() -> Mesh:
    return _prism([(0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)])


def _prism(profile: list[tuple[float, float]]) -> Mesh:
    """Return a prism of unit length along x over a convex profile in y and z that turns from y to z."""
    count = len(profile)
    rim = np.array(profile)
    vertices = np.concatenate(
        [np.column_stack([np.full(count, end), rim]) for end in (-0.5, 0.5)]
        + [np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]])]
    )
    here = np.arange(count)
    following = (here + 1) % count
    base_middle, tip_middle = np.full(count, 2 * count), np.full(count, 2 * count + 1)
    triangles = np.concatenate(
        [
            np.column_stack([here, following, following + count]),
            np.column_stack([here, following + count, here + count]),
            np.column_stack([base_middle, following, here]),
            np.column_stack([tip_middle, here + count, following + count]),
        ]
    )
    return Mesh(vertices, triangles)
