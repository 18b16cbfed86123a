"""A slice's colours follow window and colour map."""

import numpy as np

from annotator.looks.colormaps import COLORMAPS
from annotator.scene.planes_layer import colored


def test_the_window_spans_the_colors() -> None:
    pixels = colored(np.array([[0, 50, 100, 150, 200]], dtype=np.uint8), (50.0, 150.0), "gray")
    assert pixels.shape == (1, 5, 4)
    assert pixels[0, :, 0].tolist() == [0, 0, 127, 255, 255]
    assert np.all(pixels[..., 3] == 255)


def test_another_map_gives_its_own_colors() -> None:
    pixels = colored(np.array([[0.0, 1.0]], dtype=np.float32), (0.0, 1.0), "inferno")
    assert pixels[0, 0].tolist() == COLORMAPS["inferno"][0].tolist()
    assert pixels[0, 1].tolist() == COLORMAPS["inferno"][255].tolist()


def test_what_is_not_a_number_is_black_and_an_empty_window_is_a_threshold() -> None:
    pixels = colored(np.array([[np.nan, 4.0, 6.0]], dtype=np.float32), (5.0, 5.0), "gray")
    assert pixels[0, :, 0].tolist() == [0, 0, 255]
