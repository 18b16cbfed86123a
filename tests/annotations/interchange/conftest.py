"""What the tests of files for and from other programs share: point lists, and studies without volumes."""

import csv
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from annotations.documents.annotation import Annotation, VolumeReference, new_annotation, with_all_parts
from annotations.documents.edits import place_box, place_keypoint, set_status
from annotations.documents.files import save_annotation, ships
from annotations.documents.record import Method, changed
from annotations.documents.study import Study, StudyVolume, annotation_path, save_study
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import about_axis
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools
from annotations.interchange.training_file import Exported

SPACING_UM = (15.9, 13.5, 9.4)
SHAPE = (1096, 1936, 1152)

HEADER = (
    "# Markups fiducial file version = 4.6\n"
    "# CoordinateSystem = {frame}\n"
    "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
)


@pytest.fixture
def write_fcsv(tmp_path: Path) -> Callable[..., Path]:
    """Write a point list as Slicer does: label, description and position of each point."""

    def write(
        name: str, points: Sequence[tuple[str, str, Sequence[float]]], frame: object = 0, ending: str = "\n"
    ) -> Path:
        lines = [
            f"vtkMRMLMarkupsFiducialNode_{number},{x},{y},{z},0,0,0,1,1,1,0,{label},{description},"
            for number, (label, description, (x, y, z)) in enumerate(points)
        ]
        path = tmp_path / name
        text = HEADER.format(frame=frame) + "\n".join(lines) + "\n"
        path.write_bytes(text.replace("\n", ending).encode())
        return path

    return write


@pytest.fixture
def forceps() -> ToolSpecification:
    return shipped_tools()["magnetic-forceps"]


def pose_number(number: int) -> ToolPose:
    """A bent tool inside the volume, another one for each number."""
    draw = np.random.default_rng(number)
    base_um = draw.uniform((6000, 8000, 4000), (9000, 11000, 6000))
    return ToolPose(
        (float(base_um[0]), float(base_um[1]), float(base_um[2])),
        about_axis((1, 2, 3), float(draw.uniform(40, 120))),
        {"theta1": float(draw.uniform(-80, -10)), "theta2": float(draw.uniform(10, 80))},
    )


class StudyFolder:
    """A study on disk whose volumes are not there: documents need no more than what is said of them."""

    def __init__(self, folder: Path, tool: ToolSpecification, count: int, **fields: object) -> None:
        self.folder = folder
        self.tool = tool
        volumes = tuple(
            StudyVolume(id=f"v{number:03d}", path=f"volumes/v{number:03d}.npy")
            for number in range(1, count + 1)
        )
        self.study = Study(
            title="A study", tool=tool.name, **({"annotators": ("anna", "ben"), "volumes": volumes} | fields)
        )
        save_study(self.study, folder)

    def document(
        self, number: int, annotator: str = "anna", method: Method = "keypoints", *, repeat: int = 0
    ) -> Annotation:
        """A document whose every part is placed, and that is done."""
        reference = VolumeReference(
            path=f"../../volumes/v{number:03d}.npy",
            shape=SHAPE,
            dtype="uint8",
            spacing_um=SPACING_UM,
            fingerprint=f"{number:064x}",
        )
        document = new_annotation(
            reference, self.tool, annotator, method, ships=ships(self.tool), repeat=repeat
        )
        pose = pose_number(number)
        if method == "boxes":
            for link, box in link_boxes(pose, self.tool).items():
                document = place_box(with_all_parts(document, self.tool), link, box, "clicked")
        else:
            for name, position_um in keypoints_um(pose, self.tool).items():
                document = place_keypoint(document, name, position_um, "clicked")
        return set_status(document, "done")

    def save(self, document: Annotation) -> Path:
        volume_id = Path(document.volume.path).stem
        path = annotation_path(self.folder, document.annotator, volume_id, document.method, document.repeat)
        save_annotation(document, path, expected="", overwrite=True)
        return path

    def add(
        self, number: int, annotator: str = "anna", method: Method = "keypoints", **changes: object
    ) -> Path:
        """Save a document, with some of its fields changed."""
        return self.save(changed(self.document(number, annotator, method), **changes))


@pytest.fixture
def make_study(tmp_path: Path, forceps: ToolSpecification) -> Callable[..., StudyFolder]:
    def make(count: int = 3, tool: ToolSpecification = forceps, **fields: object) -> StudyFolder:
        return StudyFolder(tmp_path / "study", tool, count, **fields)

    return make


def read_hdf5(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """All datasets, text as text, and the file's attributes."""
    datasets: dict[str, Any] = {}

    def keep(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            datasets[name] = item.asstr()[()] if h5py.check_string_dtype(item.dtype) else item[()]

    with h5py.File(path) as file:
        file.visititems(keep)
        return datasets, dict(file.attrs)


def read_csv(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def reasons(exported: Exported) -> list[tuple[str, str]]:
    return [(one.volume_id, one.kind) for one in exported.left_out]
