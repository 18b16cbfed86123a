"""The steps of the benchmark, each of which has a process of its own: ``python -m tests.bench.steps …``."""

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from annotator.startup import toolkit
from tests.bench.figures import Figures, anonymous_mib, peak_mib
from tests.bench.starting import environment_of_nobody
from tests.bench.volumes import empty_volume, forget_pages, placed, read_once

if TYPE_CHECKING:
    from tests.bench.driven_window import DrivenWindow

Result = dict[str, object]
"""Figures by name, and in ``watches`` what a watchdog saw."""


@dataclass(frozen=True)
class Request:
    """What a step is to measure.

    Attributes
    ----------
    step : str
        One of `STEPS`.
    volume : Path
        The volume to open.
    times : int
        How often a figure is taken that is given as a median.
    count : int
        Of edits, or of volumes in a study.
    """

    step: str
    volume: Path
    times: int = 20
    count: int = 0


def run_step(request: Request, home: Path) -> Result:
    """Run a step in a process of its own, and return what it measured.

    Raises
    ------
    RuntimeError
        The process failed; it has said on standard error why.
    """
    command = [sys.executable, "-m", "tests.bench.steps", request.step, str(request.volume)]
    command += ["--times", str(request.times), "--count", str(request.count)]
    done = subprocess.run(
        command, stdout=subprocess.PIPE, text=True, env=environment_of_nobody(home), check=False
    )
    if done.returncode:
        raise RuntimeError(f"the step {request.step!r} ended with {done.returncode}")
    return dict(json.loads(done.stdout.splitlines()[-1]))


def measure(request: Request, folder: Path) -> Result:
    """Measure a step in this process, with a window of its own."""
    return STEPS[request.step](request, folder)


def _window(request: Request, folder: Path) -> Result:
    """Everything that the peer does, and what can only be measured beside it."""
    from tests.bench.handling import measure_edits_in_slices, measure_handling
    from tests.bench.input_while_drawing import measure_input
    from tests.bench.opening import measure_opening
    from tests.bench.scrolling import measure_scrolling

    read_once(request.volume)
    with _driven(folder) as driven:
        figures = measure_opening(driven, placed(request.volume, folder / "volume"))
        figures |= measure_scrolling(driven, request.times)
        figures |= measure_handling(driven, request.times)
        figures |= measure_input(driven, max(1, request.times // 4))
        figures |= measure_edits_in_slices(driven, request.times)
        figures |= {"anonymous_mib": anonymous_mib(), "peak_rss_mib": peak_mib()}
        stage = driven.window.scene._stage
        assert stage is not None
        return {**figures, "renderer": stage.renderers.renderer_name()}


def _opening(request: Request, folder: Path) -> Result:
    """The opening alone."""
    from tests.bench.opening import measure_opening

    with _driven(folder) as driven:
        return dict(measure_opening(driven, placed(request.volume, folder / "volume")))


def _growth(request: Request, folder: Path) -> Result:
    """The opening of an empty volume as large as the given one, and of one twice as large along two axes.

    With their pages in memory as the system reads them, many in one piece, and each by itself.
    """
    from annotations.volumes import open_volume
    from tests.bench.growth import measure_growth

    with open_volume(request.volume) as volume:
        x, y, z = volume.shape
    larger = empty_volume(folder / "larger.npy", (2 * x, 2 * y, z))
    empty = empty_volume(folder / "empty.npy", (x, y, z))
    with _driven(folder) as driven:
        paths = placed(empty, folder / "volume"), placed(larger, folder / "larger")
        # Else they would differ by what has to come from the disk.
        for path in (larger, empty):
            read_once(path)
        found: Result = {"rounds": measure_growth(driven, paths, request.times)}
        if sys.platform == "linux":
            for path in (larger, empty):
                forget_pages(path)
                read_once(path, in_single_pages=True)
            found["rounds_of_single_pages"] = measure_growth(driven, paths, request.times)
    return found


def _cold(request: Request, folder: Path) -> Result:
    """Opening and slices with none of the file in memory."""
    from tests.bench.opening import measure_opening
    from tests.bench.scrolling import measure_cold_slices

    with _driven(folder) as driven:
        path = placed(request.volume, folder / "volume")
        forget_pages(request.volume)
        opened = measure_opening(driven, path)
        figures: Figures = {f"cold_{name}": value for name, value in opened.items() if name.endswith("_ms")}
        return dict(figures | measure_cold_slices(driven, path, request.times))


def _watch(request: Request, folder: Path) -> Result:
    """What keeps the window from answering."""
    from tests.bench.annotated_study import REVIEWER
    from tests.bench.watching import Watching, watch_loading, watch_predictions, watch_report

    read_once(request.volume)
    with _driven(folder, annotator=REVIEWER) as driven:
        for name in ("v001.npy", "v002.npy"):
            placed(request.volume, folder / "volumes", name)
        watching = Watching(driven)
        watch_loading(watching, driven, folder / "volumes")
        watch_predictions(watching, driven)
        watch_report(watching, driven, folder, request.count)
        return {
            **watching.figures,
            "anonymous_after_all_mib": anonymous_mib(),
            "watches": {name: watch.plain() for name, watch in watching.watches.items()},
        }


def _edits(request: Request, folder: Path) -> Result:
    """Thousands of edits."""
    from tests.bench.many_edits import measure_many_edits

    with _driven(folder) as driven:
        return dict(measure_many_edits(driven, placed(request.volume, folder / "volume"), request.count))


def _study(request: Request, folder: Path) -> Result:
    """A study of many volumes."""
    from tests.bench.studies import measure_study

    with _driven(folder, annotator="anna") as driven:
        figures, watches = measure_study(driven, folder, request.count)
    return {**figures, "watches": {name: watch.plain() for name, watch in watches.items()}}


STEPS: dict[str, Callable[[Request, Path], Result]] = {
    "window": _window,
    "opening": _opening,
    "growth": _growth,
    "cold": _cold,
    "watch": _watch,
    "edits": _edits,
    "study": _study,
}


@contextlib.contextmanager
def _driven(folder: Path, annotator: str = "bench") -> "Iterator[DrivenWindow]":
    from tests.bench.driven_window import DrivenWindow

    driven = DrivenWindow(folder, annotator)
    try:
        driven.prepare_scene()
        yield driven
    finally:
        driven.close()


def main() -> None:
    """Measure one step, and print it."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.steps", description=__doc__)
    parser.add_argument("step", choices=STEPS)
    parser.add_argument("volume", type=Path)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--count", type=int, default=0)
    options = parser.parse_args()
    toolkit.prepare(headless=False)
    request = Request(options.step, options.volume, options.times, options.count)
    with tempfile.TemporaryDirectory(prefix="oct-annotator-bench-") as name:
        result = measure(request, Path(name))
    print(json.dumps(result), flush=True)
    # Not to wait for threads that may be busy.
    os._exit(0)


if __name__ == "__main__":
    main()
