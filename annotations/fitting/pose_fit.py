"""The pose of a tool that fits a document best, how sure it is, and what the data leave open."""

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from annotations.documents.annotation import Annotation
from annotations.fitting.chain import Array, Chain, chain_of
from annotations.fitting.chain_solver import ChainSolver, Solution
from annotations.fitting.evidence import SIGMA_UM, BodyPoint, document_points
from annotations.fitting.open_questions import OpenQuestion, open_questions
from annotations.geometry import rotations
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification

AS_WELL = 9.0
"""A pose whose χ² is larger by less than this, three standard deviations, explains the data as well."""

_OPEN_DEG = 20.0
"""A direction in which the pose may turn farther than this, as a standard deviation, is open."""
_UM_PER_DEG = 100.0
"""What a degree is worth where positions and angles are mixed: the move of a point 6 mm from the hinge."""
_SHARE_OF_OPEN = 0.1
_DISTINCT_SIGMAS = 4.0
_DISTINCT_DEG = 2.0
_ROLL = "rotation_x_deg"


@dataclass(frozen=True, eq=False)
class ToolFit:
    """The pose of least weighted squares within the joints' limits.

    Attributes
    ----------
    pose : ToolPose
        Where data leave something open, one of the poses that they allow.
    keypoints_um : mapping of str to (float, float, float)
        Where that pose puts each keypoint at the end of a link, in µm.
    residuals_um : mapping of str to float
        Distance in µm of each keypoint that was evidence from where the pose puts it; of a keypoint that two
        boxes share, the larger one.
    rms_um : float
        Root of the mean of their squares.
    chi_square : float
        Sum of the squared residuals in standard deviations, along three axes of each point.
    degrees_of_freedom : int
        What `chi_square` is to be compared with: residuals less what they determine.
    parameters : tuple of str
        What the data determine, in the order of the covariance: of ``x_um``, ``y_um``, ``z_um`` (middle of
        the root link's axis, in the volume's frame), ``rotation_x_deg``, ``rotation_y_deg``,
        ``rotation_z_deg`` (a rotation vector about the root link's own axes, so that the first is the roll)
        and ``<joint>_deg``.
    open_parameters : tuple of str
        Those of them that the data do not determine; they have no variance.
    covariance : ndarray of float64, shape (p, p)
        Of `parameters`, in their units, if nothing keeps a joint within its limits.
    alternatives : tuple of ToolPose
        Other legal poses that explain the data as well, to within noise.
    open_questions : tuple of OpenQuestion
        What the data leave open, in words.
    limits_reached : tuple of str
        Joints that would go beyond a limit if they could.
    """

    pose: ToolPose
    keypoints_um: Mapping[str, Vector]
    residuals_um: Mapping[str, float]
    rms_um: float
    chi_square: float
    degrees_of_freedom: int
    parameters: tuple[str, ...]
    open_parameters: tuple[str, ...]
    covariance: Array
    alternatives: tuple[ToolPose, ...]
    open_questions: tuple[OpenQuestion, ...]
    limits_reached: tuple[str, ...]

    @property
    def standard_deviations(self) -> Mapping[str, float]:
        """Standard deviation of each of the determined parameters, in the unit that its name ends with."""
        deviations = np.sqrt(np.diag(self.covariance))
        return {name: float(value) for name, value in zip(self.parameters, deviations, strict=True)}


def prepare_fitting() -> None:
    """Import what the first fit would import otherwise, a third of a second: from a thread, ahead of need."""
    importlib.import_module("scipy.optimize")


def fit_document(
    document: Annotation,
    tool: ToolSpecification,
    sigma_um: float = SIGMA_UM,
    start: ToolPose | None = None,
) -> ToolFit | None:
    """Fit the tool to what a document of either method says; see `document_points` and `fit_points`."""
    return fit_points(document_points(document, tool, sigma_um), tool, start)


