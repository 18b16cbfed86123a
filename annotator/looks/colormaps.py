"""The colour maps that scene and slices share: 256 colours from the darkest intensity to the brightest."""

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ColorTable = NDArray[np.uint8]
"""Red, green, blue and alpha, shape (256, 4)."""

# In the order of the file, which holds the tables of Matplotlib's maps "gray", "gray_r", "bone", "hot",
# "viridis" and "inferno": importing Matplotlib takes an eighth of the time until the window is there.
_NAMES = ("gray", "inverted gray", "bone", "hot", "viridis", "inferno")
_FILE = Path(__file__).with_suffix(".npy")


class _Colormaps(Mapping[str, ColorTable]):
    """The tables by name, read when one is first asked for."""

    def __getitem__(self, name: str) -> ColorTable:
        return _tables()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(_NAMES)

    def __len__(self) -> int:
        return len(_NAMES)


COLORMAPS: Mapping[str, ColorTable] = _Colormaps()


@cache
def _tables() -> Mapping[str, ColorTable]:
    tables: NDArray[np.uint8] = np.load(_FILE)
    tables.setflags(write=False)
    return dict(zip(_NAMES, tables, strict=True))
