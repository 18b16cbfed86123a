"""Times the real application on a full-size volume: ``python -m tests.bench [VOLUME.npy]``.

Without a volume, one of 1096 × 1936 × 1152 voxels (2.4 GB) is synthesised into a temporary folder first.
Needs a display: without one, put ``xvfb-run -a -s "-screen 0 1600x1000x24"`` before the command. Every frame
is waited for. Prints a table on standard error and one JSON object on standard output; judges nothing.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

STARTED = time.perf_counter()
TIMES = 20


def anonymous_mib() -> float:
    """Return the memory of this process that no file backs, MiB (Linux only, else NaN)."""
    status = Path("/proc/self/status")
    if not status.exists():
        return float("nan")
    line = next(line for line in status.read_text().splitlines() if line.startswith("RssAnon"))
    return int(line.split()[1]) / 1024


def milliseconds(work: Callable[[], None]) -> float:
    """Return how long a call takes."""
    begun = time.perf_counter()
    work()
    return 1000 * (time.perf_counter() - begun)


class Bench:
    """Drives one window as a person would, and notes how long each step takes to be seen."""

    def __init__(self, folder: Path) -> None:
        from annotator.session import Session
        from annotator.session.options import SessionOptions
        from annotator.settings import Settings
        from annotator.startup.start import make_application
        from annotator.window.main_window import MainWindow

        self.application = make_application()
        options = SessionOptions(
            annotator_name="bench", recovery_folder=folder / "recovery", level_cache_folder=folder / "levels"
        )
        self.session = Session(options)
        self.window = MainWindow(self.session, Settings(folder / "settings.ini"), folder / "log")
        self.window.resize(1400, 900)
        self.window.show()
        self.figures: dict[str, float | str | list[int]] = {}

    def wait(self, ready: Callable[[], bool], patience_s: float = 600) -> None:
        """Run the event loop until something holds."""
        limit = time.perf_counter() + patience_s
        while not ready():
            if time.perf_counter() > limit:
                raise TimeoutError("the window did not become ready")
            self.application.processEvents()

    def draw_scene(self) -> None:
        """Draw a frame of the scene now, and wait until OpenGL has finished it."""
        stage = self.window.scene._stage
        assert stage is not None
        stage.canvas.widget.repaint()
        stage.canvas.window.WaitForCompletion()

    def median(self, name: str, change: Callable[[int], None], draw: Callable[[], None]) -> None:
        """Note the median time of a change and its frame."""
        taken = []
        for step in range(TIMES):
            taken.append(milliseconds(lambda step=step: (change(step), draw())))  # type: ignore[misc]
            self.application.processEvents()
        self.figures[name] = statistics.median(taken)

    def open(self, path: Path) -> None:
        """Open the volume; note when the first slice and the first frame of the scene are there."""
        window, session = self.window, self.session
        self.wait(window.isVisible)
        window.repaint()
        self.figures["start_to_window_ms"] = 1000 * (time.perf_counter() - STARTED)
        window.prepare_scene()
        self.wait(lambda: not session.jobs.running)
        self.figures["start_to_mayavi_loaded_ms"] = 1000 * (time.perf_counter() - STARTED)
        begun = time.perf_counter()
        session.open_path(path)
        self.wait(lambda: all(view.times_drawn for view in window.slices))
        self.figures["open_to_first_slice_ms"] = 1000 * (time.perf_counter() - begun)
        self.wait(lambda: window.scene.volume_draws > 0)
        self.figures["open_to_first_3d_frame_ms"] = 1000 * (time.perf_counter() - begun)
        self.wait(lambda: all(view.is_sharp for view in window.slices))
        self.figures["open_to_sharp_slices_ms"] = 1000 * (time.perf_counter() - begun)
        self.wait(lambda: not session.jobs.running)
        self.figures["open_to_finest_level_ms"] = 1000 * (time.perf_counter() - begun)
        self.figures["anonymous_mib_opened"] = anonymous_mib()

    def measure(self) -> None:
        """Time edits, camera frames and slices."""
        from annotations.fitting.pose_fit import fit_document
        from annotations.geometry.kinematics import ToolPose
        from annotations.geometry.rotations import about_axis

        session, scene = self.session, self.window.scene
        assert session.volume is not None
        assert session.spacing_um is not None
        spacing_um = session.spacing_um
        middle_um = session.view.crosshair_um
        session.pose_tool(ToolPose(middle_um, about_axis((0, 0, 1), 90.0), {"theta1": 30.0, "theta2": 20.0}))
        scene.picture()

        def drag(step: int) -> None:
            session.begin_preview("k5", (middle_um[0] + 50 * step, middle_um[1], middle_um[2]), "dragged")

        def fit(step: int) -> None:
            document, tool = session.document, session.tool
            assert document is not None
            assert tool is not None
            fit_document(document, tool)

        self.median("fit_ms", fit, lambda: None)
        # With the fit, its ghost, residuals and pose: everything that moves with a keypoint.
        self.median("drag_to_frame_ms", drag, self.draw_scene)
        session.drop_preview()
        self.median(
            "edit_to_frame_ms",
            lambda step: session.type_position("k0", (middle_um[0], middle_um[1] + 50 * step, middle_um[2])),
            self.draw_scene,
        )

        def turn(step: int) -> None:
            camera = scene.camera
            assert camera is not None
            scene._set_camera(replace(camera, height_um=camera.height_um * (1.01 if step % 2 else 0.99)))

        self.median("camera_frame_moving_ms", turn, self.draw_scene)
        self.median("camera_frame_at_rest_ms", turn, lambda: (scene.picture(), None)[1])
        for axis, view in enumerate(self.window.slices):
            size = session.volume.shape[axis]

            def scroll(step: int, axis: int = axis, size: int = size) -> None:
                crosshair_um = list(session.view.crosshair_um)
                crosshair_um[axis] = (size // 4 + 7 * step) * spacing_um[axis]
                session.look(crosshair_um=tuple(crosshair_um))

            self.median(f"slice_axis{axis}_shown_ms", scroll, view.repaint)
            self.wait(lambda view=view: view.is_sharp)  # type: ignore[misc]
            self.median(
                f"slice_axis{axis}_sharp_ms",
                lambda step, scroll=scroll: scroll(step + 30),  # type: ignore[misc]
                lambda view=view: (self.wait(lambda: view.is_sharp), view.repaint())[1],  # type: ignore[misc]
            )
        self.figures["undo_ms"] = statistics.median(
            milliseconds(session.undo_stack.undo) for _ in range(min(TIMES, session.undo_stack.count()))
        )
        session.undo_stack.setIndex(session.undo_stack.count())
        self.figures["save_ms"] = milliseconds(lambda: (session.save(), None)[1])
        self.figures["anonymous_mib"] = anonymous_mib()
        picture = scene.picture()
        self.figures["scene_px"] = [picture.width(), picture.height()]

    def close(self) -> None:
        """Close the window and end the session."""
        self.window.close()
        self.session.shut_down()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=__doc__)
    parser.add_argument("volume", nargs="?", type=Path, help="a full-size .npy volume")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="oct-annotator-bench-") as name:
        folder = Path(name)
        volume = options.volume
        if volume is None:
            command = [
                sys.executable,
                "-m",
                "annotations.cli",
                "synthesize",
                str(folder / "study"),
                "--count",
                "1",
            ]
            subprocess.run([*command, "--seed", "1"], check=True, stdout=sys.stderr)
            volume = next((folder / "study" / "volumes").glob("*.npy"))
            globals()["STARTED"] = time.perf_counter()
        from annotator.startup import toolkit

        toolkit.prepare(headless=False)
        # The annotations of a benchmark do not belong beside somebody's volume.
        link = folder / "volume" / volume.name
        link.parent.mkdir()
        link.symlink_to(volume.absolute())
        (link.parent / f"{volume.name}.volume.toml").write_text("spacing_um = [15.9, 13.5, 9.4]\n")
        bench = Bench(folder)
        try:
            bench.open(link)
            bench.measure()
        finally:
            bench.close()
    for figure, value in bench.figures.items():
        sys.stderr.write(f"{figure:<28}{value if isinstance(value, list | str) else f'{value:10.1f}'}\n")
    sys.stdout.write(json.dumps(bench.figures) + "\n")


if __name__ == "__main__":
    main()
