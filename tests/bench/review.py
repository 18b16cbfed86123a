"""Times the review of many predictions: ``python -m tests.bench.review [--volumes 500]``.

Writes a study of tiny volumes, two annotators and the predictions of two checkpoints into a temporary folder,
then opens it in the real application and uses the panel of predictions as a person would. What counts is how
long the window cannot answer: of each step, until all panes are drawn at their best, the longest stretch
between two turns of its event loop. Reading the files goes on beside it, and is given apart. Prints a table
on standard error and one JSON object on standard output; judges nothing.
"""

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from annotator.looks.redrawing import owes_drawing
from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import print_figures

SPACING_UM = (1087.5, 1631.0, 675.0)
SHAPE = (16, 16, 16)
ERROR_UM, FLOOR_UM = 300.0, 60.0
TIMES = 30
PATIENCE_S = 120.0
# In so many turns of the event loop without anything more to come what was asked for last is painted.
_LAST_TURNS = 3

Stretch = tuple[float, float]
"""How long something took, in ms: by the clock, and of the processor by this thread alone."""


def write_study(folder: Path, volumes: int) -> Path:
    """Write a study in which everything is noise of a known size, and return its second checkpoint's file."""
    from annotations.documents import edits
    from annotations.documents.annotation import new_annotation
    from annotations.documents.files import save_annotation
    from annotations.documents.record import changed
    from annotations.documents.study import Study, StudyVolume, annotation_path, save_study
    from annotations.documents.volume_link import reference_to
    from annotations.geometry.frames import vector
    from annotations.geometry.kinematics import ToolPose, keypoints_um
    from annotations.geometry.rotations import about_axis
    from annotations.geometry.tool_library import find_tool
    from annotations.prediction.checkpoint import load_checkpoint, save_checkpoint
    from annotations.prediction.predicted_pose import fit_prediction
    from annotations.prediction.prediction import prediction_of
    from annotations.prediction.prediction_file import save_prediction, study_prediction_path
    from annotations.prediction.predictor import PredictedKeypoints, StageTimes
    from annotations.prediction.shipped import shipped_checkpoint
    from annotations.prediction.volume_prediction import reference_to_checkpoint
    from annotations.volumes import fingerprint, open_volume, write_sidecar

    tool = find_tool("magnetic-forceps")
    shipped_path = shipped_checkpoint(tool.name)
    assert shipped_path is not None
    shipped = load_checkpoint(shipped_path)
    other = save_checkpoint(folder / "other.onnx", changed(shipped.description, name="other"), shipped.model)
    ids = [f"volume{number:04}" for number in range(volumes)]
    people = ("anna", "ben")
    (folder / "volumes").mkdir()
    random = np.random.default_rng(1)
    pose = ToolPose((8e3, 12e3, 4e3), about_axis((0, 0, 1), 90.0), {"theta1": 40.0, "theta2": 30.0})
    true_um = np.array(list(keypoints_um(pose, tool).values()))
    names = tool.keypoint_names
    for volume_id in ids:
        path = folder / f"volumes/{volume_id}.npy"
        np.save(path, random.integers(0, 255, SHAPE).astype(np.uint8))
        write_sidecar(path, SPACING_UM, 2)
        with open_volume(path) as volume:
            mark = fingerprint(volume)
            for person in people:
                file = annotation_path(folder, person, volume_id, "keypoints")
                made = new_annotation(
                    reference_to(volume, SPACING_UM, file, mark), tool, person, "keypoints", ships=True
                )
                placed_um = true_um + random.normal(scale=FLOOR_UM, size=true_um.shape)
                for name, position_um in zip(names, placed_um, strict=True):
                    made = edits.place_keypoint(made, name, vector(position_um), "clicked")
                save_annotation(edits.set_status(made, "done"), file, expected="")
            for checkpoint in (shipped, other):
                file = study_prediction_path(
                    folder, checkpoint.description.name, checkpoint.sha256, volume_id
                )
                found = PredictedKeypoints(
                    names,
                    true_um + random.normal(scale=ERROR_UM, size=true_um.shape),
                    random.uniform(0.5, 1.0, len(names)),
                    random.uniform(0.1, 0.9, len(names)),
                    random.uniform(300.0, 900.0, true_um.shape),
                    StageTimes(0.0, 0.0, 0.0),
                )
                save_prediction(
                    prediction_of(
                        found,
                        fit_prediction(found, checkpoint.description),
                        reference_to(volume, SPACING_UM, file, mark),
                        reference_to_checkpoint(checkpoint, file),
                        tool,
                    ),
                    file,
                )
    save_study(
        Study(
            title="bench",
            tool=tool.name,
            annotators=people,
            volumes=tuple(
                StudyVolume(id=each, path=f"volumes/{each}.npy", spacing_um=SPACING_UM) for each in ids
            ),
        ),
        folder,
    )
    return other.path


