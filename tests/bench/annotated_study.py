"""A study of many volumes that several people have annotated, with noise of a known size."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from annotations.documents.record import Method

SIGMA_UM = 50.0
REVIEWER = "rita"
TINY_SHAPE = (32, 32, 32)
"""Of volumes that cost next to nothing: what is left is the cost of the study."""


def write_annotated_study(
    folder: Path, annotators: Sequence[str], volumes: int, method: Method, *, with_volumes: bool = False
) -> None:
    """Write a study whose annotators have placed everything and are done.

    Parameters
    ----------
    with_volumes : bool
        Whether the volumes are there too, tiny ones of noise; else there are annotations alone.
    """
    from annotations.documents import edits
    from annotations.documents.annotation import VolumeReference, new_annotation
    from annotations.documents.files import annotation_bytes
    from annotations.documents.study import Study, StudyVolume, ViewingRules, save_study
    from annotations.geometry.boxes import Box
    from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
    from annotations.geometry.rotations import about_axis
    from annotations.geometry.tool_library import find_tool
    from annotations.synthesis import FULL_SHAPE
    from annotations.volumes import OMES_SPACING_UM

    tool = find_tool("magnetic-forceps")
    ids = [f"volume{number:05}" for number in range(volumes)]
    shape, spacing_um = FULL_SHAPE, OMES_SPACING_UM
    marks = [f"{number:064x}" for number in range(volumes)]
    if with_volumes:
        shape = TINY_SHAPE
        x_um, y_um, z_um = np.multiply(FULL_SHAPE, OMES_SPACING_UM) / shape
        spacing_um = (float(x_um), float(y_um), float(z_um))
        marks = _write_tiny_volumes(folder / "volumes", ids)
    reference = VolumeReference(
        path="../../volumes/ID.npy",
        shape=shape,
        dtype="uint8",
        spacing_um=spacing_um,
        fingerprint="FINGERPRINT",
    )
    pose = ToolPose((9e3, 12e3, 3e3), about_axis((0, 0, 1), 40.0), {"theta1": 40.0, "theta2": 30.0})
    document = new_annotation(reference, tool, "ANNOTATOR", method, ships=True)
    places = {}
    for index, (name, position_um) in enumerate(keypoints_um(pose, tool).items()):
        if method == "keypoints":
            places[name] = position_um
            document = edits.place_keypoint(document, name, (1e5 + index, 1e5, 1e5), "clicked")
    for index, (link, box) in enumerate(link_boxes(pose, tool).items()):
        if method == "boxes":
            places[link] = box.center_um
            moved = Box((1e5 + index, 1e5, 1e5), box.size_um, box.rotation_wxyz)
            document = edits.place_box(document, link, moved, "clicked")
    text = annotation_bytes(edits.set_status(document, "done")).decode()
    for index in range(len(places)):
        text = text.replace(f"[{1e5 + index}, 100000.0, 100000.0]", f"[@{index}]")
    centers_um = np.array(list(places.values()))
    random = np.random.default_rng(1)
    for name in annotators:
        own = folder / "annotations" / name
        own.mkdir(parents=True)
        for number, volume_id in enumerate(ids):
            filled = (
                text.replace("ANNOTATOR", name).replace("FINGERPRINT", marks[number]).replace("ID", volume_id)
            )
            placed_um = centers_um + random.normal(scale=SIGMA_UM, size=centers_um.shape)
            for index, (x, y, z) in enumerate(placed_um.tolist()):
                filled = filled.replace(f"@{index}", f"{x}, {y}, {z}")
            (own / f"{volume_id}.{method}.json").write_text(filled)
    save_study(
        Study(
            title="bench",
            tool=tool.name,
            methods=(method,),
            annotators=tuple(annotators),
            viewing=ViewingRules(reviewers=(REVIEWER,)),
            volumes=tuple(
                StudyVolume(id=each, path=f"volumes/{each}.npy", spacing_um=spacing_um) for each in ids
            ),
        ),
        folder,
    )


def _write_tiny_volumes(folder: Path, ids: Sequence[str]) -> list[str]:
    """Write volumes of noise, no two alike, and return their fingerprints."""
    from annotations.volumes import fingerprint, open_volume

    folder.mkdir(parents=True)
    random = np.random.default_rng(1)
    marks = []
    for volume_id in ids:
        path = folder / f"{volume_id}.npy"
        np.save(path, random.integers(0, 255, TINY_SHAPE).astype(np.uint8))
        with open_volume(path) as volume:
            marks.append(fingerprint(volume))
    return marks
