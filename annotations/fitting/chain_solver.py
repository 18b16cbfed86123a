"""The pose of least weighted squares: looked for all over a grid first, then polished by Levenberg–Marquardt.

For given angles a rotation and a position of least squares have a closed form, as long as each point's weight
is the same in every direction (W. Kabsch, *A solution for the best rotation to relate two sets of vectors*,
Acta Cryst. A32, 1976), so that the whole range of the angles is looked over at once. The best places are
polished by MINPACK's ``lmder`` with the Jacobian in closed form, in rotation, angles and, where they are
free, lengths. The position drops out, because residuals are taken about weighted means.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from annotations.fitting.chain import LEVI_CIVITA, Array, Chain
from annotations.fitting.evidence import BodyPoint

_MOST_STARTS = 2
_TOLERANCE = 1e-6
_MANY_CALLS = 200
_FEW_CALLS = 5
_CALLS_USED_UP = 5
"""MINPACK's word for it."""
_HOPELESS = 100.0
_SAME_RAD = math.radians(2.0)
ON_A_LIMIT_RAD = 1e-9
"""No farther beyond a limit than this, an angle stands at it."""

# Rows (b) and columns (c, a): a vector u gives the derivatives of u × ω, laid out as MINPACK wants them.
_TURNS_BY: Array = np.ascontiguousarray(LEVI_CIVITA.transpose(1, 2, 0).reshape(3, 9))


@dataclass(frozen=True, eq=False)
class Solution:
    """A local minimum.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
        Columns are the root link's own axes in the volume's frame.
    angles_rad : ndarray, shape (J,)
    stretch_um : ndarray, shape (K,)
        By how much each link is longer than nominal; zeros where lengths are not free.
    chi_square : float
        Sum of squares in standard deviations, those of lengths included.
    on_limits : frozenset of int
        Joints that are held at a limit.
    """

    axes: Array
    angles_rad: Array
    stretch_um: Array
    chi_square: float
    on_limits: frozenset[int]


