"""Annotation files to compare."""

from pathlib import Path
from typing import Any

from annotations.agreement.collecting import collect
from annotations.agreement.compared import Material
from annotations.documents.annotation import Annotation, VolumeReference, new_annotation
from annotations.documents.edits import place_box, place_keypoint, set_status
from annotations.documents.files import annotation_bytes
from annotations.documents.record import Method, changed
from annotations.documents.study import Study, StudyVolume, annotation_path, save_study
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import about_axis
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool

FORCEPS = find_tool("magnetic-forceps")
POSE = ToolPose((4e3, 5e3, 3e3), about_axis((1, 2, 3), 40.0), {"theta1": 35.0, "theta2": 50.0})
SPACING_UM = (15.9, 13.5, 9.4)


def document(
    annotator: str = "anna",
    volume: str = "v1",
    method: Method = "keypoints",
    *,
    tool: ToolSpecification = FORCEPS,
    spacing_um: tuple[float, float, float] = SPACING_UM,
    fingerprint: str | None = None,
    **fields: Any,
) -> Annotation:
    """Return a document whose annotator placed everything; of an own volume for each name."""
    reference = VolumeReference(
        path=f"../../volumes/{volume}.npy",
        shape=(1096, 1936, 1152),
        dtype="uint8",
        spacing_um=spacing_um,
        fingerprint=fingerprint or f"{volume:0>64}",
    )
    ships = tool is FORCEPS
    made = new_annotation(reference, tool, annotator, method, ships=ships, repeat=fields.pop("repeat", 0))
    if tool.joints and method == "keypoints":
        for name, position_um in keypoints_um(POSE, tool).items():
            made = place_keypoint(made, name, position_um, "clicked")
    elif tool.joints:
        for link, box in link_boxes(POSE, tool).items():
            made = place_box(made, link, box, "clicked")
    else:
        for name in tool.keypoint_names:
            made = place_keypoint(made, name, (1.0, 2.0, 3.0), "clicked")
    return changed(set_status(made, "done"), **fields)


def with_part(whole: Annotation, index: int, **fields: Any) -> Annotation:
    parts = list(whole.parts)
    parts[index] = changed(parts[index], **fields)
    return changed(whole, **{whole.method: tuple(parts)})


def write(path: Path, content: Annotation | bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else annotation_bytes(content))
    return path


class WrittenStudy:
    """A study without volumes, with volumes v2 and v1 and the annotators ben and anna."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        save_study(
            Study(
                title="Trial",
                tool=FORCEPS.name,
                methods=("keypoints", "boxes"),
                annotators=("ben", "anna"),
                volumes=tuple(StudyVolume(id=name, path=f"volumes/{name}.npy") for name in ("v2", "v1")),
            ),
            folder,
        )

    def add(self, *documents: Annotation, volume: str | None = None) -> None:
        for each in documents:
            volume_id = volume or Path(each.volume.path).stem
            path = annotation_path(self.folder, each.annotator, volume_id, each.method, each.repeat)
            write(path, each)

    def collect(self, **options: Any) -> Material:
        return collect(self.folder, **options)

    def reasons(self) -> dict[str, str]:
        return {each.path.removeprefix("annotations/"): each.reason for each in self.collect().left_out}
