"""How a drag changes the window of intensities, in the scene and in the slices alike."""

import math

# Dragging sideways by this much makes the window e times as wide.
E_FOLD_PX = 150.0
# Dragging up or down by this much moves the level by the window's width.
LEVEL_WIDTH_PX = 200.0


def dragged_window(window: tuple[float, float], right_px: float, down_px: float) -> tuple[float, float]:
    """Return the window after a drag: wider to the right, brighter upwards."""
    low, high = window
    width = high - low
    level = (low + high) / 2 + down_px / LEVEL_WIDTH_PX * width
    wider = width * math.exp(right_px / E_FOLD_PX)
    return (level - wider / 2, level + wider / 2)
