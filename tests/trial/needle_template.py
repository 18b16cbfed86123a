"""The needle's surface put together from many volumes, and how it lies in each: the needle is rigid."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tests.trial.needle_surface import Points, farthest_um

_ITERATIONS = 40
_REACHES_UM = (200.0, 120.0)
"""Points farther from the template than this do not count; less and less, as the needle falls into place."""
_ROBUST_UM = 20.0
_ALONG = 0.2
"""What distances along the surface count. Without them the needle, long and smooth, slides; with more of them
it stays where it is."""
_WALL_UM = 150.0
_END_POINTS = 3
_NEIGHBOURS = 12
_GRID_UM = 40.0
_CLOSE_DEG = 0.002
_CLOSE_UM = 0.05


@dataclass(frozen=True)
class Placement:
    """How the template lies in a volume.

    Attributes
    ----------
    rotation : Rotation
    offset_um : ndarray, shape (3,)
        Where the template's origin, near its tip, lies in the volume's frame.
    residual_um : float
        Root mean square of the distances from the surface that count.
    share : float
        Of the volume's surface points that count.
    """

    rotation: Rotation
    offset_um: Points
    residual_um: float = np.inf
    share: float = 0.0

    def to_volume_um(self, points_um: Points) -> Points:
        """Return where points of the template lie in the volume."""
        return np.asarray(self.rotation.apply(points_um) + self.offset_um)

    def to_template_um(self, points_um: Points) -> Points:
        """Return which points of the template lie at points of the volume."""
        return np.asarray(self.rotation.inv().apply(points_um - self.offset_um))


class Template:
    """Points of the needle's surface with their normals, in a frame whose origin is near the tip.

    Parameters
    ----------
    points_um : ndarray, shape (n, 3)
    """

    def __init__(self, points_um: Points) -> None:
        self.points_um = points_um
        self._tree = cKDTree(points_um)
        _, near = self._tree.query(points_um, k=_NEIGHBOURS)
        patches = points_um[near] - points_um[near].mean(1, keepdims=True)
        self.normals: NDArray[np.float64] = np.linalg.svd(patches, full_matrices=False)[2][:, -1]

    def placed(self, surface_um: Points, start: Placement) -> Placement:
        """Return how the template lies on a volume's surface, near a start.

        Distances to the planes at the nearest points are made small, as by Y. Chen and G. Medioni, *Object
        modelling by registration of multiple range images*, Image and Vision Computing 10, 1992.
        """
        placement = start
        for reach_um in _REACHES_UM:
            for _ in range(_ITERATIONS):
                placement, step_deg, step_um = self._closer(surface_um, placement, reach_um)
                if step_deg < _CLOSE_DEG and step_um < _CLOSE_UM:
                    break
        return placement

    def _closer(
        self, surface_um: Points, placement: Placement, reach_um: float
    ) -> tuple[Placement, float, float]:
        own_um = placement.to_template_um(surface_um)
        distances, nearest = self._tree.query(own_um, distance_upper_bound=reach_um)
        counts = np.isfinite(distances)
        if np.count_nonzero(counts) < 30:
            return Placement(placement.rotation, placement.offset_um), 0.0, 0.0
        own_um, nearest = own_um[counts], nearest[counts]
        normals = self.normals[nearest]
        off_um = own_um - self.points_um[nearest]
        across_um = np.einsum("ij,ij->i", normals, off_um)
        weights = 1 / (1 + (across_um / _ROBUST_UM) ** 2)
        # How a step moves each point along each axis, in mm, so that turns and shifts are of one size.
        turned = np.cross(np.eye(3)[:, None], own_um / 1000).transpose(1, 2, 0)
        moves = np.concatenate([turned, np.tile(np.eye(3), (len(own_um), 1, 1))], axis=2)
        slopes = np.einsum("ij,ijk->ik", normals, moves)
        matrix = slopes.T @ (slopes * weights[:, None])
        matrix += _ALONG * np.einsum("i,ijk,ijl->kl", weights, moves, moves)
        wanted = slopes.T @ (weights * across_um) + _ALONG * np.einsum("i,ijk,ij->k", weights, moves, off_um)
        step = np.linalg.solve(matrix, -wanted)
        turn = Rotation.from_rotvec(step[:3] / 1000)
        # own' = turn(own) + shift, so that volume → template becomes turn ∘ (volume → template) + shift.
        rotation = placement.rotation * turn.inv()
        offset_um = placement.offset_um - rotation.apply(step[3:])
        residual_um, share = float(np.sqrt(np.mean(across_um**2))), len(own_um) / len(counts)
        found = Placement(rotation, offset_um, residual_um, share)
        return found, float(np.degrees(turn.magnitude())), float(np.linalg.norm(step[3:]))


def started(surface_um: Points, direction: Points) -> Placement:
    """Return a first idea of how the needle lies: turned as all are on the whole, its tip at the far end."""
    return Placement(Rotation.identity(), farthest_um(surface_um, direction))


def made_template(surfaces_um: Sequence[Points], direction: Points, *, rounds: int = 3) -> Template:
    """Return the surface that all volumes have in common; the origin is near its far end along the direction.

    The first volume is laid under the others, then what they make together, thinned.
    """
    starts = [started(surface_um, direction) for surface_um in surfaces_um]
    placements = starts[:1]
    template = Template(starts[0].to_template_um(surfaces_um[0]))
    for _ in range(rounds):
        placements = [
            template.placed(surface_um, start) for surface_um, start in zip(surfaces_um, starts, strict=True)
        ]
        together = np.concatenate(
            [each.to_template_um(surface) for each, surface in zip(placements, surfaces_um, strict=True)]
        )
        template = Template(_thinned(together, at_least=max(2, len(surfaces_um) // 10)))
        starts = placements
    return Template(template.points_um - farthest_um(template.points_um, direction))


def _thinned(points_um: Points, at_least: int) -> Points:
    """Return the mean of the points in each cell of a grid that holds some."""
    cells = np.floor(points_um / _GRID_UM).astype(np.int64)
    _, cell, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), 3))
    np.add.at(sums, cell.ravel(), points_um)
    return np.asarray((sums / counts[:, None])[counts >= at_least])


def end_um(
    template: Template, placements: Sequence[Placement], surfaces_um: Sequence[Points], direction: Points
) -> Points:
    """Return the very end of the needle in the template's frame, shape (3,).

    Its place across is that of the template's last points; its place along is where the farthest bright point
    of a volume is, in the median over the volumes: what few of them show is not in the template.
    """
    last_um = farthest_um(template.points_um, direction, count=_END_POINTS)
    reaches_um = [
        float((one.to_template_um(surface) @ direction).max())
        for one, surface in zip(placements, surfaces_um, strict=True)
    ]
    return np.asarray(last_um + (np.median(reaches_um) - last_um @ direction) * direction)


def shaft_um(template: Template, tip_um: Points, direction: Points, length_um: float) -> Points:
    """Return the middle between the needle's walls in the template's frame, so far behind the tip."""
    points_um = template.points_um - tip_um
    walls = points_um[np.abs(points_um @ direction + length_um) < _WALL_UM]
    across = walls - np.outer(walls @ direction, direction)
    axes = np.linalg.svd(across - across.mean(0), full_matrices=False)[2][:2]
    places = across @ axes.T
    away_um = (places.min(0) + places.max(0)) / 2 @ axes - length_um * direction
    return np.asarray(tip_um + away_um * length_um / np.linalg.norm(away_um))
