"""Small views of a volume along its axes, with points in them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from annotations.agreement.report.marks import FONT, Cell, Room, cells_in, size_in
from annotations.agreement.report.palette import FAINT, GRID, Look
from annotations.agreement.report.typesetting import line_width_in
from annotations.geometry.frames import Vector
from annotations.volumes import Level, intensity_window

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.patches import Rectangle

    from annotations.agreement.report.contents import Surface

SIDES = (2, 1, 0)
"""The axes along which a volume is looked at, in the order of the views."""

_AXES = "xyz"
_LEAST_AROUND_UM = 1500.0
_AROUND = 1.4
_UM_PER_MM = 1000.0
_POINTS_PER_INCH = 72.0
_NUMBER_FONT = FONT - 1
_MOST_NUMBERS = 4
_TICK_IN, _TICK_PT = 2 / _POINTS_PER_INCH, 0.8
_NUMBER_GAP_IN, _LABEL_GAP_IN, _TITLE_GAP_IN = (
    5.5 / _POINTS_PER_INCH,
    15 / _POINTS_PER_INCH,
    6 / _POINTS_PER_INCH,
)
"""From the frame to the numbers beside it, to what stands below these, and to the title."""


@dataclass(frozen=True)
class Window:
    """What of a volume is seen: a box along its axes, in µm and its frame."""

    low_um: Vector
    high_um: Vector

    @classmethod
    def whole(cls, size_um: Vector) -> "Window":
        """Return all of a volume."""
        return cls((0.0, 0.0, 0.0), size_um)

    @classmethod
    def around(cls, positions_um: Sequence[Vector]) -> "Window":
        """Return what is around some positions in µm, at least one."""
        low_um, high_um = np.min(positions_um, axis=0), np.max(positions_um, axis=0)
        half_um = max(_LEAST_AROUND_UM, _AROUND * float(np.max(high_um - low_um))) / 2
        x, y, z = ((low_um + high_um) / 2).tolist()
        return cls((x - half_um, y - half_um, z - half_um), (x + half_um, y + half_um, z + half_um))


def volume_views(figure: "Surface", windows: Sequence[Window], room: Room) -> list[list["VolumeView"]]:
    """Return views along all `SIDES` side by side, a row for each window, the first one on top."""
    width_in, height_in = size_in(figure)
    sheet = figure.add_axes((0, 0, 1, 1))
    sheet.set_axis_off()
    sheet.set_xlim(0, width_in)
    sheet.set_ylim(0, height_in)
    sheet.set_autoscale_on(False)
    cells = iter(cells_in(figure, len(SIDES) * len(windows), room, len(SIDES)))
    return [[VolumeView(sheet, next(cells), axis, window) for axis in SIDES] for window in windows]


class VolumeView:
    """A volume as it is seen along an axis.

    Drawn straight on a sheet that the views of a figure share: with axes of their own, whose numbers are
    objects of many parts, six of them would take twice as long.

    Parameters
    ----------
    sheet : matplotlib.axes.Axes
        Its coordinates are inches.
    cell : Cell
        What is seen is as large as fits in there.
    axis : int
        Along which it is seen.
    window : Window
        What of the volume is seen.
    """

    def __init__(self, sheet: "Axes", cell: Cell, axis: int, window: Window) -> None:
        self._sheet = sheet
        self._axis = axis
        self._window = window
        right, up = self._seen = _seen(axis)
        low_mm, high_mm = (np.asarray(each) / _UM_PER_MM for each in (window.low_um, window.high_um))
        self._low_mm, self._high_mm = low_mm[[right, up]], high_mm[[right, up]]
        size_mm = self._high_mm - self._low_mm
        self._in_per_mm = float(np.min(np.array((cell.width_in, cell.height_in)) / size_mm))
        self._width_in, self._height_in = (size_mm * self._in_per_mm).tolist()
        self._left_in = cell.left_in + (cell.width_in - self._width_in) / 2
        self._bottom_in = cell.bottom_in + (cell.height_in - self._height_in) / 2
        self._frame: Rectangle | None = None

    def place_in(self, position_um: Vector) -> tuple[float, float]:
        """Return where on the sheet a position in µm is seen, in inches."""
        return self._place_in(*(position_um[axis] / _UM_PER_MM for axis in self._seen))

    def draw_volume(self, level: Level | None, words: str = "") -> None:
        """Draw the brightest voxels on the way, with a frame and numbers around them.

        Parameters
        ----------
        level : Level or None
            A coarse copy of the volume; None where it is not at hand, so that there is only a grid.
        words : str
            Stand in the title, before the axis.
        """
        from matplotlib.patches import Rectangle

        self._frame = Rectangle(
            (self._left_in, self._bottom_in),
            self._width_in,
            self._height_in,
            facecolor="white" if level is None else "black",
            edgecolor="black",
            # Its inner half lies below the image.
            linewidth=2 * _TICK_PT,
            zorder=-1,
        )
        self._sheet.add_patch(self._frame)
        self._draw_numbers(has_grid=level is None)
        right, _ = self._seen
        middle_in = self._left_in + self._width_in / 2
        self._write(
            middle_in,
            self._bottom_in + self._height_in + _TITLE_GAP_IN,
            f"{words}along {_AXES[self._axis]}",
            "center",
            "baseline",
            FONT,
        )
        self._write(middle_in, self._bottom_in - _LABEL_GAP_IN, f"{_AXES[right]} (mm)", "center", "top")
        if level is not None:
            self._draw_brightest(level)

    def draw_points(self, positions_um: Sequence[Vector], look: Look) -> None:
        """Draw positions in µm, joined by a line."""
        is_alone = len(positions_um) == 1
        self._draw_line(
            positions_um,
            linestyle=look.line,
            linewidth=0.8,
            marker=look.marker,
            color=look.color,
            markersize=8 if is_alone else 4.5,
            markeredgecolor="white",
            markeredgewidth=0.7,
        )

    def draw_pairs(self, pairs_um: Sequence[tuple[Vector, Vector]], color: str) -> None:
        """Draw lines between pairs of positions in µm."""
        for pair_um in pairs_um:
            self._draw_line(pair_um, color=color, linewidth=1.0, linestyle="-")

    def _draw_line(self, positions_um: Sequence[Vector], **look: Any) -> None:
        places_in = np.array([self.place_in(each) for each in positions_um]).reshape(-1, 2)
        (line,) = self._sheet.plot(*places_in.T, **look)
        self._clip(line)

    def _draw_numbers(self, *, has_grid: bool) -> None:
        """Draw numbers below and left of the frame, with what they are and their lines."""
        below_in, beside_in = self._bottom_in - _NUMBER_GAP_IN, self._left_in - _NUMBER_GAP_IN
        across_mm, up_mm = (
            _numbers(low, high) for low, high in zip(self._low_mm, self._high_mm, strict=True)
        )
        ticks_in: list[tuple[float, float]] = []
        for value_mm, text in across_mm.items():
            at_in, _ = self._place_in(value_mm, 0.0)
            self._write(at_in, below_in, text, "center", "top")
            end_in = self._bottom_in + self._height_in * has_grid
            ticks_in += [(at_in, self._bottom_in - _TICK_IN), (at_in, end_in), (np.nan, np.nan)]
        for value_mm, text in up_mm.items():
            _, at_in = self._place_in(0.0, value_mm)
            self._write(beside_in, at_in, text, "right", "center")
            end_in = self._left_in + self._width_in * has_grid
            ticks_in += [(self._left_in - _TICK_IN, at_in), (end_in, at_in), (np.nan, np.nan)]
        self._sheet.plot(
            *np.reshape(ticks_in, (-1, 2)).T, color=GRID if has_grid else FAINT, linewidth=_TICK_PT
        )
        widest_in = max((line_width_in(text, _NUMBER_FONT) for text in up_mm.values()), default=0.0)
        self._sheet.text(
            beside_in - widest_in - _TICK_IN,
            self._bottom_in + self._height_in / 2,
            f"{_AXES[self._seen[1]]} (mm)",
            fontsize=_NUMBER_FONT,
            rotation="vertical",
            horizontalalignment="right",
            verticalalignment="center",
        )

    def _draw_brightest(self, level: Level) -> None:
        """Draw the brightest voxels along the axis, of those within the window's depth."""
        spacing_um, origin_um = np.asarray(level.spacing_um), np.asarray(level.origin_um)
        last = np.asarray(level.data.shape) - 1
        low = np.clip(np.floor((np.asarray(self._window.low_um) - origin_um) / spacing_um), 0, last)
        high = np.clip(np.ceil((np.asarray(self._window.high_um) - origin_um) / spacing_um), low, last)
        first, second, third = (
            slice(start, end + 1) for start, end in zip(low.astype(int), high.astype(int), strict=True)
        )
        image = level.data[first, second, third].max(axis=self._axis)
        edges_um = (origin_um + (edge - side) * spacing_um for edge, side in ((low, 0.5), (high, -0.5)))
        (left_in, top_in), (right_in, bottom_in) = (
            self.place_in((x, y, z)) for x, y, z in (each.tolist() for each in edges_um)
        )
        black, white = intensity_window(level)
        drawn = self._sheet.imshow(
            image.T,
            cmap="gray",
            vmin=black,
            vmax=white,
            extent=(left_in, right_in, bottom_in, top_in),
            interpolation="bilinear",
            aspect="auto",
        )
        self._clip(drawn)

    def _clip(self, artist: "Artist") -> None:
        # Later than it is made: axes take a frame that is a rectangle for none.
        artist.set_clip_path(self._frame)

    def _place_in(self, across_mm: float, up_mm: float) -> tuple[float, float]:
        # Upwards on the sheet is backwards in the volume.
        return (
            self._left_in + float(across_mm - self._low_mm[0]) * self._in_per_mm,
            self._bottom_in + self._height_in - float(up_mm - self._low_mm[1]) * self._in_per_mm,
        )

    def _write(
        self, x_in: float, y_in: float, text: str, across: str, up: str, size: float = _NUMBER_FONT
    ) -> None:
        self._sheet.text(x_in, y_in, text, fontsize=size, horizontalalignment=across, verticalalignment=up)


def _seen(axis: int) -> tuple[int, int]:
    """Return which axes of the volume go to the right and upwards where it is seen along one."""
    right, up = (other for other in range(3) if other != axis)
    return right, up


def _numbers(low_mm: float, high_mm: float) -> Mapping[float, str]:
    """Return round numbers in a range, each with how it is written."""
    from matplotlib.ticker import AutoLocator, ScalarFormatter

    locator, formatter = AutoLocator(), ScalarFormatter(useOffset=False)
    locator.set_params(nbins=_MOST_NUMBERS)
    formatter.create_dummy_axis()
    assert formatter.axis is not None
    formatter.axis.set_view_interval(low_mm, high_mm)
    inside_mm = [float(each) for each in locator.tick_values(low_mm, high_mm) if low_mm <= each <= high_mm]
    return dict(zip(inside_mm, formatter.format_ticks(inside_mm), strict=True))
