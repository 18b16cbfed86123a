"""The tool as a body: one rounded shape a link, and where light from above first meets it.

Light travels along +z, the depth axis. Every shape is convex, so its signed distance along a ray is a
convex function, and Newton's steps from above never overshoot the surface.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry.kinematics import ToolPose, link_frames
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]

_EDGE_SHARE = 0.2
"""Radius of rounded edges, as a share of the smaller half of the cross-section."""
_TOLERANCE_UM = 1e-3
_LEAST_APPROACH = 1e-6
"""Cosine below which the light passes by: along the whole tool it would come nearer by 0.02 µm."""
_STEPS = 60
_SLACK_UM = 1.0
"""How far beside a body's outline light is still followed, so that rounding cuts nothing off."""


@dataclass(frozen=True, eq=False)
class Surface:
    """What the light meets first in each column along the depth axis.

    Attributes
    ----------
    depth_um : ndarray of float64, any shape
        Depth of the surface; infinite where the light meets nothing.
    facing : ndarray of float64, same shape
        Cosine between the surface's normal and the way back to the scanner, in [0, 1].
    """

    depth_um: Array
    facing: Array

    def __getitem__(self, plane: int) -> "Surface":
        return Surface(self.depth_um[plane], self.facing[plane])


class SolidBody(Protocol):
    """A body that light falls on."""

    def bounds_um(self) -> tuple[Array, Array]:
        """Return the lowest and the highest position in µm along each axis, shape (3,) each."""

    def first_hit(self, x_um: ArrayLike, y_um: ArrayLike) -> Surface:
        """Return where light along +z meets it in columns at x and y in µm, shapes (n,)."""


@dataclass(frozen=True, eq=False)
class LinkBody:
    """A link's shape: a cylinder or a block, as `Link.is_round` says; edges rounded.

    Attributes
    ----------
    center_um : ndarray, shape (3,)
        Middle of the link's axis.
    axes : ndarray, shape (3, 3)
        Columns are the link's own axes; +x runs along the link.
    half_size_um : ndarray, shape (3,)
        Half of its length, width and height.
    is_round : bool
    """

    center_um: Array
    axes: Array
    half_size_um: Array
    is_round: bool

    @property
    def edge_um(self) -> float:
        """Radius of the rounded edges."""
        return float(_EDGE_SHARE * self.half_size_um.min())

    def distance_um(self, positions_um: ArrayLike) -> Array:
        """Return the signed distance of positions in µm, shape (..., 3), from the surface.

        Exact on either side; negative inside.
        """
        local = (np.asarray(positions_um, dtype=np.float64) - self.center_um) @ self.axes
        beyond_core = np.linalg.norm(self._from_core(np.moveaxis(local, -1, 0)), axis=0)
        return np.asarray(beyond_core - self._inside_core(local) - self.edge_um)

    def bounds_um(self) -> tuple[Array, Array]:
        """Return the lowest and the highest position in µm along each axis, shape (3,) each.

        For a cylinder with the unit axis d these are ± (L/2 |dᵢ| + r √(1 − dᵢ²)) about its centre.
        """
        half = self.half_size_um
        if self.is_round:
            along = self.axes[:, 0]
            reach = half[0] * np.abs(along) + half[1] * np.sqrt(np.clip(1 - along**2, 0, None))
        else:
            reach = np.abs(self.axes) @ half
        return self.center_um - reach, self.center_um + reach

    def first_hit(self, x_um: ArrayLike, y_um: ArrayLike) -> Surface:
        """Return where light along +z meets this body in columns at x and y in µm, shapes (n,)."""
        low, high = self.bounds_um()
        top_um = low[2] - 1.0
        columns = np.column_stack([x_um, y_um, np.full(np.shape(x_um), top_um)])
        surface = Surface(np.full(len(columns), np.inf), np.zeros(len(columns)))
        active = np.flatnonzero(self._casts_on(columns[:, :2]))
        start = self.axes.T @ (columns[active] - self.center_um).T
        light = self.axes[2]
        travelled = np.zeros(len(active))
        for _ in range(_STEPS):
            gap = self._from_core(start + light[:, None] * travelled)
            length = np.linalg.norm(gap, axis=0)
            distance = length - self.edge_um
            approach = -(light @ gap) / np.maximum(length, _TOLERANCE_UM)
            met = distance <= _TOLERANCE_UM
            surface.depth_um[active[met]] = top_um + travelled[met]
            surface.facing[active[met]] = np.minimum(np.maximum(approach[met], 0), 1)
            # Once the distance no longer shrinks, a convex body has been missed.
            nearing = np.flatnonzero(~met & (approach > _LEAST_APPROACH))
            travelled = travelled[nearing] + distance[nearing] / approach[nearing]
            above = top_um + travelled <= high[2]
            nearing, travelled = nearing[above], travelled[above]
            active, start = active[nearing], start[:, nearing]
            if not active.size:
                break
        return surface

    def _casts_on(self, columns_um: Array) -> NDArray[np.bool_]:
        """Say which columns at x and y in µm, shape (n, 2), the box around this body covers; a little more.

        Seen from above a box is a polygon whose sides are its own axes: it lies between three pairs of lines.
        """
        sides = self.axes[:2] * self.half_size_um
        normals = np.stack([-sides[1], sides[0]], axis=1)
        reach = np.abs(normals @ sides).sum(axis=1)
        beside = np.abs((columns_um - self.center_um[:2]) @ normals.T)
        slack = _SLACK_UM * np.linalg.norm(normals, axis=1)
        return np.asarray((beside <= reach + slack).all(axis=1))

    def _inside_core(self, local: Array) -> Array:
        """Return how deep in the core points in the link's frame, (..., 3), lie: 0 outside of it."""
        core = self.half_size_um - self.edge_um
        if self.is_round:
            local = np.stack([local[..., 0], np.hypot(local[..., 1], local[..., 2])], axis=-1)
        return np.asarray(np.maximum((core[: local.shape[-1]] - np.abs(local)).min(axis=-1), 0))

    def _from_core(self, local: Array) -> Array:
        """Return the vectors from the nearest point of the core to points in the link's frame, (3, ...) each.

        The core is the shape less its rounding; the vectors are zero inside it.
        """
        core = self.half_size_um - self.edge_um
        if not self.is_round:
            half = core.reshape(3, *[1] * (local.ndim - 1))
            return np.asarray(np.sign(local) * np.maximum(np.abs(local) - half, 0))
        along, across, up = local
        radius = np.hypot(across, up)
        outside = np.maximum(radius - core[1], 0) / np.maximum(radius, _TOLERANCE_UM)
        axial = np.sign(along) * np.maximum(np.abs(along) - core[0], 0)
        return np.stack([axial, across * outside, up * outside])


