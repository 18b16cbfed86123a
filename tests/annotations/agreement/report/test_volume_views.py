import numpy as np
import pytest

from annotations.agreement.report.marks import Room
from annotations.agreement.report.palette import numbered_look
from annotations.agreement.report.volume_views import SIDES, Window, volume_views
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
    figure = Figure()
    [views] = volume_views(figure, [Window.whole((3000.0, 2500.0, 1750.0))], Room())
    view = views[SIDES.index(axis)]

    view.draw_volume(level)
    view.draw_points([position_um], numbered_look(0))
    view.draw_pairs([(position_um, (0.0, 0.0, 0.0))], "black")

    [sheet] = figure.axes
    [image] = sheet.images
    shown = np.asarray(image.get_array())
    left_in, right_in, bottom_in, top_in = image.get_extent()
    row, column = np.argwhere(shown == 255)[0]
    across_in = left_in + (column + 0.5) * (right_in - left_in) / shown.shape[1]
    up_in = top_in + (row + 0.5) * (bottom_in - top_in) / shown.shape[0]
    _, point, pair = sheet.lines
    assert (point.get_xdata()[0], point.get_ydata()[0]) == pytest.approx((across_in, up_in))
    assert (pair.get_xdata()[0], pair.get_ydata()[0]) == pytest.approx((across_in, up_in))
    assert f"along {'xyz'[axis]}" in [text.get_text() for text in sheet.texts]


@pytest.mark.parametrize("axis", SIDES)
def test_numbers_stand_where_they_say(level: Level, axis: int) -> None:
    from matplotlib.figure import Figure

    figure = Figure()
    window = Window((-1000.0, 500.0, 0.0), (3000.0, 2500.0, 1750.0))
    [views] = volume_views(figure, [window], Room())
    view = views[SIDES.index(axis)]

    view.draw_volume(None)

    numbers = [text for text in figure.axes[0].texts if text.get_text()[-1].isdigit()]
    right, up = (other for other in range(3) if other != axis)
    for number in numbers:
        is_below = number.get_horizontalalignment() == "center"
        position_um = [0.0, 0.0, 0.0]
        position_um[right if is_below else up] = 1000 * float(number.get_text().replace("\u2212", "-"))
        expected_in = view.place_in((position_um[0], position_um[1], position_um[2]))
        place = 0 if is_below else 1
        assert number.get_position()[place] == pytest.approx(expected_in[place])
    assert 4 <= len(numbers) <= 10


def test_a_picture_of_many_views_has_one_set_of_axes(level: Level) -> None:
    """Axes are what a picture takes its time for."""
    from matplotlib.figure import Figure

    figure = Figure()
    for row in volume_views(figure, [Window.whole((3000.0, 2500.0, 1750.0))] * 2, Room()):
        for view in row:
            view.draw_volume(level)

    assert len(figure.axes) == 1
    assert len(figure.axes[0].images) == 6


def test_what_is_seen_from_near_by_is_never_less_than_a_millimetre_and_a_half() -> None:
    window = Window.around([(1000.0, 2000.0, 3000.0), (1010.0, 2000.0, 3000.0)])

    assert np.subtract(window.high_um, window.low_um) == pytest.approx([1500.0] * 3)
    assert np.add(window.high_um, window.low_um) / 2 == pytest.approx([1005.0, 2000.0, 3000.0])