def fit_points(
    points: Sequence[BodyPoint], tool: ToolSpecification, start: ToolPose | None = None
) -> ToolFit | None:
    """Fit the tool to points on its links.

    Parameters
    ----------
    points : sequence of BodyPoint
        Those on links that do not hang together with the root link count for nothing.
    start : ToolPose, optional
        A pose to try first. Of poses that fit equally well, the one that is found from it is returned.

    Returns
    -------
    ToolFit or None
        None where the points do not tell the direction of any link.
    """
    chain = chain_of(tool)
    points = [] if chain is None else [point for point in points if point.link in chain.links]
    if chain is None or len({point.position_um for point in points}) < 2:
        return None
    solver = ChainSolver(chain, points)
    starts = [] if start is None else [_start(chain, start)]
    best, *others = solver.solutions(starts)
    resting_rad = chain.resting_rad if start is None else starts[0][1]
    known = _Determined.at(best, solver)
    if not known.tells_a_direction:
        return None
    pose = _pose(best, solver, resting_rad)
    rivals = [other for other in others if other.chi_square - best.chi_square < AS_WELL]
    if any(known.is_another_roll(other, best) for other in rivals):
        known = known.without_roll()
    alternatives: list[Solution] = []
    for other in rivals:
        if all(known.is_distinct(other, each) for each in [best, *alternatives]):
            alternatives.append(other)
    alternative_poses = tuple(_pose(other, solver, resting_rad) for other in alternatives)
    unseen = {name for joint, name in enumerate(chain.joints) if joint not in solver.joints}
    residuals_um = _residuals_um(points, best, solver)
    return ToolFit(
        pose=pose,
        keypoints_um=keypoints_um(pose, tool),
        residuals_um=residuals_um,
        rms_um=float(np.sqrt(np.mean(np.square(list(residuals_um.values()))))) if residuals_um else 0.0,
        chi_square=best.chi_square,
        degrees_of_freedom=3 * len(points) - known.rank + len(best.on_limits),
        parameters=known.parameters,
        open_parameters=(*known.open_parameters, *(f"{name}_deg" for name in chain.joints if name in unseen)),
        covariance=known.covariance,
        alternatives=alternative_poses,
        open_questions=open_questions(tool, pose, alternative_poses, set(known.open_parameters), unseen),
        limits_reached=tuple(chain.joints[joint] for joint in sorted(best.on_limits)),
    )


@dataclass(frozen=True, eq=False)
class _Determined:
    """What the data determine about a solution: parameters of seen joints only, in µm and degrees."""

    parameters: tuple[str, ...]
    open_parameters: tuple[str, ...]
    covariance: Array
    rank: int
    tells_a_direction: bool
    joints: tuple[int, ...]
    deviations_deg: Array

    @classmethod
    def at(cls, solution: Solution, solver: ChainSolver) -> "_Determined":
        chain, joints = solver.chain, solver.joints
        count = 6 + len(joints)
        # One unit of each is a degree, or what a degree is worth.
        units = np.concatenate([np.full(3, _UM_PER_DEG), np.full(count - 3, np.radians(1.0))])
        jacobian = solver.jacobian(solution)[:, :count] * units
        information, directions = np.linalg.eigh(jacobian.T @ jacobian)
        is_open = information < _OPEN_DEG**-2
        # Open directions count with their least variance, for those parameters that they hardly touch.
        variances = np.where(is_open, _OPEN_DEG**2, 1 / np.where(is_open, 1.0, information))
        # Positions to the volume's frame; rotations stay about the root link's own axes.
        directions_there = directions.copy()
        directions_there[:3] = solution.axes @ directions[:3]
        shares = np.linalg.norm(directions_there[:, is_open], axis=1)
        keep = shares < _SHARE_OF_OPEN
        scale = np.concatenate([units[:3], np.ones(count - 3)])
        scaled = (directions_there * scale[:, None])[keep]
        names = np.array(
            ["x_um", "y_um", "z_um", _ROLL, "rotation_y_deg", "rotation_z_deg"]
            + [f"{chain.joints[joint]}_deg" for joint in joints]
        )
        covariance = (scaled * variances) @ scaled.T
        deviations_deg = np.where(keep, 0.0, np.inf)
        deviations_deg[keep] = np.sqrt(np.diag(covariance))
        return cls(
            parameters=tuple(names[keep].tolist()),
            open_parameters=tuple(names[~keep].tolist()),
            covariance=covariance,
            rank=int(count - is_open.sum()),
            tells_a_direction=not is_open.any()
            or _tells_a_direction(solution, solver, directions[3:, is_open]),
            joints=tuple(joints),
            deviations_deg=deviations_deg[3:],
        )

    def without_roll(self) -> "_Determined":
        """Return the same with the roll left open."""
        if _ROLL not in self.parameters:
            return self
        place = self.parameters.index(_ROLL)
        covariance = np.delete(np.delete(self.covariance, place, axis=0), place, axis=1)
        return replace(
            self,
            parameters=tuple(name for name in self.parameters if name != _ROLL),
            open_parameters=(_ROLL, *self.open_parameters),
            covariance=covariance,
            deviations_deg=np.concatenate([[np.inf], self.deviations_deg[1:]]),
        )

    def is_another_roll(self, first: Solution, second: Solution) -> bool:
        """Say whether two solutions differ in their roll alone: what bend there is, is within noise."""
        return bool((self._differs(first, second) == np.eye(1, len(self.deviations_deg), dtype=bool)).all())

    def is_distinct(self, first: Solution, second: Solution) -> bool:
        """Say whether two solutions differ by more than noise in what the data determine."""
        return bool(self._differs(first, second).any())

    def _differs(self, first: Solution, second: Solution) -> NDArray[np.bool_]:
        """Say of roll, tilt about y and z, and angles, whether they differ by more than noise."""
        joints = list(self.joints)
        bends_deg = np.degrees(first.angles_rad - second.angles_rad)[joints]
        # Of a joint that turns all the way round, both limits are one place.
        bends_deg -= 360 * np.round(bends_deg / 360)
        turn = first.axes.T @ second.axes
        # The turn as a roll about own x, and then the shortest turn of x.
        roll_deg = np.degrees(np.arctan2(turn[2, 1] - turn[1, 2], turn[1, 1] + turn[2, 2]))
        tilt_deg = np.degrees(np.arctan2(np.hypot(turn[1, 0], turn[2, 0]), turn[0, 0]))
        if np.isinf(self.deviations_deg[1:3]).any():
            # Without a direction of the root link there is nothing to compare its roll and tilt by.
            roll_deg = tilt_deg = 0.0
        differences_deg = np.abs(np.concatenate([[roll_deg, tilt_deg, tilt_deg], bends_deg]))
        least_deg = np.maximum(_DISTINCT_DEG, _DISTINCT_SIGMAS * self.deviations_deg)
        differs: NDArray[np.bool_] = differences_deg > least_deg
        return differs


