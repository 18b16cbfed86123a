"""A pose target as each annotator of each volume has it, as arrays."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Metric = Literal["distance", "angle", "difference"]


@dataclass(frozen=True)
class Measured:
    """One target; V volumes, A annotators.

    Attributes
    ----------
    name : str
        With its unit, such as ``position_um``.
    metric : str
        How far two values are apart: ``distance`` of two positions (d = 3), ``angle`` between two unit
        vectors in degrees (d = 3), absolute ``difference`` of two numbers (d = 1).
    values : (V, A, d) array of float64
        NaN where an annotator has none.
    """

    name: str
    metric: Metric
    values: NDArray[np.float64]
