"""A disk that answers when a test lets it."""

import threading

import numpy as np

from annotations.volumes import Volume


class Disk:
    """Storage that waits at a gate, remembers what was read, and can fail."""

    def __init__(self, volume: Volume) -> None:
        self._array = np.load(volume.path)
        self.gate = threading.Event()
        self.arrived = threading.Event()
        self.error: Exception | None = None
        self.regions: list[tuple[slice, slice, slice]] = []

    def read(self, region: tuple[slice, slice, slice]) -> np.ndarray:
        self.regions.append(region)
        self.arrived.set()
        assert self.gate.wait(30)
        if self.error is not None:
            raise self.error
        return self._array[region]

    def close(self) -> None:
        pass
