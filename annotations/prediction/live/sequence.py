"""A recorded sequence: a folder of volumes, played in the order of their names."""

import time
from collections.abc import Callable
from pathlib import Path

from annotations.errors import UserError
from annotations.prediction.live.arrival import News, arrived
from annotations.volumes import VolumeError, volume_paths


class RecordedSequence:
    """Gives one volume after the other, as if they came from a scanner.

    Parameters
    ----------
    folder : Path
    rate_hz : float
        How many volumes a second.
    loops : bool
        Whether the first follows the last; else the sequence is over then.
    clock : callable, optional
        Gives the time in seconds, as `time.time`.

    Raises
    ------
    VolumeError
        The folder cannot be read, or holds no volume.
    """

    def __init__(
        self, folder: Path, rate_hz: float, *, loops: bool, clock: Callable[[], float] = time.time
    ) -> None:
        self.paths = tuple(volume_paths(folder))
        if not self.paths:
            raise VolumeError(
                "there is no volume in this folder", where=folder, remedy="Choose one that holds a sequence"
            )
        self._rate_hz = rate_hz
        self._loops = loops
        self._clock = clock
        self._begun_s: float | None = None
        self._given = 0
        self._told: set[Path] = set()

    def look(self) -> News:
        """Return the volume that is due by now; of several the last, and how many were passed over."""
        now_s = self._clock()
        if self._begun_s is None:
            self._begun_s = now_s
        due = int((now_s - self._begun_s) * self._rate_hz) + 1
        if not self._loops:
            due = min(due, len(self.paths))
        if due <= self._given:
            return News(is_over=not self._loops and self._given == len(self.paths))
        number, passed = due - 1, due - 1 - self._given
        self._given = due
        path = self.paths[number % len(self.paths)]
        try:
            return News((arrived(path, self._begun_s + number / self._rate_hz),), passed=passed)
        except UserError as error:
            errors = () if path in self._told else (error,)
            self._told.add(path)
            return News(errors=errors, passed=passed)
