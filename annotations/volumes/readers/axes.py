"""Which axes of an array with more than three are left out, because they have a single entry."""

from collections.abc import Sequence


def kept_axes(lengths: Sequence[int], spatial: Sequence[bool]) -> tuple[int, ...]:
    """Return the axes that make a volume, in their order.

    Axes of length one that are known not to be spatial (a single time, a single channel) are left out; while
    more than three remain, so is the first other axis of length one. What cannot be left out remains, so the
    result may have more or fewer than three.

    Parameters
    ----------
    lengths : sequence of int
    spatial : sequence of bool
        For each axis whether it may be spatial.
    """
    kept = [axis for axis, length in enumerate(lengths) if length != 1 or spatial[axis]]
    while len(kept) > 3:
        single = next((axis for axis in kept if lengths[axis] == 1), None)
        if single is None:
            break
        kept.remove(single)
    return tuple(kept)
