"""Boxes that are the same body turned half about its own x: their hinges differ in sense, nothing else."""

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.compared import Compared
from annotations.agreement.results import TurnedBox
from annotations.geometry.angles import angles_deg, unit_vectors
from annotations.geometry.rotations import matrices
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]

_SAME_AXIS_DEG = 15.0
_HALF_TURN_DEG = 180.0 - 30.0
_COSINE_OF_SAME_AXIS, _COSINE_OF_OPPOSED = 0.9, -0.5


def turned_boxes(compared: Compared, tool: ToolSpecification) -> tuple[TurnedBox, ...]:
    """Return the boxes that differ from another annotator's by about 180° about their own x.

    Their axes are within 15° of each other, and their hinges (own +y, across the mean of the two axes) are
    150° to 180° apart.

    Returns
    -------
    tuple of TurnedBox
        By volume and link; ``annotators`` are those in the minority, or of as many on either side all.
        Empty for keypoints.
    """
    if compared.rotations_wxyz is None:
        return ()
    axes = matrices(compared.rotations_wxyz)
    along, hinges = axes[..., 0], axes[..., 1]
    found = []
    for index, link in enumerate(tool.links):
        opposed = _opposed(along[:, :, index], hinges[:, :, index])
        for row in np.flatnonzero(opposed.any(axis=(1, 2))):
            against = opposed[row].sum(axis=1)
            who = [compared.annotators[each] for each in np.flatnonzero(against == against.max())]
            found.append(
                (int(row), TurnedBox(volume=compared.volumes[row], link=link.name, annotators=tuple(who)))
            )
    return tuple(box for _, box in sorted(found, key=lambda each: each[0]))


def _opposed(along: Array, hinges: Array) -> NDArray[np.bool_]:
    """Return which two annotators are half a turn apart, (V, A, A), by own x and y, (V, A, 3)."""
    # Products rule most pairs out: opposed about the mean of their axes, hinges are 135° apart or more.
    with np.errstate(invalid="ignore"):
        opposed = along @ along.swapaxes(1, 2) > _COSINE_OF_SAME_AXIS
        opposed &= hinges @ hinges.swapaxes(1, 2) < _COSINE_OF_OPPOSED
    row, one, other = np.nonzero(opposed)
    middle = unit_vectors(along[row, one] + along[row, other])[:, np.newaxis]
    across = np.stack([hinges[row, one], hinges[row, other]], axis=1)
    across = across - (across * middle).sum(axis=-1, keepdims=True) * middle
    is_one_axis = angles_deg(along[row, one], along[row, other]) <= _SAME_AXIS_DEG
    opposed[row, one, other] = is_one_axis & (angles_deg(across[:, 0], across[:, 1]) >= _HALF_TURN_DEG)
    return opposed
