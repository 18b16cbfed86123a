"""A small study in which nobody is to know the volumes by name: two of three are met twice."""

import re
from pathlib import Path

from annotations.documents.annotation import new_annotation
from annotations.documents.edits import place_box, place_keypoint, set_status
from annotations.documents.files import load_annotation, save_annotation, ships
from annotations.documents.record import Method, Status
from annotations.documents.study import (
    Study,
    StudyVolume,
    ViewingRules,
    annotation_path,
    load_study,
    save_study,
)
from annotations.documents.volume_link import reference_to
from annotations.geometry.boxes import Box
from annotations.geometry.tool_library import find_tool
from annotations.volumes import fingerprint, open_volume
from tests.annotator.conftest import SPACING_UM, write_volume

POSITION_UM = (100.0, 110.0, 120.0)
IDS = ("porcine-liver", "kidney_07", "first")
TELLING = re.compile(
    r"porcine|liver|kidney|left[ ]side|\.npy|\.json|volumes/|annotations/|\brepeat|\bpass \d", re.IGNORECASE
)
"""What nobody who works blindly is to read anywhere; ``first`` is a word of the language as well."""


def write_study(
    folder: Path,
    *,
    blind: bool = True,
    methods: tuple[Method, ...] = ("keypoints",),
    viewing: ViewingRules | None = None,
    repeats: bool = True,
) -> Path:
    """Write a study of anna and ben, and its volumes; all but the last are met twice, if any is."""
    (folder / "volumes" / "left side").mkdir(parents=True)
    volumes = []
    for number, name in enumerate(IDS):
        path = f"volumes/left side/{name}.npy"
        write_volume(folder / path, seed=number)
        volumes.append(
            StudyVolume(id=name, path=path, spacing_um=SPACING_UM, repeats=int(repeats and number < 2))
        )
    study = Study(
        title="Pilot",
        tool="magnetic-forceps",
        methods=methods,
        annotators=("anna", "ben"),
        blind=blind,
        order="shuffled",
        seed=4,
        viewing=viewing or ViewingRules(),
        volumes=tuple(volumes),
    )
    save_study(study, folder)
    return folder


def annotate(
    folder: Path,
    annotator: str,
    volume_id: str,
    *,
    repeat: int = 0,
    method: Method = "keypoints",
    status: Status = "done",
) -> Path:
    """Write somebody's annotation of a volume, with its first part placed if it is done; return its path."""
    study = load_study(folder)
    path = annotation_path(folder, annotator, volume_id, method, repeat)
    path.parent.mkdir(parents=True, exist_ok=True)
    volume = open_volume(folder / study.volume(volume_id).path)
    reference = reference_to(volume, SPACING_UM, path, fingerprint(volume))
    volume.close()
    tool = find_tool(study.tool, ())
    document = new_annotation(reference, tool, annotator, method, ships=ships(tool), repeat=repeat)
    if status == "done" and method == "keypoints":
        document = place_keypoint(document, tool.keypoint_names[0], POSITION_UM, "clicked")
    elif status == "done":
        box = Box(POSITION_UM, (900.0, 400.0, 400.0), (1.0, 0.0, 0.0, 0.0))
        document = place_box(document, tool.links[0].name, box, "clicked")
    expected = load_annotation(path)[1] if path.exists() else ""
    save_annotation(set_status(document, status), path, expected=expected)
    return path
