"""All the ways to exchange the names of keypoints that the tool's lengths allow."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from annotations.errors import Cancelled
from annotations.fitting.accounts import Account
from annotations.fitting.distances import SeenDistances
from annotations.fitting.evidence import BodyPoint


def plausible_relabellings(
    points: Sequence[BodyPoint], distances: SeenDistances, cancelled: Callable[[], bool]
) -> Iterator[Account]:
    """Return an account for each exchange of three names or more that no distance rules out.

    Parameters
    ----------
    points : sequence of BodyPoint
        One for each keypoint.
    distances : SeenDistances
        Of these points.
    cancelled : callable
        Asked at each name; if it says true, `Cancelled` is raised.
    """
    seen_um = np.array([point.position_um for point in points])
    gaps_um = np.linalg.norm(seen_um[:, None] - seen_um, axis=2)

    def places(chosen: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        if cancelled():
            raise Cancelled
        name = len(chosen)
        if name == len(points):
            yield chosen
            return
        for place in range(len(points)):
            if place in chosen:
                continue
            gaps = gaps_um[place, list(chosen)]
            if np.all((gaps >= distances.least_um[name, :name]) & (gaps <= distances.most_um[name, :name])):
                yield from places((*chosen, place))

    for order in places(()):
        changed = [name for name, place in enumerate(order) if name != place]
        if len(changed) < 3:
            continue
        renamed = tuple(
            replace(point, position_um=points[place].position_um, sigma_um=points[place].sigma_um)
            for point, place in zip(points, order, strict=True)
        )
        pairs = [(points[order[name]].keypoint, points[name].keypoint) for name in changed]
        yield Account("relabelled", tuple(name for pair in sorted(pairs) for name in pair), renamed)
