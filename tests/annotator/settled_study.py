"""A small study that three people have annotated: in the first volume carl has exchanged two keypoints."""

from pathlib import Path

import numpy as np

from annotations.documents import edits
from annotations.documents.annotation import Annotation, new_annotation
from annotations.documents.files import load_annotation, save_annotation, ships
from annotations.documents.record import Method, Status
from annotations.documents.study import Study, StudyVolume, ViewingRules, annotation_path, save_study
from annotations.documents.volume_link import reference_to
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, vector
from annotations.geometry.tool_library import find_tool
from annotations.volumes import fingerprint, open_volume
from tests.annotator.conftest import SPACING_UM, write_volume

IDS = ("v001", "v002", "v003")
PEOPLE = ("anna", "ben", "carl")
LATE_IMPORTS_MS = 60_000
"""How long the first ranking may take on a slow machine: it imports what only few sessions need."""

METHODS: tuple[Method, ...] = ("keypoints", "boxes")
TOOL = find_tool("magnetic-forceps")


def position_um(number: int, person: str) -> Vector:
    """Return where somebody has the keypoint of a number: everybody a little elsewhere."""
    return (80.0 + 90.0 * number, 300.0 + 6.0 * PEOPLE.index(person), 200.0)


def box_of(number: int, person: str) -> Box:
    """Return somebody's box of the link of a number."""
    center_um = (150.0 + 150.0 * number, 300.0 + 6.0 * PEOPLE.index(person), 200.0)
    return Box(center_um, (120.0, 60.0, 60.0), (1.0, 0.0, 0.0, 0.0))


def write_settled_study(
    folder: Path,
    *,
    viewing: ViewingRules | None = None,
    blind: bool = False,
    without: tuple[str, ...] = (),
) -> Path:
    """Write the study, its volumes, and what everybody has done, apart from those named in ``without``."""
    (folder / "volumes").mkdir(parents=True)
    volumes = []
    for number, name in enumerate(IDS):
        write_volume(folder / "volumes" / f"{name}.npy", seed=number)
        volumes.append(StudyVolume(id=name, path=f"volumes/{name}.npy", spacing_um=SPACING_UM))
    study = Study(
        title="Pilot",
        tool=TOOL.name,
        methods=METHODS,
        annotators=PEOPLE,
        blind=blind,
        viewing=viewing or ViewingRules(reviewers=("rita",)),
        volumes=tuple(volumes),
    )
    save_study(study, folder)
    for person in PEOPLE:
        for name in IDS if person not in without else ():
            write_annotation(folder, person, name, "keypoints")
            write_annotation(folder, person, name, "boxes")
    return folder


def write_annotation(
    folder: Path, person: str, volume_id: str, method: Method, *, status: Status = "done"
) -> Path:
    """Write what somebody has placed in a volume, and return its path."""
    path = annotation_path(folder, person, volume_id, method)
    path.parent.mkdir(parents=True, exist_ok=True)
    with open_volume(folder / "volumes" / f"{volume_id}.npy") as volume:
        reference = reference_to(volume, SPACING_UM, path, fingerprint(volume))
    document = new_annotation(reference, TOOL, person, method, ships=ships(TOOL))
    if method == "keypoints":
        for number, name in enumerate(TOOL.keypoint_names):
            document = edits.place_keypoint(document, name, position_um(number, person), "clicked")
        if (person, volume_id) == ("carl", "v001"):
            document = edits.relabel(document, {"k2": "k3", "k3": "k2"})
    else:
        for number, link in enumerate(TOOL.links):
            box = box_of(number, person)
            turned = (person, volume_id, link.name) == ("ben", "v001", "link1")
            document = edits.place_box(document, link.name, box.turned_over if turned else box, "dragged")
    if (person, volume_id, method) == ("ben", "v003", "keypoints"):
        document = edits.set_flag(document, "Is the tip in the shadow?")
    save_annotation(edits.set_status(document, status), path, expected=_identity(path))
    return path


def move(folder: Path, person: str, volume_id: str, name: str, by_um: Vector) -> Annotation:
    """Let somebody move a keypoint of what they have done, behind everybody's back."""
    path = annotation_path(folder, person, volume_id, "keypoints")
    document, identity = load_annotation(path)
    present_um = document.positions_um[name]
    moved = edits.place_keypoint(document, name, vector(np.add(present_um, by_um)), "dragged")
    save_annotation(moved, path, expected=identity)
    return moved


def contents(folder: Path) -> dict[str, bytes]:
    """Return every file of the annotators, byte by byte."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for person in PEOPLE
        for path in sorted((folder / "annotations" / person).glob("*.json"))
    }


def _identity(path: Path) -> str:
    return load_annotation(path)[1] if path.exists() else ""
