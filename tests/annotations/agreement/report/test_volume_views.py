import numpy as np
import pytest

from annotations.agreement.report.palette import numbered_look
from annotations.agreement.report.volume_views import SIDES, Window, draw_pairs, draw_points, draw_side
from annotations.volumes import Level

SPACING_UM = (1000.0, 500.0, 250.0)


@pytest.fixture
def level() -> Level:
    """A dark volume with one bright voxel, at (2, 3, 4)."""
    data = np.zeros((4, 6, 8), dtype=np.uint8)
    data[2, 3, 4] = 255
    return Level(data, SPACING_UM, (0.0, 0.0, 0.0), "strided", (1, 1, 1))


@pytest.mark.parametrize("axis", SIDES)
def test_a_point_is_drawn_on_the_voxel_that_it_marks(level: Level, axis: int) -> None:
    from matplotlib.figure import Figure

    position_um = (2000.0, 1500.0, 1000.0)
    axes = Figure().subplots()

    draw_side(axes, axis, level, Window.whole((3000.0, 2500.0, 1750.0)))
    draw_points(axes, axis, [position_um], numbered_look(0))
    draw_pairs(axes, axis, [(position_um, (0.0, 0.0, 0.0))], "black")

    [image] = axes.images
    shown = np.asarray(image.get_array())
    left, right, bottom, top = image.get_extent()
    row, column = np.argwhere(shown == 255)[0]
    across_mm = left + (column + 0.5) * (right - left) / shown.shape[1]
    up_mm = top + (row + 0.5) * (bottom - top) / shown.shape[0]
    point, pair = axes.lines
    assert (point.get_xdata()[0], point.get_ydata()[0]) == pytest.approx((across_mm, up_mm))
    assert (pair.get_xdata()[0], pair.get_ydata()[0]) == pytest.approx((across_mm, up_mm))
    assert axes.get_title() == f"along {'xyz'[axis]}"


def test_what_is_seen_from_near_by_is_never_less_than_a_millimetre_and_a_half() -> None:
    window = Window.around([(1000.0, 2000.0, 3000.0), (1010.0, 2000.0, 3000.0)])

    assert np.subtract(window.high_um, window.low_um) == pytest.approx([1500.0] * 3)
    assert np.add(window.high_um, window.low_um) / 2 == pytest.approx([1005.0, 2000.0, 3000.0])
