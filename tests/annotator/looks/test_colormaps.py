"""Colour maps are tables of 256 colours, shared and unchangeable."""

import matplotlib as mpl
import numpy as np
import pytest

from annotator.looks.colormaps import COLORMAPS


@pytest.mark.parametrize("name", list(COLORMAPS))
def test_every_map_is_a_table(name: str) -> None:
    table = COLORMAPS[name]
    assert (table.shape, table.dtype) == ((256, 4), np.uint8)
    assert np.all(table[:, 3] == 255)
    assert COLORMAPS[name] is table
    with pytest.raises(ValueError, match="read-only"):
        table[0] = 0


@pytest.mark.parametrize(
    ("name", "in_matplotlib"),
    [
        ("gray", "gray"),
        ("inverted gray", "gray_r"),
        ("bone", "bone"),
        ("hot", "hot"),
        ("viridis", "viridis"),
        ("inferno", "inferno"),
    ],
)
def test_every_map_is_matplotlib_s_of_this_name(name: str, in_matplotlib: str) -> None:
    # Its own bytes are cut off, not rounded: its gray number 33 would be 32.
    expected = np.rint(255 * mpl.colormaps[in_matplotlib](np.arange(256)))
    np.testing.assert_array_equal(COLORMAPS[name], expected)


def test_gray_rises_and_inverted_gray_falls() -> None:
    assert COLORMAPS["gray"][:, 0].tolist() == list(range(256))
    assert COLORMAPS["inverted gray"][:, 0].tolist() == list(range(255, -1, -1))


def test_unknown_names_are_refused() -> None:
    with pytest.raises(KeyError):
        COLORMAPS["rainbow of nobody"]
    assert len(COLORMAPS) == len(set(COLORMAPS))
