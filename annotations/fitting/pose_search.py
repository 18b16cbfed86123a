"""The poses around a given one, and which of them lays the tool on samples of a surface.

Everything here is in the frame of the samples, whose last axis is depth.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from annotations.fitting.robust_sigma import robust_sigma
from annotations.fitting.surface_samples import SurfaceSamples
from annotations.geometry import rotations
from annotations.geometry.body import LinkBody, link_bodies
from annotations.geometry.frames import vector
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]

LARGEST_SHIFT_UM, LARGEST_TURN_DEG, LARGEST_BEND_DEG = 1000.0, 8.0, 12.0
"""How far the root link may be shifted along each of its axes and turned about it, and each joint bent."""

LEAST_SAMPLES = 15
"""With fewer samples nothing is changed."""

_PLACED_UM, _TURNED_DEG, _BENT_DEG = 150.0, 3.0, 4.0
"""Standard deviations of a pose as a person placed it: they decide what a volume leaves open, and no more."""
_INDEPENDENT = 500
"""Most samples that count as independent: a real surface departs from an ideal one over whole patches."""
_LEAST_SIGMA_UM = 20.0
_MOST_STEPS = 8
_LEAST_CHANGE, _SMALL_CHANGE, _AT_END = 0.01, 1e-3, 1e-3
"""In standard deviations: with a smaller step it is done; the step by which slopes are measured; and what is
no distance from the end of the range."""


@dataclass(frozen=True, eq=False)
class PoseSearch:
    """A pose to begin from, within the joints' limits, and the changes of it that are tried.

    A change is an array of shape (6 + J,) in standard deviations of a person's placing: the shift of the root
    link along its own axes, its turn about them, and the bend of each of the tool's joints.

    Attributes
    ----------
    start : ToolPose
    tool : ToolSpecification
    """

    start: ToolPose
    tool: ToolSpecification

    @classmethod
    def about(cls, pose: ToolPose, tool: ToolSpecification) -> Self:
        """Begin from a pose, or from the nearest that the joints' limits allow."""
        angles_deg = {
            joint.name: float(np.clip(pose.angles_deg.get(joint.name, 0.0), *joint.limits_deg))
            for joint in tool.joints
        }
        return cls(replace(pose, angles_deg=angles_deg), tool)

    @property
    def unchanged(self) -> Array:
        """The change that is none."""
        return np.zeros(6 + len(self.tool.joints))

    @property
    def _spreads(self) -> Array:
        return np.array([_PLACED_UM] * 3 + [_TURNED_DEG] * 3 + [_BENT_DEG] * len(self.tool.joints))

    @property
    def _range(self) -> Array:
        bends_deg = [LARGEST_BEND_DEG] * len(self.tool.joints)
        return np.array([LARGEST_SHIFT_UM] * 3 + [LARGEST_TURN_DEG] * 3 + bends_deg) / self._spreads

    @property
    def limits(self) -> tuple[Array, Array]:
        """The least and the largest change."""
        angles_deg = np.array([self.start.angles_deg[joint.name] for joint in self.tool.joints])
        joints_deg = np.array([joint.limits_deg for joint in self.tool.joints]).reshape(-1, 2)
        to_limits = (joints_deg - angles_deg[:, np.newaxis]) / self._spreads[6:, np.newaxis]
        low, high = -self._range, self._range
        low[6:] = np.maximum(to_limits[:, 0], low[6:])
        high[6:] = np.minimum(to_limits[:, 1], high[6:])
        return low, high

    def has_ended(self, change: Array) -> bool:
        """Say whether a change goes as far as any may; a joint at its own limit is a pose like any other."""
        return bool(np.any(np.abs(change) > self._range - _AT_END))

    def pose(self, change: Array) -> ToolPose:
        """Return the pose after a change."""
        shift_um, turn_deg, bends_deg = np.split(change * self._spreads, [3, 6])
        size_deg = float(np.linalg.norm(turn_deg))
        turn = rotations.about_axis(turn_deg, size_deg) if size_deg else (1.0, 0.0, 0.0, 0.0)
        position_um = self.start.position_um + rotations.matrix(self.start.rotation_wxyz) @ shift_um
        angles_deg = {
            joint.name: self.start.angles_deg[joint.name] + float(bend_deg)
            for joint, bend_deg in zip(self.tool.joints, bends_deg, strict=True)
        }
        return ToolPose(vector(position_um), rotations.product(self.start.rotation_wxyz, turn), angles_deg)

    def bodies(self, change: Array) -> dict[str, LinkBody]:
        """Return the body of each link after a change, by the link's name."""
        return link_bodies(self.pose(change), self.tool)

    def distances_um(self, change: Array, positions_um: Array) -> Array:
        """Return the signed distance in µm of positions, shape (n, 3), from the tool after a change."""
        distances_um = [body.distance_um(positions_um) for body in self.bodies(change).values()]
        return np.asarray(np.min(distances_um, axis=0))

    def near(self, change: Array, samples: SurfaceSamples, reach_um: float) -> Array:
        """Return the positions in µm of the surfaces that lie within a reach of the tool after a change."""
        positions_um = samples.positions_um
        return positions_um[np.abs(self.distances_um(change, positions_um)) < reach_um]

    def without(self, links: Collection[str], change: Array, samples: SurfaceSamples) -> SurfaceSamples:
        """Return the samples as if those nearest to some links after a change had not been found."""
        bodies = self.bodies(change)
        distances_um = [np.abs(body.distance_um(samples.positions_um)) for body in bodies.values()]
        nearest = np.argmin(distances_um, axis=0)
        depth_um = samples.depth_um.copy()
        lost = np.isin(nearest, [row for row, name in enumerate(bodies) if name in links])
        depth_um[np.flatnonzero(samples.found)[lost]] = np.inf
        return replace(samples, depth_um=depth_um)

    def lowered(self, samples: SurfaceSamples, reach_um: float) -> Array:
        """Return the change along the light that brings the tool's upper side to the middle of the samples.

        Of a thin tool that was placed too high, samples would otherwise be drawn to its lower side.
        """
        positions_um = samples.positions_um
        hits = [body.first_hit(*positions_um[:, :2].T) for body in self.bodies(self.unchanged).values()]
        gaps_um = positions_um[:, 2] - np.min([hit.depth_um for hit in hits], axis=0)
        gaps_um = gaps_um[np.abs(gaps_um) < 2 * reach_um]
        change = self.unchanged
        if len(gaps_um) >= LEAST_SAMPLES:
            change[:3] = rotations.matrix(self.start.rotation_wxyz)[2] * np.median(gaps_um)
        return np.clip(change / self._spreads, *self.limits)

    def improved(self, change: Array, samples: SurfaceSamples, reach_um: float) -> tuple[Array, Array]:
        """Return a better change, and which share of each one's variance the samples leave, shape (6 + J,).

        Least squares of the distances of the samples within a reach, weighted by J. W. Tukey's biweight
        (P. J. Huber, *Robust Statistics*, 1981), and of the change itself, by C. F. Gauss' steps within the
        limits. Too few samples change nothing, and leave everything.
        """
        from scipy.optimize import lsq_linear  # late: it takes 0.3 s, and few sessions refine

        left = np.ones(len(change))
        low, high = self.limits
        for _ in range(_MOST_STEPS):
            positions_um = self.near(change, samples, reach_um)
            if len(positions_um) < LEAST_SAMPLES:
                break
            distances_um = self.distances_um(change, positions_um)
            weights = _weights(distances_um, reach_um)
            slopes = self._slopes(change, positions_um, distances_um)
            # The prior's information is one in each direction, for changes are in its standard deviations.
            information = np.einsum("i,ij,ik", weights, slopes, slopes) + np.eye(len(change))
            downhill = -np.einsum("i,ij,i", weights, slopes, distances_um) - change
            root = np.linalg.cholesky(information)
            step = lsq_linear(root.T, np.linalg.solve(root, downhill), bounds=(low - change, high - change)).x
            change = np.clip(change + step, low, high)
            left = np.diag(np.linalg.inv(information))
            if np.abs(step).max() < _LEAST_CHANGE:
                break
        return change, left

    def _slopes(self, change: Array, positions_um: Array, distances_um: Array) -> Array:
        """Return how the distances in µm grow with each change, shape (n, 6 + J)."""
        moved = change + _SMALL_CHANGE * np.eye(len(change))
        return np.column_stack(
            [(self.distances_um(each, positions_um) - distances_um) / _SMALL_CHANGE for each in moved]
        )


def _weights(distances_um: Array, reach_um: float) -> Array:
    """Return the inverse variances of samples, less the further they are from the tool.

    The biweight ends at the reach rather than at some multiple of the spread: where the long links lie right,
    the spread is small, and all of a short one that does not would be cast out.
    """
    biweights = np.square(1 - np.square(distances_um / reach_um))
    sigma_um = max(robust_sigma(distances_um), _LEAST_SIGMA_UM)
    return np.asarray(biweights * min(1, _INDEPENDENT / len(distances_um)) / sigma_um**2)
