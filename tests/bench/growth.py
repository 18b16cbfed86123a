"""How opening grows with the volume: two of them, opened in turn in one window."""

import shutil
from pathlib import Path

from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import Figures, large_pieces_mib
from tests.bench.opening import measure_opening

_PAUSE_S = 2.0


def measure_growth(driven: DrivenWindow, paths: tuple[Path, Path], times: int) -> list[list[Figures]]:
    """Open each of two volumes so many times, with nothing open and no level kept.

    Returns
    -------
    list
        For each time what the first took, and what the second did. What comes once a process is left out:
        each was opened before.
    """
    rounds = []
    for _ in range(times + 1):
        figures = []
        for path in paths:
            driven.session.close_volume()
            shutil.rmtree(driven.level_folder, ignore_errors=True)
            # Else it is measured what the gigabytes before it have left in the processor's caches.
            driven.pause(_PAUSE_S)
            opened = measure_opening(driven, path)
            figures.append(opened | {"mapped_in_large_pieces_mib": large_pieces_mib()})
        rounds.append(figures)
    driven.session.close_volume()
    # Until it is let go.
    driven.pause(_PAUSE_S)
    return rounds[1:]
