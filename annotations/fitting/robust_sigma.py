"""Standard deviations that a few gross errors do not change."""

import numpy as np
from numpy.typing import ArrayLike

_SIGMAS_PER_DEVIATION = 1.4826


def robust_sigma(deviations: ArrayLike) -> float:
    """Return 1.4826 times the median size of deviations: of normal ones, that is their standard deviation."""
    return _SIGMAS_PER_DEVIATION * float(np.median(np.abs(deviations)))
