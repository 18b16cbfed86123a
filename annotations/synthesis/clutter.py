"""Blocks that lie about in a scene, beside the tool."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from annotations.geometry import rotations
from annotations.geometry.body import LinkBody
from annotations.geometry.frames import Vector

Array = NDArray[np.float64]

_DRAWS_PER_BLOCK = 50
_LEAST_CROSS = 1e-9
"""Axes whose cross product is shorter are parallel, and ask nothing that the axes themselves do not."""


def random_clutter(
    rng: np.random.Generator,
    bodies: Iterable[LinkBody],
    count: int,
    size_um: tuple[float, float],
    extent_um: Vector,
) -> tuple[LinkBody, ...]:
    """Return blocks turned at random whose centres lie anywhere in the volume, clear of some bodies.

    What touches a body is drawn again; a block that finds no room is left out.

    Parameters
    ----------
    rng : numpy.random.Generator
    bodies : iterable of LinkBody
        Those of the tool.
    count : int
    size_um : (float, float)
        Least and greatest length, width and height.
    extent_um : (float, float, float)
        Position of the volume's last voxel; axis 2 is depth.
    """
    if not count:
        return ()
    others = list(bodies)
    blocks = []
    for _ in range(count):
        for _ in range(_DRAWS_PER_BLOCK):
            block = _random_block(rng, size_um, extent_um)
            # The top of the volume cuts through nothing: there would be no surface.
            if block.bounds_um()[0][2] > 0 and not _touches(block, others):
                blocks.append(block)
                break
    return tuple(blocks)


def _random_block(rng: np.random.Generator, size_um: tuple[float, float], extent_um: Vector) -> LinkBody:
    return LinkBody(
        center_um=rng.uniform(0, extent_um),
        # Four normal variates point anywhere on the sphere of rotations alike.
        axes=rotations.matrix(rng.normal(size=4)),
        half_size_um=rng.uniform(*size_um, size=3) / 2,
        is_round=False,
    )


def _touches(block: LinkBody, others: Sequence[LinkBody]) -> bool:
    """Say whether the box around a body touches those around others.

    Two boxes are apart where their shadows on a line are: one along an axis of either, or across an axis of
    each (S. Gottschalk, M. C. Lin & D. Manocha, *OBBTree*, SIGGRAPH 1996).
    """
    if not others:
        return False
    axes = np.stack([other.axes for other in others])
    half = np.stack([other.half_size_um for other in others])
    apart = np.stack([other.center_um for other in others]) - block.center_um
    own, theirs = np.broadcast_to(block.axes.T, axes.shape), np.swapaxes(axes, 1, 2)
    across = np.cross(own[:, :, None], theirs[:, None]).reshape(len(others), 9, 3)
    across[np.linalg.norm(across, axis=2) < _LEAST_CROSS] = 0
    lines = np.concatenate([own, theirs, across], axis=1)
    reach = np.abs(lines @ block.axes) @ block.half_size_um
    reach += (np.abs(lines @ axes) @ half[:, :, None])[:, :, 0]
    distance = np.abs((lines @ apart[:, :, None])[:, :, 0])
    return bool(np.any(np.all(distance <= reach, axis=1)))
