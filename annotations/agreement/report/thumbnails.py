"""Small pictures of the worst volumes, with the keypoints of every annotator."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from annotations.agreement.report.contents import Photo
from annotations.agreement.report.labels import METHODS, drawable, label_of, measure, unit_of
from annotations.agreement.report.marks import LEGEND_IN, WIDTH_IN, Room, legend
from annotations.agreement.report.palette import numbered_look
from annotations.agreement.report.pictures import picture_bytes
from annotations.agreement.report.scenes import Scene, read_scene
from annotations.agreement.report.volume_views import Window, volume_views
from annotations.agreement.results import Agreement, VolumeResult
from annotations.documents.record import Method
from annotations.errors import Cancelled

if TYPE_CHECKING:
    from annotations.agreement.report.contents import Surface

MOST = 8
"""How many of the worst volumes are drawn, over all methods."""

_HEIGHT_IN = 4.4
_IN_LEGEND_ROW = 5


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

    worst_um = [each[scene.worst] for each in scene.placed.values() if scene.worst in each]
    near_by = f"{drawable(scene.worst)}, "
    rows = ((Window.whole(scene.size_um), "", None), (Window.around(worst_um), near_by, scene.worst))

    def draw(figure: "Surface") -> None:
        room = Room(gap_in=0.5, ticks_in=0.42, legend_in=legend_in)
        views = volume_views(figure, [window for window, *_ in rows], room)
        for row, (_, words, only) in zip(views, rows, strict=True):
            for view in row:
                view.draw_volume(scene.level, words)
                for annotator, placed in scene.placed.items():
                    positions_um = [each for name, each in placed.items() if only in (None, name)]
                    view.draw_points(positions_um, looks[annotator])
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
