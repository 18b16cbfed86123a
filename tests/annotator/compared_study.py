"""A small study that several people have done: where each of them has everything is known."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from annotations.documents import edits
from annotations.documents.annotation import new_annotation
from annotations.documents.files import save_annotation, ships
from annotations.documents.record import Method
from annotations.documents.study import Study, StudyVolume, ViewingRules, annotation_path, save_study
from annotations.documents.volume_link import reference_to
from annotations.geometry import rotations
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.tool_library import find_tool
from annotations.volumes import fingerprint, open_volume, write_sidecar
from tests.annotator.conftest import write_volume

IDS = ("v001", "v002", "v003")
WORST = "v002"
TOOL = find_tool("magnetic-forceps", ())
ROOMY_UM: Vector = (440.0, 440.0, 300.0)
POSE = ToolPose(
    (8000.0, 8000.0, 7500.0),
    rotations.from_matrix(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
    {"theta1": 20.0, "theta2": 35.0},
)


def offset_um(annotators: Sequence[str], annotator: str, volume_id: str) -> Vector:
    """Return by how much all that somebody placed is off: more on the worst volume."""
    step_um = 400.0 if volume_id == WORST else 25.0 + 5.0 * int(volume_id[1:])
    return (step_um * annotators.index(annotator), 0.0, -step_um * annotators.index(annotator))


def position_um(annotators: Sequence[str], annotator: str, volume_id: str, keypoint: str) -> Vector:
    """Return where somebody has a keypoint."""
    return vector(np.add(keypoints_um(POSE, TOOL)[keypoint], offset_um(annotators, annotator, volume_id)))


def write_compared(
    folder: Path,
    annotators: tuple[str, ...] = ("anna", "ben", "chloe"),
    *,
    methods: tuple[Method, ...] = ("keypoints",),
    viewing: ViewingRules | None = None,
    blind: bool = False,
    ids: Sequence[str] = IDS,
) -> Path:
    """Write a study in which every volume is done by all of its annotators."""
    (folder / "volumes").mkdir(parents=True)
    for number, volume_id in enumerate(ids):
        write_sidecar(write_volume(folder / f"volumes/{volume_id}.npy", seed=number), ROOMY_UM, 2)
    volumes = tuple(StudyVolume(id=each, path=f"volumes/{each}.npy", spacing_um=ROOMY_UM) for each in ids)
    study = Study(
        title="Pilot",
        tool=TOOL.name,
        methods=methods,
        annotators=annotators,
        volumes=volumes,
        viewing=viewing or ViewingRules(),
        blind=blind,
    )
    save_study(study, folder)
    for volume_id in ids:
        for annotator in annotators:
            for method in methods:
                annotate(folder, annotators, annotator, volume_id, method)
    return folder


def annotate(
    folder: Path, annotators: Sequence[str], annotator: str, volume_id: str, method: Method = "keypoints"
) -> Path:
    """Write somebody's finished annotation of a volume."""
    path = annotation_path(folder, annotator, volume_id, method)
    with open_volume(folder / f"volumes/{volume_id}.npy") as volume:
        reference = reference_to(volume, ROOMY_UM, path, fingerprint(volume))
    document = new_annotation(reference, TOOL, annotator, method, ships=ships(TOOL))
    if method == "keypoints":
        for name in TOOL.keypoint_names:
            place_um = position_um(annotators, annotator, volume_id, name)
            document = edits.place_keypoint(document, name, place_um, "clicked")
    else:
        off_um = offset_um(annotators, annotator, volume_id)
        for link, box in link_boxes(POSE, TOOL).items():
            moved = Box(vector(np.add(box.center_um, off_um)), box.size_um, box.rotation_wxyz)
            document = edits.place_box(document, link, moved, "clicked")
    save_annotation(edits.set_status(document, "done"), path, expected="")
    return path
