"""Times the live view, from a volume's appearance to its pose on screen: ``python -m tests.bench.live``.

Another process puts volumes of the scanner's real-time shape into a folder, 20 a second; the live view's
window, with the checkpoint that ships, shows them as they come. By default the volumes are moved in, whole,
as `annotations.prediction.live.incoming` advises, which costs the cores nothing; with ``--write`` each is
written anew, which takes some 20 ms of a core. Without a screen, set ``QT_QPA_PLATFORM=offscreen``, or run it
under ``xvfb-run``. Prints a table on standard error and one JSON object on standard output; judges nothing.
"""

import argparse
import itertools
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication

from annotations.geometry.tool_library import find_tool
from annotations.prediction.checkpoint import load_checkpoint
from annotations.prediction.shipped import find_checkpoint
from annotations.synthesis import REALTIME_SHAPE, write_study
from annotations.volumes import OMES_REALTIME_SPACING_UM, write_folder_answer
from annotator.dialogs.live.live_window import LiveWindow
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.startup.start import make_application
from tests.bench.figures import print_figures

MADE = 8
LEFT_THERE = 20
STAGES = ("sampling_s", "network_s", "decoding_s", "fitting_s")


def put(source: Path, target: Path, rate_hz: float, count: int, *, writes: bool) -> None:
    """Put volumes into a folder at a rate, and take them away again when some newer ones are there."""
    paths = sorted(source.glob("*.npy"))
    contents = [path.read_bytes() for path in paths] if writes else []
    begun_s = time.monotonic()
    for number, path in zip(range(count), itertools.cycle(paths), strict=False):
        time.sleep(max(0.0, begun_s + number / rate_hz - time.monotonic()))
        hidden = target / f".{number:06}.npy"
        if writes:
            hidden.write_bytes(contents[number % len(contents)])
        else:
            os.link(path, hidden)
        hidden.rename(target / f"v{number:06}.npy")
        if number >= LEFT_THERE:
            (target / f"v{number - LEFT_THERE:06}.npy").unlink()


class Measurement:
    """One run of the live view while volumes come."""

    def __init__(self, folder: Path, command: list[str], checkpoint: Path) -> None:
        self._command = command
        self._writer: subprocess.Popen[bytes] | None = None
        self._session = Session(SessionOptions("bench"))
        self._session.predicting.load(load_checkpoint(checkpoint))
        self._window = LiveWindow(self._session)
        self._window.show()
        self._moments_s: list[float] = []
        self.stages_ms: dict[str, list[float]] = {stage: [] for stage in STAGES}
        self._session.living.running_changed.connect(self._on_running_changed)
        self._poll = QTimer(self._window)
        self._poll.timeout.connect(self._look)
        self._poll.start(5)
        self._seen: object = None
        self._session.living.start(folder, None, keeps=False)

    def figures(self) -> dict[str, float]:
        """Return what became of the volumes; call it when the application has quit."""
        statistics = self._session.living.statistics
        assert statistics is not None
        moments_s = self._moments_s
        self._window.close()
        self._session.shut_down()
        return {
            "shown": statistics.shown,
            "dropped": statistics.dropped,
            "not_shown": statistics.skipped,
            "frames_per_s": (len(moments_s) - 1) / (moments_s[-1] - moments_s[0]),
            "latency_median_ms": 1000 * (statistics.latency_s or 0.0),
            "latency_p99_ms": 1000 * (statistics.latency_p99_s or 0.0),
            **{
                f"{stage.removesuffix('_s')}_median_ms": sorted(taken_ms)[len(taken_ms) // 2]
                for stage, taken_ms in self.stages_ms.items()
                if taken_ms
            },
        }

    def _on_running_changed(self) -> None:
        if self._session.living.is_ready and self._writer is None:
            self._writer = subprocess.Popen(self._command)

    def _look(self) -> None:
        frame = self._window.projections.frame
        if frame is not None and frame is not self._seen:
            self._seen = frame
            self._moments_s.append(time.monotonic())
            for stage in STAGES:
                self.stages_ms[stage].append(1000 * getattr(frame.times, stage))
        if self._writer is not None and self._writer.poll() is not None:
            self._poll.stop()
            QApplication.exit()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.live", description=__doc__)
    parser.add_argument("--checkpoint", type=Path, default=Path("magnetic-forceps"))
    parser.add_argument("--rate", type=float, default=20.0, help="volumes a second (%(default)s)")
    parser.add_argument("--count", type=int, default=400, help="how many volumes (%(default)s)")
    parser.add_argument("--write", action="store_true", help="write each volume anew")
    parser.add_argument("--in", dest="folder", type=Path, help="in which folder (a temporary one)")
    parser.add_argument("--put", nargs=2, type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.put is not None:
        put(*options.put, options.rate, options.count, writes=options.write)
        return
    application = make_application()
    with tempfile.TemporaryDirectory(prefix="oct-annotator-bench-", dir=options.folder) as name:
        source, target = Path(name) / "study", Path(name) / "incoming"
        write_study(source, find_tool("magnetic-forceps"), count=MADE, seed=1, shape=REALTIME_SHAPE)
        target.mkdir()
        write_folder_answer(target, REALTIME_SHAPE, OMES_REALTIME_SPACING_UM, 2)
        command = [sys.executable, "-m", "tests.bench.live", "--put", str(source / "volumes"), str(target)]
        command += ["--rate", str(options.rate), "--count", str(options.count)]
        command += ["--write"] if options.write else []
        measurement = Measurement(target, command, find_checkpoint(options.checkpoint))
        application.exec()
        figures = {
            "volumes": options.count,
            "rate_hz": options.rate,
            "written_anew": options.write,
            "cores": os.cpu_count(),
            **measurement.figures(),
        }
    print_figures(figures)


if __name__ == "__main__":
    main()
