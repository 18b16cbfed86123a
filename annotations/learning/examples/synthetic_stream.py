"""Synthetic examples in a row, made by several processes and the same however many. Needs no torch."""

import contextlib
import multiprocessing
import os
import queue
import signal
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Self

import numpy as np

from annotations.errors import UserError
from annotations.geometry.kinematics import keypoints_um
from annotations.geometry.tool import ToolSpecification
from annotations.learning.examples.examples import Example
from annotations.synthesis.conditions import SceneConditions
from annotations.synthesis.network_volume import network_volume
from annotations.synthesis.scene import SceneSeed, random_scene
from annotations.volumes.sampling import Sampling

_AHEAD = 32
"""Examples that wait to be used: 20 MB at the scanner's sampling."""
_LOOK_AGAIN_S = 0.2
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class SyntheticSeries:
    """A series of numbered examples, each of which depends on its number alone.

    Attributes
    ----------
    tool : ToolSpecification
    sampling : Sampling
    seed : int
        The number of the series.
    conditions : SceneConditions
        What varies.
    """

    tool: ToolSpecification
    sampling: Sampling
    seed: int
    conditions: SceneConditions

    def example(self, number: int) -> Example:
        """Make an example.

        Raises
        ------
        UserError
            The tool has no links, or does not fit into the workspace.
        """
        scene = random_scene(self.tool, SceneSeed(self.seed, number), conditions=self.conditions)
        positions = keypoints_um(scene.pose, self.tool)
        return Example(
            network_volume(scene, self.sampling).astype(np.float16),
            np.array([positions.get(name, (np.nan,) * 3) for name in self.tool.keypoint_names]),
            scene.grid.spacing_um,
        )


def worker_count(wanted: int) -> int:
    """Return how many processes make examples: for -1 one fewer than there are processors."""
    return wanted if wanted >= 0 else max(1, (os.cpu_count() or 1) - 1)


class SyntheticStream:
    """The examples of a series from a number on, in order.

    Used as a context; afterwards no process is left. The processes end as well when this one is killed.

    Parameters
    ----------
    series : SyntheticSeries
    first : int
        Number of the first example.
    workers : int
        Processes that make them; 0 to make each when it is asked for.
    """

    def __init__(self, series: SyntheticSeries, first: int, workers: int) -> None:
        self._series = series
        self._next = first
        self._closing = threading.Event()
        self._waiting: queue.Queue[Example | BaseException] = queue.Queue(maxsize=_AHEAD)
        self._processes: list[BaseProcess] = []
        self._connections: list[Connection] = []
        self._reader: threading.Thread | None = None
        if workers:
            self._start(workers)

    def take(self) -> Example:
        """Return the next example.

        Raises
        ------
        UserError
            The tool cannot be made, or a process has ended.
        """
        if self._reader is None:
            self._next += 1
            return self._series.example(self._next - 1)
        found = self._waiting.get()
        if isinstance(found, BaseException):
            # Whoever asks again is to get it again, rather than to wait.
            self._waiting.put(found)
            raise found
        return found

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the processes; may be called again."""
        self._closing.set()
        if self._reader is not None:
            self._reader.join()
        for connection in self._connections:
            # Whoever still writes into it gets an error, and ends.
            connection.close()
        for process in self._processes:
            process.join(timeout=1)
            if process.is_alive():
                process.terminate()
                process.join()
            process.close()
        self._connections, self._processes = [], []

    def _start(self, workers: int) -> None:
        # Fresh interpreters: a copy of this one could hold torch's threads, and locks that nobody opens.
        context = multiprocessing.get_context("spawn")
        with _environment(_ONE_THREAD):
            for place in range(workers):
                receiver, sender = context.Pipe(duplex=False)
                process = context.Process(
                    target=_make_examples,
                    args=(self._series, self._next + place, workers, sender),
                    daemon=True,
                    name=f"synthetic volumes {place + 1}",
                )
                self._connections.append(receiver)
                self._processes.append(process)
                process.start()
                # Else the end of the process would not be the end of what can be read.
                sender.close()
        self._reader = threading.Thread(target=self._read, name="synthetic volumes", daemon=True)
        self._reader.start()

    def _read(self) -> None:
        """Collect the examples in their order; in a thread of its own."""
        place = 0
        while not self._closing.is_set():
            connection = self._connections[place]
            if not connection.poll(_LOOK_AGAIN_S):
                continue
            try:
                found: Example | BaseException = connection.recv()
            except (EOFError, OSError):
                found = UserError(
                    "a process that makes synthetic volumes has ended",
                    remedy="There may have been too little memory: take fewer workers (synthetic.workers)",
                )
            while not self._closing.is_set():
                with contextlib.suppress(queue.Full):
                    self._waiting.put(found, timeout=_LOOK_AGAIN_S)
                    break
            if isinstance(found, BaseException):
                return
            place = (place + 1) % len(self._connections)


def _make_examples(series: SyntheticSeries, first: int, step: int, sender: Connection) -> None:
    """Send every step-th example from the first on, until nobody listens; in a process of its own."""
    # Ctrl-C reaches all processes of a terminal, and is the training's to answer.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    number = first
    # The training ended, or was killed.
    with contextlib.suppress(BrokenPipeError, ConnectionError):
        while True:
            try:
                sender.send(series.example(number))
            except UserError as error:
                sender.send(error)
                return
            number += step


@contextlib.contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set variables of the environment for what is started meanwhile."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
