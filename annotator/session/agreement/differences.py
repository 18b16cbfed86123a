"""How far the annotations that are shown together lie apart, keypoint by keypoint: no painting."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from annotations.geometry.frames import Vector, vector


@dataclass(frozen=True)
class Difference:
    """The line from where one annotator has a keypoint to what it is compared with.

    Attributes
    ----------
    number : int
        The annotator's place in the order of all.
    keypoint : str
    position_um, reference_um : (float, float, float)
    """

    number: int
    keypoint: str
    position_um: Vector
    reference_um: Vector


def differences(
    own_number: int | None, own_um: Mapping[str, Vector], others_um: Mapping[int, Mapping[str, Vector]]
) -> tuple[Difference, ...]:
    """Return the differences between several annotations of one volume.

    With one other annotation beside one's own, the difference from one's own; else each one's from the mean
    of all that have the keypoint, one's own among them.

    Parameters
    ----------
    own_number : int or None
        The place of one's own in the order of all; None where the open document counts as nobody's.
    own_um : mapping of str to (float, float, float)
        One's own positions by keypoint.
    others_um : mapping of int to mapping
        Positions of the others, by their places in the order.
    """
    names = dict.fromkeys(name for positions_um in others_um.values() for name in positions_um)
    made = []
    for name in names:
        present = {
            number: positions_um[name] for number, positions_um in others_um.items() if name in positions_um
        }
        own = own_um.get(name) if own_number is not None else None
        if own is not None and len(present) == 1:
            ((number, position_um),) = present.items()
            made.append(Difference(number, name, position_um, own))
            continue
        if own is not None and own_number is not None:
            present[own_number] = own
        if len(present) > 1:
            mean_um = vector(np.mean(list(present.values()), axis=0))
            made += [Difference(number, name, each, mean_um) for number, each in present.items()]
    return tuple(made)