def link_bodies(pose: ToolPose, tool: ToolSpecification) -> dict[str, LinkBody]:
    """Return the body of each link of the posed tool, by the link's name, in the volume's frame."""
    bodies = {}
    for name, frame in link_frames(pose, tool).items():
        link = tool.link(name)
        width, height = link.cross_section_um
        bodies[name] = LinkBody(
            center_um=frame.base_um + frame.axes[:, 0] * link.length_um / 2,
            axes=frame.axes,
            half_size_um=np.array([link.length_um, width, height]) / 2,
            is_round=link.is_round,
        )
    return bodies


def surface_from_above(bodies: Iterable[SolidBody], x_um: Array, y_um: Array) -> Surface:
    """Return what the light meets first in the columns over a grid.

    Parameters
    ----------
    bodies : iterable of SolidBody
    x_um, y_um : ndarray, shapes (nx,) and (ny,)
        Ascending positions of the columns.

    Returns
    -------
    Surface
        Of shape (nx, ny).
    """
    surface = Surface(np.full((len(x_um), len(y_um)), np.inf), np.zeros((len(x_um), len(y_um))))
    for body in bodies:
        low, high = body.bounds_um()
        block = (
            slice(*np.searchsorted(x_um, (low[0], high[0]))),
            slice(*np.searchsorted(y_um, (low[1], high[1]))),
        )
        depth, facing = surface.depth_um[block], surface.facing[block]
        x, y = np.meshgrid(x_um[block[0]], y_um[block[1]], indexing="ij")
        hit = body.first_hit(x.ravel(), y.ravel())
        nearer = hit.depth_um.reshape(depth.shape) < depth
        depth[nearer] = hit.depth_um.reshape(depth.shape)[nearer]
        facing[nearer] = hit.facing.reshape(depth.shape)[nearer]
    return surface
