"""How near and how far apart two points of the tool can be seen: what rules most mistakes out at once."""

from collections.abc import Sequence

import numpy as np

from annotations.fitting.chain import Array, Chain
from annotations.fitting.evidence import BodyPoint

_SIGMAS = 5.0
_BETWEEN_STEPS = 0.05
"""Between the angles of a grid, distances lie within those on it, but for this share."""


class SeenDistances:
    """The distances that pairs of body points may be seen at in any legal pose.

    Parameters
    ----------
    points : sequence of BodyPoint
        No two at the same place of the body.
    chain : Chain
    tolerance : float
        Standard deviation of links' lengths as a share of nominal.

    Attributes
    ----------
    least_um, most_um : ndarray, shape (n, n)
        Of each pair of the points, noise and tolerance allowed for.
    """

    def __init__(self, points: Sequence[BodyPoint], chain: Chain, tolerance: float) -> None:
        self._places = {(point.link, point.local_um): index for index, point in enumerate(points)}
        links = np.array([chain.links.index(point.link) for point in points])
        local_um = np.array([point.local_um for point in points])
        coefficients_um = chain.coefficients_um(links, local_um)
        body_um = coefficients_um @ chain.grid(tuple(range(len(chain.joints)))).stacked
        distances_um = np.linalg.norm(body_um[:, :, None] - body_um[:, None], axis=3)
        largest_um = distances_um.max(axis=0)
        sigma_um = max(point.sigma_um for point in points)
        noise_um = np.sqrt(2 * sigma_um**2 + np.square(tolerance * largest_um))
        slack_um = _SIGMAS * noise_um + _BETWEEN_STEPS * np.where(links[:, None] == links, 0.0, largest_um)
        self.least_um: Array = distances_um.min(axis=0) - slack_um
        self.most_um: Array = largest_um + slack_um
        shares = chain.length_shares(links, local_um)
        self._grows_with = shares[:, None] != shares
        self._may_bend = links[:, None] != links

    def allow(
        self, points: Sequence[BodyPoint], *, long_link: int | None = None, is_limited: bool = True
    ) -> bool:
        """Say whether points, all or some of them, may be seen where they are now.

        Parameters
        ----------
        long_link : int, optional
            A link of any length: distances that depend on it may be anything.
        is_limited : bool
            Whether the joints' limits hold: without them, points may come nearer to each other.
        """
        places = [self._places[point.link, point.local_um] for point in points]
        seen_um = np.array([point.position_um for point in points])
        gaps_um = np.linalg.norm(seen_um[:, None] - seen_um, axis=2)
        pairs = np.ix_(places, places)
        is_near_enough, is_far_enough = gaps_um <= self.most_um[pairs], gaps_um >= self.least_um[pairs]
        if not is_limited:
            is_far_enough |= self._may_bend[pairs]
        within = is_near_enough & is_far_enough
        if long_link is not None:
            within |= self._grows_with[pairs][:, :, long_link]
        return bool(within.all())
