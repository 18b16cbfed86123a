"""How a live view keeps up: frames a second, latency, and what was dropped."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from annotations.prediction.live.arrival import Unfinished

WINDOW_S = 2.0
"""Over which frames a second are counted."""
LATENCIES = 600
"""Of how many frames, the last ones, the latency is told: half a minute at 20 Hz."""


@dataclass(frozen=True)
class LiveStatistics:
    """Figures of a live view at one moment.

    Attributes
    ----------
    shown : int
        Volumes that were shown since it began.
    dropped : int
        Those that were not, because a newer one was there before they had their turn, or they were gone.
    skipped : int
        Those that could not be shown: the errors say why.
    waiting : int
        Those that wait until somebody says how far apart their voxels are.
    restarts : int
        How often the process that runs the network was started anew.
    rate_hz : float
        Frames a second by now; 0 where none came of late.
    latency_s, latency_p99_s : float or None
        Median and 99th percentile of the time from a volume's appearance to its pose on screen.
    unfinished : tuple of Unfinished
        Volumes that are still being written by now.
    """

    shown: int = 0
    dropped: int = 0
    skipped: int = 0
    waiting: int = 0
    restarts: int = 0
    rate_hz: float = 0.0
    latency_s: float | None = None
    latency_p99_s: float | None = None
    unfinished: tuple[Unfinished, ...] = ()


class LiveCounts:
    """Counts what becomes of the volumes; for one thread at a time."""

    def __init__(self) -> None:
        self.dropped = self.skipped = self.waiting = self.restarts = 0
        self.unfinished: tuple[Unfinished, ...] = ()
        self._shown = 0
        self._moments_s: deque[float] = deque()
        self._latencies_s: deque[float] = deque(maxlen=LATENCIES)

    def note_shown(self, appeared_s: float | None, shown_s: float) -> None:
        """Count a volume that is on screen now; without its appearance where that means nothing."""
        self._shown += 1
        self._moments_s.append(shown_s)
        if appeared_s is not None:
            self._latencies_s.append(shown_s - appeared_s)

    def statistics(self, now_s: float) -> LiveStatistics:
        """Return the figures."""
        moments_s = self._moments_s
        while moments_s and moments_s[0] < now_s - WINDOW_S:
            moments_s.popleft()
        # As long as the next one is not overdue, the time between the first and the last counts.
        until_s = now_s if len(moments_s) < 2 else moments_s[-1]
        rate_hz = (len(moments_s) - 1) / (until_s - moments_s[0]) if len(moments_s) > 1 else 0.0
        median, p99 = np.percentile(self._latencies_s, (50, 99)) if self._latencies_s else (None, None)
        return LiveStatistics(
            self._shown,
            self.dropped,
            self.skipped,
            self.waiting,
            self.restarts,
            rate_hz,
            None if median is None else float(median),
            None if p99 is None else float(p99),
            self.unfinished,
        )
