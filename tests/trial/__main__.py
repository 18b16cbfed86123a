"""Compares keypoints, boxes and pose mode: ``python -m tests.trial [--count N] [--seed S]``.

Synthesises a study whose truth is known, opens it in the real window, and lets a simulated annotator work
with mouse and keys alone. Needs a display: without one, put ``xvfb-run -a -s "-screen 0 1920x1080x24"``
before the command. Prints a table on standard error and one JSON object on standard output.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

SHAPE = (274, 484, 288)
"""A quarter of the scanner's full volume along each axis: the picture on the screen is nearly the same."""


def _errors(document: Any, pose: Any, tool: Any) -> dict[str, float]:
    """Return how far a document's keypoints and pose targets are from a true pose."""
    from annotations.documents.representations import document_targets, keypoint_positions_um
    from annotations.fitting.pose_fit import fit_document
    from annotations.geometry.angles import angle_deg
    from annotations.geometry.boxes import hinge_axes
    from annotations.geometry.kinematics import keypoints_um, link_boxes
    from annotations.geometry.targets import pose_targets

    true_um = keypoints_um(pose, tool)
    found_um = keypoint_positions_um(document, tool)
    distances = [float(np.linalg.norm(np.subtract(found_um[name], true_um[name]))) for name in true_um]
    truth = pose_targets(true_um, tool, hinge_axes(link_boxes(pose, tool), tool))
    targets = document_targets(document, tool)
    fit = fit_document(document, tool)
    assert fit is not None
    assert targets.position_um is not None
    assert truth.position_um is not None
    assert targets.orientation is not None
    assert truth.orientation is not None
    figures = {
        "keypoint_um": statistics.mean(distances),
        "fitted_keypoint_um": statistics.mean(
            float(np.linalg.norm(np.subtract(fit.keypoints_um[name], true_um[name]))) for name in true_um
        ),
        "position_um": float(np.linalg.norm(np.subtract(targets.position_um, truth.position_um))),
        "orientation_deg": angle_deg(targets.orientation, truth.orientation),
    }
    for name, angle in truth.angles_deg.items():
        figures[f"{name}_deg"] = abs(targets.angles_deg[name] - angle)
    for name, angle in targets.signed_angles_deg.items():
        figures[f"{name}_signed_deg"] = abs(angle - truth.signed_angles_deg[name])
    return figures


class Trial:
    """One window, and everything that is done in it."""

    def __init__(self, folder: Path) -> None:
        from annotator.session import Session
        from annotator.session.options import SessionOptions
        from annotator.settings import Settings
        from annotator.startup.start import make_application
        from annotator.window.main_window import MainWindow

        self.application = make_application()
        self.session = Session(
            SessionOptions(
                annotator_name="nobody",
                autosave_s=0.0,
                recovery_folder=folder / "recovery",
                level_cache_folder=folder / "levels",
            )
        )
        self.window = MainWindow(self.session, Settings(folder / "settings.ini"), folder / "log")
        self.window.resize(1920, 1080)
        self.window.show()
        self.window.activateWindow()
        # Keys act in the active window alone.
        self.wait(self.window.isActiveWindow)
        self.window.prepare_scene()
        self.wait(lambda: not self.session.jobs.running)

    def wait(self, ready: Callable[[], bool], patience_s: float = 120) -> None:
        """Run the event loop until something holds."""
        limit = time.perf_counter() + patience_s
        while not ready():
            if time.perf_counter() > limit:
                raise TimeoutError("the window did not become ready")
            self.application.processEvents()

    def annotate(
        self, study: Path, number: int, way: str, pose: Any, tool: Any, seed: int
    ) -> dict[str, float]:
        """Annotate one volume from nothing, save it, and compare what the file holds with the truth."""
        from PySide6.QtCore import Qt

        from annotations.documents.files import load_annotation
        from tests.trial.methods import METHODS
        from tests.trial.person import Person

        session = self.session
        session.set_annotator_name(way)
        session.set_method("boxes" if way == "boxes" else "keypoints")
        session.open_path(study)
        self.wait(lambda: session.annotator_name == way and session.volume is not None)
        self.wait(lambda: not session.jobs.running)
        session.open_item(number)
        self.wait(lambda: session.current_index == number and not session.jobs.running)
        self.window.slices[2].setFocus()
        session.set_mode("navigate")
        person = Person(self.window, seed)
        began_s = time.perf_counter()
        METHODS[way](person, session, pose, tool)
        person.press(Qt.Key.Key_D, Qt.KeyboardModifier.ControlModifier)
        program_s = time.perf_counter() - began_s
        assert session.annotation_path is not None
        document, _ = load_annotation(session.annotation_path)
        return {
            **{kind: float(person.done[kind]) for kind in ("click", "drag", "key", "notch")},
            "gestures": float(person.gestures),
            "person_s": person.seconds,
            "program_s": program_s,
            **_errors(document, pose, tool),
        }

    def close(self) -> None:
        """Close the window and end the session."""
        self.window.close()
        self.session.shut_down()


def main() -> None:
    """Run the trial and print."""
    parser = argparse.ArgumentParser(prog="python -m tests.trial", description=__doc__)
    parser.add_argument("--count", type=int, default=10, help="how many volumes (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of volumes, eyes and hands (%(default)s)")
    options = parser.parse_args()
    from annotator.startup import toolkit

    toolkit.prepare(headless=False)
    from annotations.geometry.tool_library import shipped_tools
    from annotations.synthesis.grid import Grid
    from annotations.synthesis.scene import SceneSeed, random_scene
    from annotations.synthesis.synthetic_study import write_study
    from tests.trial.methods import METHODS

    tool = shipped_tools()["magnetic-forceps"]
    rows: dict[str, list[dict[str, float]]] = {}
    with tempfile.TemporaryDirectory(prefix="oct-annotator-trial-") as name:
        study = Path(name) / "study"
        write_study(study, tool, count=options.count, seed=options.seed, shape=SHAPE)
        grid = Grid.over_workspace(SHAPE)
        trial = Trial(Path(name))
        try:
            for way in METHODS:
                rows[way] = [
                    trial.annotate(
                        study,
                        number,
                        way,
                        random_scene(tool, SceneSeed(options.seed, number), grid).pose,
                        tool,
                        seed=1000 * options.seed + number,
                    )
                    for number in range(options.count)
                ]
        finally:
            trial.close()
    _print(rows)


def _print(rows: dict[str, list[dict[str, float]]]) -> None:
    names = list(dict.fromkeys(name for row in rows.values() for name in row[0]))
    sys.stderr.write(f"{'median (largest)':<24}" + "".join(f"{way:>24}" for way in rows) + "\n")
    for name in names:
        cells = []
        for row in rows.values():
            values = [each[name] for each in row if name in each]
            cells.append(f"{statistics.median(values):.2f} ({max(values):.2f})" if values else "—")
        sys.stderr.write(f"{name:<24}" + "".join(f"{cell:>24}" for cell in cells) + "\n")
    sys.stdout.write(json.dumps(rows) + "\n")


if __name__ == "__main__":
    main()
