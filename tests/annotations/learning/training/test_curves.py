"""How a training went, as a picture."""

import math

from annotations.learning.training.curves import curves_svg

ROWS = [
    {"part": "synthetic", "epoch": 1, "loss": 3.0, "position_mm_mean": 2.0, "position_mm_median": math.inf},
    {"part": "synthetic", "epoch": 2, "loss": 0.0, "position_mm_mean": math.nan, "theta1_deg_mean": 4.0},
    {"part": "annotated", "epoch": 0, "position_mm_mean": 0.5},
]


def test_it_is_a_picture_and_always_the_same() -> None:
    content = curves_svg(ROWS)
    assert content.startswith(b"<?xml")
    assert b"<svg" in content
    assert curves_svg(ROWS) == content


def test_one_epoch_is_enough() -> None:
    assert b"<svg" in curves_svg(ROWS[:1])
