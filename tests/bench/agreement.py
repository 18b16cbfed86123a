"""Times the comparison of many annotators: ``python -m tests.bench.agreement``.

Writes a synthetic study of annotation files, without volumes, into a temporary folder; then collects and
compares them, as `annotations agreement` does. The baseline is to read the same files and parse their JSON,
which nothing that reads them can go below. Each step has a process of its own, so that its peak of memory is
its own. Prints a table on standard error and one JSON object on standard output; judges nothing.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SIGMA_UM = 50.0
SPACING_UM = (15.9, 13.5, 9.4)


def write_study(folder: Path, annotators: int, volumes: int, method: str) -> None:
    """Write a study whose annotators place everything with noise of a known size."""
    from annotations.documents import edits
    from annotations.documents.annotation import VolumeReference, new_annotation
    from annotations.documents.files import annotation_bytes
    from annotations.documents.study import Study, StudyVolume, save_study
    from annotations.geometry.boxes import Box
    from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
    from annotations.geometry.rotations import about_axis
    from annotations.geometry.tool_library import find_tool

    tool = find_tool("magnetic-forceps")
    names = [f"annotator{number:02}" for number in range(annotators)]
    ids = [f"volume{number:05}" for number in range(volumes)]
    reference = VolumeReference(
        path="../../volumes/ID.npy",
        shape=(1096, 1936, 1152),
        dtype="uint8",
        spacing_um=SPACING_UM,
        fingerprint="FINGERPRINT",
    )
    pose = ToolPose((9e3, 12e3, 3e3), about_axis((0, 0, 1), 40.0), {"theta1": 40.0, "theta2": 30.0})
    document = new_annotation(
        reference, tool, "ANNOTATOR", "boxes" if method == "boxes" else "keypoints", ships=True
    )
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
    for name in names:
        own = folder / "annotations" / name
        own.mkdir(parents=True)
        for number, volume_id in enumerate(ids):
            filled = (
                text.replace("ANNOTATOR", name)
                .replace("FINGERPRINT", f"{number:064x}")
                .replace("ID", volume_id)
            )
            placed_um = centers_um + random.normal(scale=SIGMA_UM, size=centers_um.shape)
            for index, (x, y, z) in enumerate(placed_um.tolist()):
                filled = filled.replace(f"@{index}", f"{x}, {y}, {z}")
            (own / f"{volume_id}.{method}.json").write_text(filled)
    save_study(
        Study(
            title="bench",
            tool=tool.name,
            methods=("keypoints", "boxes"),
            annotators=tuple(names),
            volumes=tuple(StudyVolume(id=each, path=f"volumes/{each}.npy") for each in ids),
        ),
        folder,
    )


def parse_only(folder: Path) -> dict[str, float]:
    """Read every file and parse its JSON."""
    with Timer("parse") as timer:
        for path in folder.glob("annotations/*/*.json"):
            json.loads(path.read_bytes())
    return timer.figures


def collect_and_compare(folder: Path) -> dict[str, float]:
    """Collect and compare, as the program does."""
    from annotations.agreement.collecting import collect
    from annotations.agreement.comparison import compare

    with Timer("collect") as collecting:
        material = collect(folder)
    with Timer("compare") as comparing:
        compare(material)
    return {
        "files": float(len(material.inputs)),
        "left_out": float(len(material.left_out)),
        **collecting.figures,
        **comparing.figures,
    }


class Timer:
    """Notes what is used within it: time, the processor's time, which other work does not add to, and memory.

    The memory is the largest that this process has held so far (Linux counts it in KiB).
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self.figures: dict[str, float] = {}

    def __enter__(self) -> "Timer":
        self._began_s = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_error: object) -> None:
        self.figures = {
            f"{self._name}_s": time.perf_counter() - self._began_s[0],
            f"{self._name}_cpu_s": time.process_time() - self._began_s[1],
            f"{self._name}_peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        }


STEPS = {"parse": parse_only, "compare": collect_and_compare}


def main() -> None:
    """Write, measure and print."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.agreement", description=__doc__)
    parser.add_argument("--annotators", type=int, default=20)
    parser.add_argument("--volumes", type=int, default=10_000)
    parser.add_argument("--method", choices=("keypoints", "boxes"), default="keypoints")
    parser.add_argument("--step", nargs=2, metavar=("STEP", "FOLDER"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.step:
        step, folder = options.step
        sys.stdout.write(json.dumps(STEPS[step](Path(folder))))
        return
    figures: dict[str, float] = {}
    with tempfile.TemporaryDirectory(prefix="oct-annotator-bench-") as name:
        began_s = time.perf_counter()
        write_study(Path(name), options.annotators, options.volumes, options.method)
        figures["write_s"] = time.perf_counter() - began_s
        for step in STEPS:
            command = [sys.executable, "-m", "tests.bench.agreement", "--step", step, name]
            figures |= json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    for figure, value in figures.items():
        sys.stderr.write(f"{figure:<20}{value:10.1f}\n")
    sys.stdout.write(json.dumps(figures) + "\n")


if __name__ == "__main__":
    main()
