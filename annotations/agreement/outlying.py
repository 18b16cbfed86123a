"""From where on a distance is not one of the usual ones."""

import numpy as np
from numpy.typing import NDArray

_SIGMAS = 5.0
_SIGMAS_PER_DEVIATION = 1.4826

ROUNDING = 1e-6
"""In µm or degrees: two values that are no further apart differ by what rounding left, not by a person."""


def outlying_limit(distances: NDArray[np.float64]) -> float:
    """Return the distance beyond which one is an outlier: the median of all, plus five standard deviations.

    These are told from the median absolute deviation from the median (B. Iglewicz, D. C. Hoaglin, *How to
    Detect and Handle Outliers*, 1993, whose limit for symmetric data is 3.5). Distances are skewed: of normal
    errors alone, five are exceeded by one in 3,000 angles and by one in 20,000 positions.

    Parameters
    ----------
    distances : array of float64
        In µm or degrees, of any shape; NaN does not count. Without any the limit is infinite.
    """
    known = distances[np.isfinite(distances)]
    if not known.size:
        return np.inf
    middle = float(np.median(known))
    sigma = _SIGMAS_PER_DEVIATION * float(np.median(np.abs(known - middle)))
    return middle + max(_SIGMAS * sigma, ROUNDING)