class Bench(DrivenWindow):
    """A window of which it is noted for how long it cannot answer."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, "rita")
        self.figures: dict[str, float] = {}

    def step_ms(self, work: Callable[[], object], ready: Callable[[], bool] = lambda: True) -> Stretch:
        """Return the longest stretch in which the window could not answer, until something holds.

        Nothing is left to be drawn by then: what is put off to a later turn of the event loop counts, too.
        """
        stretches = [self._stretch(work)]
        ends = time.perf_counter() + PATIENCE_S
        turns = 0
        while turns < _LAST_TURNS:
            if time.perf_counter() > ends:
                raise TimeoutError("the window did not become ready")
            stretches.append(self._stretch(self.application.processEvents))
            turns = turns + 1 if ready() and not self.session.jobs.running and self._is_drawn else 0
        return max(by_clock for by_clock, _ in stretches), max(of_thread for _, of_thread in stretches)

    @property
    def _is_drawn(self) -> bool:
        """Whether all panes and panels are drawn as they are to stay, the scene in the size that it has."""
        is_sharp = all(view.is_sharp for view in self.window.slices)
        return is_sharp and self.window.scene.is_at_rest and not owes_drawing(self.window)

    def note(self, name: str, steps: Sequence[Stretch]) -> None:
        """Note the median and the longest of several steps."""
        for place, kind in enumerate(("", "_cpu")):
            figures = [step[place] for step in steps]
            self.figures[f"{name}{kind}_median_ms"] = statistics.median(figures)
            self.figures[f"{name}{kind}_max_ms"] = max(figures)

    def _stretch(self, work: Callable[[], object]) -> Stretch:
        begun, begun_cpu = time.perf_counter(), time.thread_time()
        work()
        return 1000 * (time.perf_counter() - begun), 1000 * (time.thread_time() - begun_cpu)


def measure(folder: Path, other_path: Path) -> dict[str, float]:
    """Open the study, and use the panel."""
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QLineEdit, QTabWidget, QTreeView

    from annotations.prediction.checkpoint import load_checkpoint
    from annotations.prediction.errors.study_errors import Truth
    from annotations.prediction.shipped import shipped_checkpoint

    bench = Bench(folder / "bench")
    session, window = bench.session, bench.window
    reviewing, predicting = session.reviewing, session.predicting
    window.prepare_scene()
    bench.step_ms(lambda: session.open_path(folder), lambda: session.volume is not None)
    shipped_path = shipped_checkpoint("magnetic-forceps")
    assert shipped_path is not None
    for path in (other_path, shipped_path):
        checkpoint = load_checkpoint(path)
        bench.step_ms(lambda: predicting.load(checkpoint))  # noqa: B023
    # Of two people who are done neither speaks for a volume unless somebody says so.
    predicting.choose_truth(Truth(annotator="anna"))
    begun = time.perf_counter()
    bench.note("beside_computing", [bench.step_ms(reviewing.compute, lambda: reviewing.table is not None)])
    bench.figures["compute_s"] = time.perf_counter() - begun
    show = window.actions_by_name["panel_predictions"].trigger
    bench.note("open_panel_first", [bench.step_ms(show)])
    bench.note("open_panel", [bench.step_ms(show) for _ in range(2 * TIMES)][1::2])
    table = window.findChild(QTreeView, "errors_list")
    tabs = window.findChild(QTabWidget, "predictions_tabs")
    text = window.findChild(QLineEdit, "errors_filter")
    assert table is not None
    assert tabs is not None
    assert text is not None
    bench.note(
        "sort",
        [
            bench.step_ms(partial(table.sortByColumn, column, order))
            for column in range(table.header().count())
            for order in (Qt.SortOrder.AscendingOrder, Qt.SortOrder.DescendingOrder)
        ],
    )
    table.sortByColumn(1, Qt.SortOrder.DescendingOrder)
    bench.note("filter", [bench.step_ms(partial(text.setText, each)) for each in ("00", "001", "")])
    for name, panel in (("walk", True), ("walk_without_panel", False)):
        window._docks["predictions"].setVisible(panel)
        bench.note(name, walked(bench))
    window._docks["predictions"].setVisible(True)
    table.setFocus()
    bench.note(
        "arrow", [bench.step_ms(partial(QTest.keyClick, table, Qt.Key.Key_Down)) for _ in range(TIMES)]
    )
    for tab, name in ((1, "plots"), (2, "side_by_side")):
        bench.note(name, [bench.step_ms(partial(tabs.setCurrentIndex, tab))])
    tabs.setCurrentIndex(0)
    judge = window.actions_by_name["verdict_model_wrong"].trigger
    bench.note("verdict", [bench.step_ms(judge) for _ in range(TIMES)])
    session.shut_down()
    return bench.figures


def walked(bench: Bench) -> list[Stretch]:
    """Return what each step of a walk takes, from the first volume of the order on."""
    reviewing = bench.session.reviewing
    first, *order = reviewing.order[: TIMES + 1]
    bench.step_ms(lambda: reviewing.open(first), lambda: reviewing.open_volume == first)
    return [
        bench.step_ms(partial(reviewing.step, 1), lambda volume=volume: reviewing.open_volume == volume)  # type: ignore[misc]
        for volume in order
    ]


def main() -> None:
    """Write the study, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--volumes", type=int, default=500)
    parser.add_argument("--folder", type=Path, help="keep the study there, and use the one that is there")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        other_path = folder / "other.onnx"
        if not (folder / "study.toml").exists():
            other_path = write_study(folder, arguments.volumes)
        figures = measure(folder, other_path)
    print_figures(figures)
    # Not to wait for threads that may be busy.
    os._exit(0)


if __name__ == "__main__":
    main()
