"""The colour maps that scene and slices share: 256 colours from the darkest intensity to the brightest."""

from collections.abc import Iterator, Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

ColorTable = NDArray[np.uint8]
"""Red, green, blue and alpha, shape (256, 4)."""

# What a person chooses from, and what Matplotlib calls it.
_MATPLOTLIB_NAMES = {
    "gray": "gray",
    "inverted gray": "gray_r",
    "bone": "bone",
    "hot": "hot",
    "viridis": "viridis",
    "inferno": "inferno",
}


class _Colormaps(Mapping[str, ColorTable]):
    """The tables by name, each made when it is first asked for: importing Matplotlib takes a while."""

    def __getitem__(self, name: str) -> ColorTable:
        return _table(_MATPLOTLIB_NAMES[name])

    def __iter__(self) -> Iterator[str]:
        return iter(_MATPLOTLIB_NAMES)

    def __len__(self) -> int:
        return len(_MATPLOTLIB_NAMES)


COLORMAPS: Mapping[str, ColorTable] = _Colormaps()


@cache
def _table(matplotlib_name: str) -> ColorTable:
    from matplotlib import colormaps

    # Matplotlib's own bytes are cut off, not rounded: its gray number 33 would be 32.
    table: ColorTable = np.rint(255 * colormaps[matplotlib_name](np.arange(256))).astype(np.uint8)
    table.setflags(write=False)
    return table