class ChainSolver:
    """Least squares of one set of body points over the poses of a chain.

    Parameters
    ----------
    chain : Chain
    points : sequence of BodyPoint
        On links of the chain, two at least.
    length_sigma_um : ndarray, shape (K,), optional
        Standard deviation of each link's length from nominal; without it, all are as nominal.
    is_limited : bool
        Whether the joints' limits hold.
    """

    def __init__(
        self,
        chain: Chain,
        points: Sequence[BodyPoint],
        length_sigma_um: Array | None = None,
        *,
        is_limited: bool = True,
    ) -> None:
        self.chain = chain
        self.length_sigma_um = length_sigma_um
        self._is_limited = is_limited
        self._limits_rad = np.radians(chain.limits_deg)
        links = np.array([chain.links.index(point.link) for point in points])
        local_um = np.array([point.local_um for point in points])
        self.joints = [int(joint) for joint in np.flatnonzero(chain.turned[:, links].any(axis=1))]
        """The joints that turn a link with a point: only their angles can be told."""
        self.weights: Array = 1.0 / np.array([[point.sigma_um] for point in points])
        self.coefficients_um = chain.coefficients_um(links, local_um)
        self.length_shares = chain.length_shares(links, local_um)
        shares = np.square(self.weights[:, 0])
        shares /= shares.sum()
        seen_um = np.array([point.position_um for point in points])
        self._seen_mean_um = shares @ seen_um
        self._mean_coefficients_um = shares @ self.coefficients_um
        # About the weighted means, and in standard deviations.
        self.seen = self.weights * (seen_um - self._seen_mean_um)
        self.body = self.weights * (self.coefficients_um - self._mean_coefficients_um)
        self.stretching = self.weights * (self.length_shares - shares @ self.length_shares)
        self._seen_square = float(np.vdot(self.seen, self.seen))
        self._cross = self.seen.T @ self.body

    def solutions(
        self, starts: Sequence[tuple[Array, Array]] = (), *, most: int = _MOST_STARTS
    ) -> list[Solution]:
        """Return the local minima that were found, the best one first; some may stand more than once.

        Parameters
        ----------
        starts : sequence of (axes, angles_rad)
            Where to begin besides the grid; of equally good minima the first of these leads.
        most : int
            In how many places of the grid to begin.
        """
        found: list[Solution] = []
        for axes, angles_rad in [*starts, *self._grid_starts(most)]:
            found.append(self._polished(axes, angles_rad, found))
        if self.joints:
            # The same bend by hinges of the other sense: too near for the grid where the bend is small.
            opposite_rad = -min(found, key=_rounded).angles_rad
            mirrored_rad = self._within_limits(opposite_rad)
            if all(np.abs(each.angles_rad - mirrored_rad).max() > _SAME_RAD for each in found):
                held = frozenset(int(joint) for joint in np.flatnonzero(mirrored_rad != opposite_rad))
                axes = self._best_axes(self.chain.stacked_axes(mirrored_rad))
                found.append(self._polished(axes, mirrored_rad, found, held))
        return sorted(found, key=_rounded)

    def next_to(self, solution: Solution) -> Solution:
        """Return the minimum next to a solution of another solver with the same chain."""
        return self._polished(solution.axes, solution.angles_rad, (), solution.on_limits)

    def position_um(self, solution: Solution) -> Array:
        """Return where the middle of the root link is, shape (3,), in the volume's frame."""
        body_um = self._mean_coefficients_um @ self.chain.stacked_axes(solution.angles_rad)
        position_um: Array = self._seen_mean_um - solution.axes @ body_um
        return position_um

    def jacobian(self, solution: Solution) -> Array:
        """Return how the points move, in standard deviations, with each unknown: shape (3 n, 6 + J' + K).

        Along the root link's own axes. The columns are the position along these axes in µm, a rotation vector
        about them in radians, the angles of the J' `joints` in radians, and the lengths of the links in µm.
        """
        stacked = self.chain.stacked_axes(solution.angles_rad)
        coefficients_um = self.coefficients_um.copy()
        coefficients_um[:, ::3] += self.length_shares * solution.stretch_um
        count, angles = len(coefficients_um), 6 + len(self.joints)
        moves = np.empty((angles + len(self.chain.links), count, 3))
        moves[:3] = np.eye(3)[:, None, :]
        moves[3:6] = _turning(-coefficients_um @ stacked)
        moves[6:angles] = coefficients_um @ self.chain.stacked_turning(stacked, self.joints)
        moves[angles:] = self.length_shares.T[:, :, None] * stacked[::3, None, :]
        moves *= self.weights
        return moves.reshape(len(moves), -1).T

    def _grid_starts(self, most: int) -> list[tuple[Array, Array]]:
        grid = self.chain.grid(tuple(self.joints))
        spread = np.square(self.body @ grid.stacked).sum(axis=(1, 2))
        cross = self._cross @ grid.stacked
        match = np.linalg.svd(cross, compute_uv=False)
        # A reflection is no rotation: where it would fit best, the least singular value counts as negative.
        match[:, 2] = np.copysign(match[:, 2], np.linalg.det(cross))
        costs = self._seen_square + spread - 2 * match.sum(axis=1)
        # Where the angles make no difference, rounding must not choose between them.
        costs = np.round(costs, 3)
        lowest = np.flatnonzero((costs <= costs[grid.neighbours]).all(axis=0))
        bends_rad = np.abs(grid.angles_rad[lowest]).sum(axis=1)
        return [
            (self._best_axes(grid.stacked[place]), grid.angles_rad[place])
            for place in lowest[np.lexsort((bends_rad, costs[lowest]))][:most]
        ]

    def _best_axes(self, stacked: Array) -> Array:
        left, _, right = np.linalg.svd(self._cross @ stacked)
        if np.linalg.det(left @ right) < 0:
            left[:, 2] *= -1
        axes: Array = left @ right
        return axes

    def _within_limits(self, angles_rad: Array) -> Array:
        return np.clip(angles_rad, self._limits_rad[:, 0], self._limits_rad[:, 1])

    def _polished(
        self,
        axes: Array,
        angles_rad: Array,
        rivals: Sequence[Solution],
        held: frozenset[int] = frozenset(),
    ) -> Solution:
        """Return the minimum next to a start; joints that leave their limits are brought back and held there.

        It is left unfinished once it is plain that one of its rivals is far better.
        """
        hopeless = min((rival.chi_square for rival in rivals), default=math.inf) + _HOPELESS
        solution, is_settled = self._minimum(axes, angles_rad, held, _FEW_CALLS if rivals else _MANY_CALLS)
        if not is_settled and solution.chi_square < hopeless:
            solution, _ = self._minimum(solution.axes, solution.angles_rad, held, _MANY_CALLS)
        while self._is_limited and solution.chi_square < hopeless:
            low, high = self._limits_rad[:, 0], self._limits_rad[:, 1]
            beyond = (solution.angles_rad < low - ON_A_LIMIT_RAD) | (
                solution.angles_rad > high + ON_A_LIMIT_RAD
            )
            left = frozenset(int(joint) for joint in np.flatnonzero(beyond)) - held
            if not left:
                break
            held |= left
            angles_rad = self._within_limits(solution.angles_rad)
            solution, _ = self._minimum(solution.axes, angles_rad, held, _MANY_CALLS)
        return solution

    def _minimum(
        self, axes: Array, angles_rad: Array, held: frozenset[int], most_calls: int
    ) -> tuple[Solution, bool]:
        """Return where the descent from a start ended, whatever the limits, and whether it had settled."""
        # Importing scipy takes a third of a second, which only a fit should wait for.
        from scipy.optimize import leastsq

        descent = _Descent(self, axes, angles_rad, [joint for joint in self.joints if joint not in held])
        found, _, report, _, outcome = leastsq(
            descent.residuals,
            descent.start,
            Dfun=descent.jacobian,
            full_output=True,  # without it, a search that ends early warns
            col_deriv=True,
            ftol=_TOLERANCE,
            xtol=_TOLERANCE,
            maxfev=most_calls,
        )
        residuals = report["fvec"]
        solution = Solution(*descent.pose(found), float(residuals @ residuals), held)
        return solution, outcome != _CALLS_USED_UP


