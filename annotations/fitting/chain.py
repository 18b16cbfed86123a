"""A tool as the arrays that its fit computes with: every body point is linear in the axes of the links."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.tool import Joint, ToolSpecification

Array = NDArray[np.float64]

_GRID_STEP_DEG = 30.0
_LARGEST_GRID = 400

LEVI_CIVITA: Array = np.zeros((3, 3, 3))
"""ε: (a × b)_i = ε_ijk a_j b_k."""
for _first, _second, _third in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    LEVI_CIVITA[_first, _second, _third] = 1.0
    LEVI_CIVITA[_first, _third, _second] = -1.0


def skew(vectors: Array) -> Array:
    """Return the matrices of the products with vectors of shape (..., 3): ``skew(a) @ b = a × b``."""
    flat: Array = vectors @ LEVI_CIVITA.transpose(1, 0, 2).reshape(3, 9)
    return flat.reshape(*vectors.shape, 3)


_UNIT: Array = np.eye(3)


@dataclass(frozen=True, eq=False)
class Chain:
    """The links that hang together with the root link, in an order in which parents come first.

    With A_k as the axes of link k in the root link's frame, a point of the body is Σ_k A_k c_k, whose
    coefficients c do not depend on the pose. Axes are kept *stacked*: an array of shape (3 K, 3) whose rows
    are the own x, y and z of one link after the other, so that points are one product of matrices.

    Attributes
    ----------
    links : tuple of str
        K names.
    joints : tuple of str
        J names, in the order of the tool.
    lengths_um : ndarray, shape (K,)
    limits_deg : ndarray, shape (J, 2)
    hinge_axes : ndarray, shape (J, 3)
        Unit vectors in the parents' own frames.
    parents, children : tuple of int
        The links that each joint connects.
    base_coefficients_um : ndarray, shape (K, K, 3)
        Of each link's base, about the middle of the root link.
    turned : ndarray of bool, shape (J, K)
        Which links a joint turns.
    """

    links: tuple[str, ...]
    joints: tuple[str, ...]
    lengths_um: Array
    limits_deg: Array
    hinge_axes: Array
    parents: tuple[int, ...]
    children: tuple[int, ...]
    base_coefficients_um: Array
    turned: NDArray[np.bool_]

    @classmethod
    def of(cls, tool: ToolSpecification) -> Self | None:
        """Return the chain of a tool; None where it has no links."""
        root = tool.root
        if root is None:
            return None
        joint_above: dict[str, Joint] = {}
        links = [root.name]
        for name in links:
            for joint in tool.joints:
                if joint.parent == name:
                    links.append(joint.child)
                    joint_above[joint.child] = joint
        place = {name: index for index, name in enumerate(links)}
        joints = [joint for joint in tool.joints if joint.parent in place]
        hinges = np.array([joint.hinge_axis for joint in joints]).reshape(-1, 3)
        coefficients = np.zeros((len(links), len(links), 3))
        coefficients[0, 0, 0] = -root.length_um / 2
        turned = np.zeros((len(joints), len(links)), dtype=bool)
        for index, name in enumerate(links[1:], start=1):
            above = joint_above[name]
            parent = place[above.parent]
            coefficients[index] = coefficients[parent]
            coefficients[index, parent, 0] += tool.link(above.parent).length_um + above.offsets_um[0]
            coefficients[index, index, 0] = above.offsets_um[1]
            turned[:, index] = turned[:, parent]
            turned[joints.index(above), index] = True
        return cls(
            links=tuple(links),
            joints=tuple(joint.name for joint in joints),
            lengths_um=np.array([tool.link(name).length_um for name in links]),
            limits_deg=np.array([joint.limits_deg for joint in joints], dtype=np.float64).reshape(-1, 2),
            hinge_axes=hinges / np.linalg.norm(hinges, axis=1, keepdims=True),
            parents=tuple(place[joint.parent] for joint in joints),
            children=tuple(place[joint.child] for joint in joints),
            base_coefficients_um=coefficients,
            turned=turned,
        )

    def coefficients_um(self, links: NDArray[np.int64], local_um: Array) -> Array:
        """Return the coefficients of points that links carry at ``local_um``, shape (n, 3 K)."""
        coefficients = self.base_coefficients_um[links]
        coefficients[np.arange(len(links)), links] += local_um
        return coefficients.reshape(len(links), -1)

    def length_shares(self, links: NDArray[np.int64], local_um: Array) -> Array:
        """Return by which share of each link's growth points on links move along that link, shape (n, K)."""
        shares = np.zeros((len(links), len(self.links)))
        for joint, parent in enumerate(self.parents):
            shares[self.turned[joint, links], parent] = 1.0
        shares[np.arange(len(links)), links] = local_um[:, 0] / self.lengths_um[links]
        return shares

    def stacked_axes(self, angles_rad: Array) -> Array:
        """Return the stacked axes for signed angles of shape (..., J), as an array of shape (..., 3 K, 3)."""
        before = angles_rad.shape[:-1]
        shares = np.ones((*before, len(self.joints), 1, 3))
        np.sin(angles_rad, out=shares[..., 0, 1])
        shares[..., 0, 2] -= np.cos(angles_rad)
        turns = (shares @ self._turning).reshape(*before, len(self.joints), 3, 3)
        stacked = np.empty((*before, 3 * len(self.links), 3))
        stacked[..., :3, :] = _UNIT
        for joint, parent, child in self._parents_first:
            stacked[..., child, :] = turns[..., joint, :, :] @ stacked[..., parent, :]
        return stacked

    def stacked_turning(self, stacked: Array, joints: list[int]) -> Array:
        """Return the derivatives of stacked axes by the angles of J' joints, shape (J', 3 K, 3)."""
        derivatives: Array = (stacked @ skew(self.hinges(stacked)[joints])) * self._turned_rows[joints]
        return derivatives

    def hinges(self, stacked: Array) -> Array:
        """Return the hinges' unit vectors in the root link's frame, shape (J, 3)."""
        axes = stacked.reshape(-1, 3, 3)[self._parents]
        hinges: Array = (self.hinge_axes[:, None, :] @ axes)[:, 0, :]
        return hinges

    def grid(self, joints: tuple[int, ...]) -> "Grid":
        """Return angles all over the limits of some joints, the others as near to straight as they may be."""
        if joints not in self._grids:
            self._grids[joints] = self._new_grid(joints)
        return self._grids[joints]

    @property
    def resting_rad(self) -> Array:
        """The angles nearest to straight that the limits allow, shape (J,)."""
        resting_rad: Array = np.radians(np.clip(0.0, self.limits_deg[:, 0], self.limits_deg[:, 1]))
        return resting_rad

    def _new_grid(self, joints: tuple[int, ...]) -> "Grid":
        limits_deg = self.limits_deg[list(joints)]
        counts = [math.ceil((high - low) / _GRID_STEP_DEG) + 1 for low, high in limits_deg]
        while math.prod(counts) > _LARGEST_GRID:
            counts[counts.index(max(counts))] -= 1
        steps = [
            np.radians(np.linspace(low, high, count))
            for (low, high), count in zip(limits_deg, counts, strict=True)
        ]
        places = np.arange(math.prod(counts)).reshape(counts)
        neighbours = []
        for axis in range(len(counts)):
            for end, padding in ((slice(None, -1), (1, 0)), (slice(1, None), (0, 1))):
                inner = places[(slice(None),) * axis + (end,)]
                widths = [(0, 0)] * len(counts)
                widths[axis] = padding
                neighbours.append(np.pad(inner, widths, mode="edge").ravel())
        angles_rad = np.tile(self.resting_rad, (places.size, 1))
        if joints:
            angles_rad[:, list(joints)] = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(
                -1, len(joints)
            )
        return Grid(
            angles_rad,
            self.stacked_axes(angles_rad),
            np.array(neighbours, dtype=np.int64).reshape(len(neighbours), places.size),
        )

    @cached_property
    def _turning(self) -> Array:
        """What 1, sin and 1 − cos of each angle are factors of in its turn, shape (J, 3, 9).

        O. Rodrigues' formula, transposed because the rows of a stack are axes.
        """
        cross = skew(self.hinge_axes)
        unit = np.broadcast_to(_UNIT, cross.shape)
        return np.stack([unit, -cross, cross @ cross], axis=1).reshape(-1, 3, 9)

    @cached_property
    def _turned_rows(self) -> Array:
        """−1 in the rows of a stack that a joint turns, shape (J, 3 K, 1): v @ skew(a) is −a × v."""
        return -np.repeat(self.turned, 3, axis=1)[:, :, None].astype(np.float64)

    @cached_property
    def _parents(self) -> NDArray[np.int64]:
        return np.array(self.parents, dtype=np.int64)

    @cached_property
    def _parents_first(self) -> tuple[tuple[int, slice, slice], ...]:
        """Each joint with the rows of its parent and child, so that a parent is placed before its child."""
        order = sorted(range(len(self.joints)), key=lambda joint: self.children[joint])
        return tuple(
            (
                joint,
                slice(3 * self.parents[joint], 3 * self.parents[joint] + 3),
                slice(3 * self.children[joint], 3 * self.children[joint] + 3),
            )
            for joint in order
        )

    @cached_property
    def _grids(self) -> dict[tuple[int, ...], "Grid"]:
        return {}


@dataclass(frozen=True, eq=False)
class Grid:
    """Angles all over the joints' limits, to begin from.

    Attributes
    ----------
    angles_rad : ndarray, shape (G, J)
    stacked : ndarray, shape (G, 3 K, 3)
        The axes of the links for each of them.
    neighbours : ndarray of int64, shape (N, G)
        Which angles lie next to each in each direction; itself at the ends.
    """

    angles_rad: Array
    stacked: Array
    neighbours: NDArray[np.int64]


@lru_cache(maxsize=16)
def chain_of(tool: ToolSpecification) -> Chain | None:
    """Return the chain of a tool, made once; None where it has no links."""
    return Chain.of(tool)
