"""Small pictures of the worst volumes, with the keypoints of every annotator."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from annotations.agreement.report.contents import Photo
from annotations.agreement.report.labels import METHODS, drawable, label_of, measure, unit_of
from annotations.agreement.report.marks import FONT, LEGEND_IN, WIDTH_IN, Room, grid, legend
from annotations.agreement.report.palette import FAINT, GRID, Look, numbered_look
from annotations.agreement.report.pictures import picture_bytes
from annotations.agreement.report.scenes import Scene, read_scene
from annotations.agreement.results import Agreement, VolumeResult
from annotations.documents.record import Method
from annotations.errors import Cancelled
from annotations.geometry.frames import Vector
from annotations.volumes import Level, intensity_window

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from annotations.agreement.report.contents import Surface

MOST = 8
"""How many of the worst volumes are drawn, over all methods."""

_AXES = "xyz"
_SIDES = (2, 1, 0)
_LEAST_AROUND_UM = 1500.0
_HEIGHT_IN = 4.4
_IN_LEGEND_ROW = 5
_UM_PER_MM = 1000.0


def thumbnails(
    agreement: Agreement,
    method: Method,
    folder: Path,
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> tuple[Photo, ...]:
    """Return pictures of the worst volumes by one method, the worst first.

    The annotations are read again from their files. Where a volume's file is not at hand, its keypoints are
    drawn alone.

    Parameters
    ----------
    agreement : Agreement
    method : str
    folder : Path
        What paths in ``agreement.inputs`` are relative to.
    progress : callable
        Told the share of the work that is done, from 0 to 1.
    cancelled : callable
        Asked before each volume.

    Raises
    ------
    Cancelled
        `cancelled` returned true.
    """
    volumes = [volume for volume in agreement.methods[method].volumes if volume.targets]
    worst = sorted(volumes, key=lambda volume: volume.ratio_to_median, reverse=True)[
        : MOST // len(agreement.methods)
    ]
    pictures = []
    for done, volume in enumerate(worst):
        if cancelled():
            raise Cancelled
        progress(done / len(worst))
        scene = read_scene(agreement, method, volume, folder)
        if scene is not None:
            pictures.append(_picture(agreement, method, volume, scene))
    progress(1.0)
    return tuple(pictures)


def _picture(agreement: Agreement, method: Method, volume: VolumeResult, scene: Scene) -> Photo:
    looks = {name: numbered_look(agreement.annotators.index(name)) for name in scene.placed}
    legend_in = LEGEND_IN * math.ceil(len(looks) / _IN_LEGEND_ROW)
    targets = ", ".join(
        f"{label_of(target)} {measure(volume.targets[target], unit_of(target))}"
        for target in agreement.targets
        if target in volume.targets
    )
    why = f" Why: {'; '.join(volume.reasons)}." if volume.reasons else ""
    ground = (
        "the brightest voxels along each axis"
        if scene.level is not None
        else "the volume's file is not at hand, so there is no image"
    )

    def draw(figure: "Surface") -> None:
        room = Room(gap_in=0.5, ticks_in=0.42, legend_in=legend_in)
        cells = grid(figure, 2 * len(_SIDES), room, columns=len(_SIDES))
        sides = product((_Window.whole(scene), _Window.around_worst(scene)), _SIDES)
        for axes, (window, axis) in zip(cells, sides, strict=True):
            _draw_side(axes, axis, scene, window, looks)
        legend(figure, list(looks.values()), list(map(drawable, looks)), _IN_LEGEND_ROW)

    size_in = (WIDTH_IN, _HEIGHT_IN + legend_in)
    return Photo(
        caption=f"{METHODS[method]}, volume {volume.volume}. Deviation from the mean of all: {targets}.{why} "
        f"Upper row: the keypoints of every annotator, seen along each axis ({ground}). Lower row: keypoint "
        f"{scene.worst}, at which the annotators are furthest apart, from near by.",
        alternative=f"Views of volume {volume.volume} along its three axes, with each annotator's keypoints.",
        size_in=size_in,
        png=picture_bytes(size_in, draw, "png"),
    )


@dataclass(frozen=True)
class _Window:
    """What of a volume is drawn.

    Attributes
    ----------
    low_um, high_um : (float, float, float)
        In the volume's frame.
    only : str or None
        The keypoint that is drawn; None for all.
    """

    low_um: Vector
    high_um: Vector
    only: str | None

    @classmethod
    def whole(cls, scene: Scene) -> "_Window":
        return cls((0.0, 0.0, 0.0), scene.size_um, None)

    @classmethod
    def around_worst(cls, scene: Scene) -> "_Window":
        points_um = np.array([each[scene.worst] for each in scene.placed.values() if scene.worst in each])
        low_um, high_um = points_um.min(axis=0), points_um.max(axis=0)
        half_um = max(_LEAST_AROUND_UM, 1.4 * float(np.max(high_um - low_um))) / 2
        x, y, z = ((low_um + high_um) / 2).tolist()
        return cls(
            (x - half_um, y - half_um, z - half_um), (x + half_um, y + half_um, z + half_um), scene.worst
        )

    def points(self, placed: Iterable[tuple[str, Vector]]) -> list[Vector]:
        return [position_um for name, position_um in placed if self.only in (None, name)]


def _draw_side(axes: "Axes", axis: int, scene: Scene, window: _Window, looks: dict[str, Look]) -> None:
    right, up = (other for other in range(3) if other != axis)
    if scene.level is not None:
        _draw_brightest(axes, scene.level, axis, window)
    else:
        axes.grid(color=GRID, linewidth=0.5)
    for annotator, placed in scene.placed.items():
        _draw_points(axes, window.points(placed.items()), right, up, looks[annotator])
    axes.set_xlim(window.low_um[right] / _UM_PER_MM, window.high_um[right] / _UM_PER_MM)
    axes.set_ylim(window.high_um[up] / _UM_PER_MM, window.low_um[up] / _UM_PER_MM)
    axes.set_aspect("equal")
    axes.set_title(
        f"along {_AXES[axis]}" if window.only is None else f"{drawable(window.only)}, along {_AXES[axis]}",
        fontsize=FONT,
    )
    axes.set_xlabel(f"{_AXES[right]} (mm)", fontsize=FONT - 1, labelpad=1)
    axes.set_ylabel(f"{_AXES[up]} (mm)", fontsize=FONT - 1, labelpad=1)
    axes.tick_params(labelsize=FONT - 1, color=FAINT, length=2)
    axes.locator_params(nbins=4)


def _draw_brightest(axes: "Axes", level: Level, axis: int, window: _Window) -> None:
    """Draw the brightest voxels along an axis, of those within the window's depth."""
    spacing_um, origin_um = np.asarray(level.spacing_um), np.asarray(level.origin_um)
    last = np.asarray(level.data.shape) - 1
    low = np.clip(np.floor((np.asarray(window.low_um) - origin_um) / spacing_um), 0, last).astype(int)
    high = np.clip(np.ceil((np.asarray(window.high_um) - origin_um) / spacing_um), low, last).astype(int)
    first, second, third = (slice(start, end + 1) for start, end in zip(low, high, strict=True))
    image = level.data[first, second, third].max(axis=axis)
    low_mm, high_mm = (
        ((origin_um + edge * spacing_um) / _UM_PER_MM).tolist() for edge in (low - 0.5, high + 0.5)
    )
    across, up = (other for other in range(3) if other != axis)
    black, white = intensity_window(level)
    axes.set_facecolor("black")
    axes.imshow(
        image.T,
        cmap="gray",
        vmin=black,
        vmax=white,
        extent=(low_mm[across], high_mm[across], high_mm[up], low_mm[up]),
        interpolation="bilinear",
    )


def _draw_points(axes: "Axes", positions_um: Sequence[Vector], right: int, up: int, look: Look) -> None:
    is_alone = len(positions_um) == 1
    axes.plot(
        [position_um[right] / _UM_PER_MM for position_um in positions_um],
        [position_um[up] / _UM_PER_MM for position_um in positions_um],
        linestyle=look.line,
        linewidth=0.8,
        marker=look.marker,
        color=look.color,
        markersize=8 if is_alone else 4.5,
        markeredgecolor="white",
        markeredgewidth=0.7,
    )
