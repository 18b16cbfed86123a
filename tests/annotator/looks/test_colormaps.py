"""Colour maps are tables of 256 colours, shared and unchangeable."""

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


def test_gray_rises_and_inverted_gray_falls() -> None:
    assert COLORMAPS["gray"][:, 0].tolist() == list(range(256))
    assert COLORMAPS["inverted gray"][:, 0].tolist() == list(range(255, -1, -1))


def test_unknown_names_are_refused() -> None:
    with pytest.raises(KeyError):
        COLORMAPS["rainbow of nobody"]
    assert len(COLORMAPS) == len(set(COLORMAPS))
