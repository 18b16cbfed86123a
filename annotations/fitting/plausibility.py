"""From where on a residual or a length calls for a look, and for an explanation."""

import math
from collections.abc import Iterable
from typing import Literal

from annotations.fitting.mistakes import LENGTH_TOLERANCE
from annotations.geometry.tool import Link

Plausibility = Literal["plausible", "doubtful", "implausible"]

DOUBTFUL_SIGMAS, IMPLAUSIBLE_SIGMAS = 3.0, 6.0
"""Standard deviations beyond which something is doubtful, or implausible. Three are exceeded by 3 % of sound
distances in space, by fewer where the fit has followed the point; six by none that anybody will meet."""


def plausibility(deviation_um: float, sigma_um: float) -> Plausibility:
    """Judge a deviation in µm by its standard deviation along each axis."""
    sigmas = abs(deviation_um) / sigma_um
    if sigmas > IMPLAUSIBLE_SIGMAS:
        return "implausible"
    return "doubtful" if sigmas > DOUBTFUL_SIGMAS else "plausible"


def length_plausibility(length_um: float, link: Link, end_sigmas_um: Iterable[float]) -> Plausibility:
    """Judge the length of a link in µm by what the clicks at its ends, and its nominal length, may be off.

    Parameters
    ----------
    end_sigmas_um : iterable of float
        Standard deviation along each axis of the position of each end.
    """
    sigma_um = math.hypot(LENGTH_TOLERANCE * link.length_um, *end_sigmas_um)
    return plausibility(length_um - link.length_um, sigma_um)