def _tells_a_direction(solution: Solution, solver: ChainSolver, open_turns: Array) -> bool:
    """Say whether the axis of any link stays, though the pose moves in each open direction.

    Parameters
    ----------
    open_turns : ndarray, shape (3 + J', o)
        The rotation about the root link's own axes, and the angles of the seen joints, in each direction.
    """
    chain = solver.chain
    stacked = chain.stacked_axes(solution.angles_rad)
    hinges = chain.hinges(stacked)[solver.joints]
    for link, axis in enumerate(stacked[::3]):
        above = chain.turned[solver.joints, link]
        turns = open_turns[:3] + hinges[above].T @ open_turns[3:][above]
        if np.abs(np.cross(turns.T, axis)).max() < _SHARE_OF_OPEN:
            return True
    return False


def _start(chain: Chain, pose: ToolPose) -> tuple[Array, Array]:
    angles_deg = np.array([pose.angles_deg.get(name, 0.0) for name in chain.joints])
    within_deg = np.clip(angles_deg, chain.limits_deg[:, 0], chain.limits_deg[:, 1])
    return rotations.matrix(pose.rotation_wxyz), np.radians(within_deg)


def _pose(solution: Solution, solver: ChainSolver, resting_rad: Array) -> ToolPose:
    angles_rad = resting_rad.copy()
    angles_rad[solver.joints] = solution.angles_rad[solver.joints]
    # Clipped, for the rounding of radians may lead beyond a limit.
    low_deg, high_deg = solver.chain.limits_deg.T
    angles_deg = np.clip(np.degrees(angles_rad), low_deg, high_deg)
    return ToolPose(
        vector(solver.position_um(solution)),
        rotations.from_matrix(solution.axes),
        dict(zip(solver.chain.joints, angles_deg.tolist(), strict=True)),
    )


def _residuals_um(
    points: Sequence[BodyPoint], solution: Solution, solver: ChainSolver
) -> Mapping[str, float]:
    gaps = solver.seen @ solution.axes - solver.body @ solver.chain.stacked_axes(solution.angles_rad)
    distances_um = np.linalg.norm(gaps / solver.weights, axis=1)
    residuals_um: dict[str, float] = {}
    for point, distance_um in zip(points, distances_um.tolist(), strict=True):
        if point.keypoint:
            residuals_um[point.keypoint] = max(distance_um, residuals_um.get(point.keypoint, 0.0))
    return residuals_um
