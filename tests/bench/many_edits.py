"""What thousands of edits cost in memory, and what is given back when the volume is closed."""

import gc
import itertools
import time
from pathlib import Path

from annotator.slices.fetching import CACHE_BYTES
from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import Figures, anonymous_mib
from tests.bench.handling import moved_um, posed

_PLACES = 997
_WARM_UP = 200
_EDITS_A_TURN = 20
# Until the slices that are read ahead are in memory: they are not the edits' either.
_READING_AHEAD_S = 4.0


def measure_many_edits(driven: DrivenWindow, path: Path, edits: int) -> Figures:
    """Make edits, a few for each turn of the event loop, then close the volume, and as many once more.

    What stays after the first closing may be anything that was made then; what stays after the second is what
    edits leave behind.
    """
    session = driven.session
    # What is made once, on the first use, is not the edits'.
    for _ in range(2):
        _open(driven, path)
        session.close_volume()
    closed_mib = _memory_mib(driven)
    _open(driven, path)
    before_mib, begun_s, begun_cpu_s = _memory_mib(driven), time.perf_counter(), time.process_time()
    _edit(driven, edits)
    taken_s, taken_cpu_s = time.perf_counter() - begun_s, time.process_time() - begun_cpu_s
    after_mib = _memory_mib(driven)
    session.close_volume()
    kept_mib = _memory_mib(driven) - closed_mib
    _open(driven, path)
    _edit(driven, edits)
    session.close_volume()
    return {
        "edits": float(edits),
        "edit_ms": 1000 * taken_s / edits,
        "edit_cpu_ms": 1000 * taken_cpu_s / edits,
        "grown_mib": after_mib - before_mib,
        "kept_after_closing_mib": kept_mib,
        "kept_by_as_many_again_mib": _memory_mib(driven) - closed_mib - kept_mib,
    }


def _open(driven: DrivenWindow, path: Path) -> None:
    """Open a volume, look at as many slices as are kept in memory, and make the first edits.

    Edits lead to slices, which looking alone would bring into memory too. Those have a limit of their own,
    and have reached it after this: for each that the edits bring others are let go.
    """
    driven.open(path)
    session = driven.session
    volume, spacing_um, before = session.volume, session.spacing_um, session.view.crosshair_um
    assert volume is not None
    assert spacing_um is not None
    slice_bytes = volume.dtype.itemsize * volume.shape[1] * volume.shape[2]
    for index in range(min(volume.shape[0], CACHE_BYTES // slice_bytes + 1)):
        session.look(crosshair_um=(index * spacing_um[0], *before[1:]))
        driven.settle()
    session.look(crosshair_um=before)
    _edit(driven, _WARM_UP, -(-_PLACES // _WARM_UP))


def _edit(driven: DrivenWindow, count: int, every: int = 1) -> None:
    """Make edits that go through the same places again and again, or through one in ``every`` of them."""
    session = driven.session
    positions_um = posed(driven)
    for number, name in zip(range(count), itertools.cycle(positions_um), strict=False):
        # No two alike: an edit that changes nothing is none.
        session.type_position(name, moved_um(positions_um[name], 1 + number * every % _PLACES / 100))
        if number % _EDITS_A_TURN == 0:
            driven.application.processEvents()
    driven.settle()


def _memory_mib(driven: DrivenWindow) -> float:
    driven.settle()
    driven.pause(_READING_AHEAD_S)
    gc.collect()
    return anonymous_mib()
