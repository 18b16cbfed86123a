"""How long a scale bar is, and what stands at it: the same in the scene and in the slices."""

import math


def round_length_um(longest_um: float) -> float:
    """Return the longest length of 1, 2 or 5 times a power of ten that is not longer than this."""
    power = 10.0 ** math.floor(math.log10(longest_um))
    return next(step * power for step in (5, 2, 1) if step * power <= longest_um * (1 + 1e-9))


def length_text(length_um: float) -> str:
    """Return a length as a person writes it: in mm from 1 mm on, else in µm."""
    return f"{length_um / 1000:g} mm" if length_um >= 1000 else f"{length_um:g} µm"
