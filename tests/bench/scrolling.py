"""How soon a slice is seen when a person scrolls: coarsely, and in full resolution."""

import statistics
import time
from pathlib import Path

from annotator.window.four_up import SLICE_PANES
from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import Figures
from tests.bench.volumes import forget_pages, pages_in_memory

STEP_VOXELS = 7
"""As in the peer's benchmark."""


_FORESEEING_S = 0.5
_FORGETTING_TRIES = 20
_FORGOTTEN = 0.02


def measure_scrolling(driven: DrivenWindow, times: int) -> Figures:
    """Scroll each axis: one slice as large as the peer's, then all four panes."""
    figures: Figures = {}
    for axis, pane in enumerate(SLICE_PANES):
        driven.show_pane(pane)
        coarse_ms, _, sharp_ms = _scrolled(driven, axis, 0.27, times)
        figures[f"slice_axis{axis}_shown_ms"] = statistics.median(coarse_ms)
        figures[f"slice_axis{axis}_sharp_ms"] = statistics.median(sharp_ms)
    driven.show_pane(None)
    for axis in range(3):
        coarse_ms, _, sharp_ms = _scrolled(driven, axis, 0.52, times)
        figures[f"four_panes_axis{axis}_shown_ms"] = statistics.median(coarse_ms)
        figures[f"four_panes_axis{axis}_sharp_ms"] = statistics.median(sharp_ms)
    return figures


def measure_cold_slices(driven: DrivenWindow, path: Path, times: int) -> Figures:
    """Jump to slices far apart, each time with none of the file in memory."""
    figures: Figures = {}
    kept = []
    for axis, pane in enumerate(SLICE_PANES):
        driven.show_pane(pane)
        coarse_ms, fine_ms, sharp_ms = [], [], []
        for number in range(times):
            kept.append(_forget(driven, path.resolve()))
            [coarse], [fine], [sharp] = _scrolled(driven, axis, (number + 1.3) / (times + 2), 1)
            coarse_ms.append(coarse)
            fine_ms.append(fine)
            sharp_ms.append(sharp)
        figures[f"cold_axis{axis}_shown_ms"] = statistics.median(coarse_ms)
        figures[f"cold_axis{axis}_shown_longest_ms"] = max(coarse_ms)
        figures[f"cold_axis{axis}_fine_ms"] = statistics.median(fine_ms)
        figures[f"cold_axis{axis}_sharp_ms"] = statistics.median(sharp_ms)
    figures["share_still_in_memory"] = max(kept)
    figures["share_read_by_one_jump"] = pages_in_memory(path.resolve())
    driven.show_pane(None)
    return figures


def _forget(driven: DrivenWindow, path: Path) -> float:
    """Drop a file's pages, once what is foreseen of the last slice has been read; return what stayed."""
    for _ in range(_FORGETTING_TRIES):
        forget_pages(path)
        driven.pause(_FORESEEING_S)
        if (kept := pages_in_memory(path)) <= _FORGOTTEN:
            break
    return kept


def _scrolled(
    driven: DrivenWindow, axis: int, begin: float, times: int
) -> tuple[list[float], list[float], list[float]]:
    """Return how long each step took until a picture was there, until a fine one was, and a sharp one."""
    session, painting = driven.session, driven.paintings[axis]
    volume, spacing_um = session.volume, session.spacing_um
    assert volume is not None
    assert spacing_um is not None
    size = volume.shape[axis]
    shown_ms, fine_ms, sharp_ms = [], [], []
    for step in range(times):
        index = round(begin * size + STEP_VOXELS * step) % size
        crosshair_um = list(session.view.crosshair_um)
        crosshair_um[axis] = index * spacing_um[axis]
        count, fine_count, sharp_count = painting.count, painting.fine_count, painting.sharp_count
        begun_s = time.perf_counter()
        session.look(crosshair_um=tuple(crosshair_um))
        while painting.count == count:
            driven.application.processEvents()
        shown_ms.append(1000 * (time.perf_counter() - begun_s))
        driven.wait(lambda count=fine_count: painting.fine_count > count)  # type: ignore[misc]
        fine_ms.append(1000 * (time.perf_counter() - begun_s))
        driven.wait(lambda count=sharp_count: painting.sharp_count > count)  # type: ignore[misc]
        sharp_ms.append(1000 * (time.perf_counter() - begun_s))
    return shown_ms, fine_ms, sharp_ms