class _Descent:
    """What MINPACK descends: residuals and their Jacobian about a start.

    The unknowns are the rotation from the start as a Gibbs vector g (along its axis, as long as the tangent
    of half its angle), the angles that are not held, and the links' stretches where lengths are free.
    """

    def __init__(self, solver: ChainSolver, axes: Array, angles_rad: Array, joints: list[int]) -> None:
        self._solver = solver
        self._axes = axes
        self._angles_rad = angles_rad
        self._joints = joints
        self._angles = slice(3, 3 + len(joints))
        self._stretches = 0 if solver.length_sigma_um is None else len(solver.length_sigma_um)
        self._at = b""
        self._rows: Array | None = None
        self.start = np.zeros(3 + len(joints) + self._stretches)
        self.start[self._angles] = angles_rad[joints]

    def pose(self, unknowns: Array) -> tuple[Array, Array, Array]:
        """Return the root link's axes, all angles in [−π, π], and all stretches."""
        self._go_to(unknowns)
        angles_rad = self._all_rad - 2 * math.pi * np.round(self._all_rad / (2 * math.pi))
        stretch_um = np.zeros(len(self._solver.chain.links))
        stretch_um[: self._stretches] = unknowns[self._angles.stop :]
        return self._turned, angles_rad, stretch_um

    def residuals(self, unknowns: Array) -> Array:
        self._go_to(unknowns)
        gaps: Array = (self._seen - self._body @ self._stacked).ravel()
        if self._solver.length_sigma_um is None:
            return gaps
        return np.concatenate([gaps, unknowns[self._angles.stop :] / self._solver.length_sigma_um])

    def jacobian(self, unknowns: Array) -> Array:
        """Return the Jacobian transposed: a row for each unknown."""
        self._go_to(unknowns)
        if self._rows is None:
            # Kept, because SciPy asks for the first one twice: for its shape, before MINPACK begins.
            self._rows = self._jacobian_here(unknowns)
        return self._rows

    def _jacobian_here(self, unknowns: Array) -> Array:
        solver, count = self._solver, len(self._seen)
        rows = np.zeros((len(unknowns), 3 * count + self._stretches))
        by_turn = _turning(self._seen).reshape(3, -1)
        rows[:3, : 3 * count] = _turning_by_gibbs(*unknowns[:3].tolist()).T @ by_turn
        if self._joints:
            bending = self._body @ solver.chain.stacked_turning(self._stacked, self._joints)
            rows[self._angles, : 3 * count] = -bending.reshape(len(bending), -1)
        if solver.length_sigma_um is not None:
            growing = solver.stretching.T[:, :, None] * self._stacked[::3, None, :]
            rows[self._angles.stop :, : 3 * count] = -growing.reshape(len(growing), -1)
            rows[self._angles.stop :, 3 * count :] = np.diag(1 / solver.length_sigma_um)
        return rows

    def _go_to(self, unknowns: Array) -> None:
        at = unknowns.tobytes()
        if at == self._at:
            return
        self._at = at
        self._rows = None
        solver = self._solver
        self._turned = self._axes @ _turn_by_gibbs(*unknowns[:3].tolist())
        self._seen = solver.seen @ self._turned
        self._all_rad = self._angles_rad.copy()
        self._all_rad[self._joints] = unknowns[self._angles]
        self._stacked = solver.chain.stacked_axes(self._all_rad)
        self._body = solver.body
        if self._stretches:
            self._body = solver.body.copy()
            self._body[:, ::3] += solver.stretching * unknowns[self._angles.stop :]


def _turning(vectors: Array) -> Array:
    """Return the derivatives of u × ω by ω for vectors u of shape (n, 3): one (n, 3) array for each ω_c."""
    products: Array = vectors @ _TURNS_BY
    return products.reshape(-1, 3, 3).transpose(1, 0, 2)


def _turn_by_gibbs(x: float, y: float, z: float) -> Array:
    """Return the (3, 3) rotation matrix of a Gibbs vector, by A. Cayley's formula."""
    # Written out, here and below: the fit runs while a hand drags, and arrays this small are slow.
    xx, yy, zz = x * x, y * y, z * z
    turn = np.array(
        [
            [1 + xx - yy - zz, 2 * (x * y - z), 2 * (x * z + y)],
            [2 * (x * y + z), 1 - xx + yy - zz, 2 * (y * z - x)],
            [2 * (x * z - y), 2 * (y * z + x), 1 - xx - yy + zz],
        ]
    )
    turn /= 1 + xx + yy + zz
    return turn


def _turning_by_gibbs(x: float, y: float, z: float) -> Array:
    """Return the (3, 3) matrix from a change δg of a Gibbs vector to the rotation vector about own axes.

    2 (δg − g × δg) / (1 + g²).
    """
    turning = np.array([[1.0, z, -y], [-z, 1.0, x], [y, -x, 1.0]])
    turning *= 2 / (1 + x * x + y * y + z * z)
    return turning


def _rounded(solution: Solution) -> float:
    """Return χ² without its rounding, so that equally good minima keep the order in which they were found."""
    return round(solution.chi_square, 6)
