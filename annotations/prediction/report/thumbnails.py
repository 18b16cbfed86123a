"""Small pictures of the worst volumes: where the keypoints are, and where a checkpoint sees them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from annotations.agreement.report.contents import Photo
from annotations.agreement.report.labels import listed
from annotations.agreement.report.marks import LEGEND_IN, WIDTH_IN, Room, legend
from annotations.agreement.report.palette import Look
from annotations.agreement.report.pictures import picture_bytes
from annotations.agreement.report.scenes import volume_preview
from annotations.agreement.report.volume_views import Window, volume_views
from annotations.app_folders import tool_folder
from annotations.documents.study import load_study
from annotations.errors import Cancelled
from annotations.geometry.frames import Vector, extent_um
from annotations.interchange.speaking_documents import SpeakingDocument, speaking_documents
from annotations.prediction.errors.error_table import ErrorsOfVolume
from annotations.prediction.errors.error_text import column_title, decimals_of
from annotations.prediction.errors.study_errors import true_positions_um
from annotations.prediction.report.material import ReportMaterial

if TYPE_CHECKING:
    from annotations.agreement.report.contents import Surface

MOST = 8
"""How many of the worst volumes are drawn, over all checkpoints."""

TRUTH, PREDICTION = Look("#009e73", "o", "-"), Look("#d55e00", "X", "--")
"""As the application draws the two for those who see no difference between red and green."""

_PAIR = "#e69f00"
_HEIGHT_IN = 4.4
_SAME_UM = 0.01


def thumbnails(
    material: ReportMaterial,
    folder: Path,
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> tuple[tuple[Photo, ...], ...]:
    """Return pictures of each checkpoint's worst volumes, the worst first.

    The annotations are read again; those that no longer say what the errors were computed from are passed
    over. Where a volume's file is not at hand, its keypoints are drawn alone.

    Parameters
    ----------
    material : ReportMaterial
    folder : Path
        The study's.
    progress : callable
        Told the share of the work that is done, from 0 to 1.
    cancelled : callable
        Asked before each volume.

    Raises
    ------
    UserError
        The study cannot be read.
    Cancelled
        `cancelled` returned true.
    """
    study, folders = load_study(folder), (folder / "tools", tool_folder())
    documents, _ = speaking_documents(
        study,
        folder,
        material.tool,
        folders,
        material.truth.choice(study),
        lambda share: progress(share / 2),
        cancelled,
    )
    by_volume = {document.volume.id: document for document in documents}
    each_of = MOST // max(len(material.checkpoints), 1) or 1
    drawn: list[tuple[Photo, ...]] = []
    for name, checkpoint in zip(material.names, material.checkpoints, strict=True):
        rows = {row.volume: row for row in checkpoint.table.rows}
        photos = []
        for place, ranked in enumerate(checkpoint.ranking[:each_of]):
            if cancelled():
                raise Cancelled
            progress(0.5 + (len(drawn) + place / each_of) / len(material.checkpoints) / 2)
            document = by_volume.get(ranked.volume)
            prediction = checkpoint.predictions.get(ranked.volume)
            if document is not None and prediction is not None:
                photo = _picture(name, rows[ranked.volume], document, prediction.positions_um)
                photos += [] if photo is None else [photo]
        drawn.append(tuple(photos))
    progress(1.0)
    return tuple(drawn)


def _picture(
    name: str, row: ErrorsOfVolume, document: SpeakingDocument, predicted_um: Mapping[str, Vector]
) -> Photo | None:
    true_um = true_positions_um(document.annotation, document.tool)
    if not row.keypoints_um or not _is_as_compared(row, true_um, predicted_um):
        return None
    reference = document.annotation.volume
    level = volume_preview(reference, document.path)
    worst = max(row.keypoints_um, key=lambda each: row.keypoints_um[each])
    pairs_um = {each: (true_um[each], predicted_um[each]) for each in row.keypoints_um}
    views = (
        (Window.whole(extent_um(reference.shape, reference.spacing_um)), "", tuple(true_um), pairs_um),
        (Window.around(pairs_um[worst]), f"{worst}, ", (worst,), {worst: pairs_um[worst]}),
    )

    def draw(figure: "Surface") -> None:
        room = Room(gap_in=0.5, ticks_in=0.42, legend_in=LEGEND_IN)
        rows = volume_views(figure, [window for window, *_ in views], room)
        for row, (_, words, shown, pairs) in zip(rows, views, strict=True):
            for view in row:
                view.draw_volume(level, words)
                view.draw_pairs(list(pairs.values()), _PAIR)
                view.draw_points([true_um[each] for each in shown], TRUTH)
                view.draw_points([predicted_um[each] for each in shown if each in predicted_um], PREDICTION)
        legend(figure, [TRUTH, PREDICTION], ["annotation", "prediction"])

    errors = ", ".join(
        f"{column_title(target)} {value:.{decimals_of(target)}f}" for target, value in row.targets.items()
    )
    missing = f" Not found: {', '.join(row.missing)}." if row.missing else ""
    begun = ""
    if row.begun_from:
        checkpoints = listed(list(row.begun_from))
        begun = f" The annotation was begun from a prediction of {checkpoints}: it counts in no figure."
    ground = (
        "the brightest voxels along each axis"
        if level is not None
        else "the volume's file is not at hand, so there is no image"
    )
    size_in = (WIDTH_IN, _HEIGHT_IN + LEGEND_IN)
    return Photo(
        caption=f"{name}, volume {row.volume}, against {row.whose}. Errors: {errors or 'none known'}."
        f"{missing}{begun} Upper row: all keypoints, seen along each axis ({ground}), with a line between "
        f"each pair. Lower row: keypoint {worst}, which is furthest off ({row.keypoints_um[worst]:,.0f} µm), "
        "from near by.",
        alternative=f"Views of volume {row.volume} along its three axes, with the annotated and the "
        "predicted keypoints.",
        size_in=size_in,
        png=picture_bytes(size_in, draw, "png"),
    )


def _is_as_compared(
    row: ErrorsOfVolume, true_um: Mapping[str, Vector], predicted_um: Mapping[str, Vector]
) -> bool:
    """Say whether two sets of keypoints are the ones from which the errors were computed."""
    if not row.keypoints_um.keys() <= true_um.keys() & predicted_um.keys():
        return False
    return all(
        abs(np.linalg.norm(np.subtract(true_um[each], predicted_um[each])) - distance_um) < _SAME_UM
        for each, distance_um in row.keypoints_um.items()
    )
