"""A live view at work: looks at a source of volumes, and lets a network say where the tool is in the newest.

Two threads: one only looks at the source, so that it notices when a volume comes while the network is busy.
Whatever waits is the newest volume, and the newest frame; older ones are dropped and counted. So the view may
be slow, but is never behind.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from annotations.errors import Cancelled, UserError
from annotations.prediction.checkpoint import CheckpointError
from annotations.prediction.inference_child import InferenceCrashed
from annotations.prediction.live.arrival import Arrival, News
from annotations.prediction.live.frame import LiveFrame
from annotations.prediction.live.statistics import LiveCounts, LiveStatistics
from annotations.prediction.live.voxel_grids import Shape, VoxelGrid, VoxelGrids
from annotations.volumes import SpacingUm

LOOK_EVERY_S = 0.003
_SHARE_OF_LOOKING = 0.25
"""Of a processor's time at most, however many files a folder has."""
_MOST_CRASHES = 3
"""In a row, before the run is given up."""


class Source(Protocol):
    """Where volumes come from."""

    def look(self) -> News:
        """Return what has come since the last look; UserError where nothing will come any more."""


class Network(Protocol):
    """What looks at volumes: `InferenceProcess`, or a stand-in."""

    @property
    def has_ended(self) -> bool:
        """Whether it was ready, and has ended since."""

    def start(self, cancelled: Callable[[], bool]) -> None:
        """Get ready."""

    def look(
        self,
        volume_path: Path,
        *,
        dataset: str | None,
        spacing_um: SpacingUm,
        depth_axis: int,
        cancelled: Callable[[], bool],
    ) -> LiveFrame:
        """Return what is to be shown of a volume."""

    def keep(self, folder: Path, cancelled: Callable[[], bool]) -> Path:
        """Write the prediction of the volume that was looked at last."""

    def close(self) -> None:
        """End what runs the network."""


@dataclass(frozen=True)
class Listener:
    """Who is told; called from the run's threads, and not to wait in there.

    Attributes
    ----------
    ready : callable
        The network is ready: volumes are shown from now on.
    restarting : callable
        It has crashed, and is being made ready anew; ``ready`` follows.
    frame_came : callable
        `LiveRun.take` has a frame.
    failed : callable
        Told of a volume that cannot be shown, or of a crash; the run goes on.
    grid_needed : callable
        Nobody says how far apart the voxels of a volume are: asked once for each shape, answer with
        `LiveRun.tell_grid` or `LiveRun.decline_grid`. Such volumes wait until then.
    ended : callable
        The run is over: with the error that ended it, or None.
    """

    ready: Callable[[], object]
    restarting: Callable[[], object]
    frame_came: Callable[[], object]
    failed: Callable[[UserError], object]
    grid_needed: Callable[[Arrival], object]
    ended: Callable[[Exception | None], object]


class LiveRun:
    """Shows volumes as they come.

    Parameters
    ----------
    source : Source
    network : Network
        Closed when the run ends.
    listener : Listener
    keep_in : Path, optional
        Where the prediction of each volume that is looked at is written, after it is handed out.
    """

    def __init__(
        self, source: Source, network: Network, listener: Listener, keep_in: Path | None = None
    ) -> None:
        self._source = source
        self._network = network
        self._listener = listener
        self._keep_in = keep_in
        self._lock = threading.Condition()
        self._stops = False
        self._is_over = False
        self._waiting: Arrival | None = None
        self._frame: tuple[Arrival, LiveFrame] | None = None
        self._taken: Arrival | None = None
        self._counts = LiveCounts()
        self._grids = VoxelGrids(self._counts)
        self._crashes = 0
        self._given: Path | None = None
        self._cannot_keep = self._has_told_of_gone = False
        self._error: Exception | None = None
        self._threads = [
            threading.Thread(target=self._watch, name="live-watch", daemon=True),
            threading.Thread(target=self._work, name="live-network", daemon=True),
        ]

    def start(self) -> None:
        """Begin; the network is made ready first."""
        self._threads[1].start()

    def stop(self) -> None:
        """End; returns at once, and `Listener.ended` follows when the threads have ended."""
        with self._lock:
            self._stops = True
            self._lock.notify_all()

    def join(self, timeout_s: float) -> None:
        """Wait until the threads have ended, or for so long."""
        until_s = time.monotonic() + timeout_s
        for thread in self._threads:
            if thread.is_alive():
                thread.join(max(0.0, until_s - time.monotonic()))

    @property
    def is_alive(self) -> bool:
        """Whether one of its threads is still at work."""
        return any(thread.is_alive() for thread in self._threads)

    def tell_grid(self, shape: Shape, grid: VoxelGrid) -> None:
        """Answer `Listener.grid_needed` for all volumes of a shape: the newest that waits is shown."""
        with self._lock:
            held = self._grids.answer(shape, grid)
            if held is None:
                return
            if self._waiting is None:
                # How long the answer took is nobody's latency.
                self._waiting = replace(held, is_timed=False)
                self._lock.notify_all()
            else:
                self._counts.dropped += 1

    def decline_grid(self, shape: Shape) -> None:
        """Answer `Listener.grid_needed`: no volume of this shape is shown."""
        with self._lock:
            self._grids.decline(shape)

    def put_grid_off(self, shape: Shape) -> None:
        """Drop the volumes of a shape that wait; the next one that comes is asked about again."""
        with self._lock:
            self._grids.put_off(shape)

    def take(self) -> LiveFrame | None:
        """Return the newest frame that was not taken yet; say with `note_shown` when it is on screen."""
        with self._lock:
            if self._frame is None:
                return None
            arrival, frame = self._frame
            self._frame, self._taken = None, arrival
            return frame

    def note_shown(self) -> None:
        """Count the frame that was taken last as one that is on screen now."""
        now_s = time.time()
        with self._lock:
            if self._taken is not None:
                self._counts.note_shown(self._taken.appeared_s if self._taken.is_timed else None, now_s)
            self._taken = None

    def statistics(self) -> LiveStatistics:
        """Return how the run keeps up."""
        with self._lock:
            return self._counts.statistics(time.time())

    def _is_stopped(self) -> bool:
        return self._stops

    def _watch(self) -> None:
        has_looked = False
        while not self._stops:
            begun_s = time.monotonic()
            try:
                news = self._source.look()
            except Exception as error:  # noqa: BLE001 - a person has to hear of it, whatever it is
                self._give_up(error)
                return
            if not has_looked:
                # Not before: what comes from now on is new to the source.
                has_looked = True
                self._listener.ready()
            self._receive(news)
            if news.is_over:
                break
            taken_s = time.monotonic() - begun_s
            time.sleep(max(LOOK_EVERY_S, taken_s * (1 / _SHARE_OF_LOOKING - 1)))
        with self._lock:
            self._is_over = True
            self._lock.notify_all()

    def _receive(self, news: News) -> None:
        for error in news.errors:
            self._listener.failed(error)
        if not (news.arrivals or news.errors or news.passed or news.unfinished or self._counts.unfinished):
            return
        with self._lock:
            self._counts.skipped += len(news.errors)
            self._counts.dropped += news.passed
            self._counts.unfinished = news.unfinished
            for arrival in news.arrivals:
                self._counts.dropped += self._waiting is not None
                self._waiting = arrival
            self._lock.notify_all()

    def _work(self) -> None:
        try:
            self._network.start(self._is_stopped)
            self._threads[0].start()
            while (arrival := self._next()) is not None:
                self._show(arrival)
        except Cancelled:
            pass
        except Exception as error:  # noqa: BLE001 - as above
            self._give_up(error)
        self.stop()
        if self._threads[0].is_alive():
            self._threads[0].join()
        self._network.close()
        self._listener.ended(self._error)

    def _next(self) -> Arrival | None:
        """Wait for a volume; None when there are no more, or the run is to stop."""
        with self._lock:
            while not self._stops:
                if self._waiting is not None:
                    arrival, self._waiting = self._waiting, None
                    return arrival
                if self._is_over:
                    break
                self._lock.wait()
            return None

    def _show(self, arrival: Arrival) -> None:
        with self._lock:
            grid = self._grids.of(arrival)
            is_new = self._grids.is_new(arrival)
        if grid is None:
            if is_new:
                self._listener.grid_needed(arrival)
            return
        if self._network.has_ended:
            self._restart(InferenceCrashed("the process that runs the network has ended unexpectedly"))
        self._given = arrival.volume_path
        try:
            frame = self._network.look(
                arrival.volume_path,
                dataset=arrival.dataset,
                spacing_um=grid.spacing_um,
                depth_axis=grid.depth_axis,
                cancelled=self._is_stopped,
            )
        except InferenceCrashed as error:
            with self._lock:
                self._counts.skipped += 1
            self._restart(error)
        except CheckpointError:
            raise
        except UserError as error:
            if arrival.volume_path.exists():
                self._listener.failed(error)
                with self._lock:
                    self._counts.skipped += 1
            else:
                self._pass_over_gone(arrival)
        else:
            self._crashes = 0
            self._hand_out(arrival, frame)
            if self._keep_in is not None:
                self._keep(self._keep_in)

    def _restart(self, error: InferenceCrashed) -> None:
        """Make the network ready anew; or give up, where it has crashed too often."""
        while True:
            self._crashes += 1
            if self._crashes >= _MOST_CRASHES:
                raise InferenceCrashed(
                    f"{error.problem}, {self._crashes} times one after the other; this volume was the last "
                    "that it was given",
                    where=self._given,
                    remedy="Close other programs, and start the view again; if it is always this volume, "
                    "take it out of the folder",
                ) from error
            self._listener.failed(
                InferenceCrashed(error.problem, where=self._given, remedy="It is being started anew")
            )
            self._listener.restarting()
            with self._lock:
                self._counts.restarts += 1
            try:
                self._network.start(self._is_stopped)
            except InferenceCrashed as again:
                error = again
            else:
                self._listener.ready()
                return

    def _pass_over_gone(self, arrival: Arrival) -> None:
        with self._lock:
            self._counts.dropped += 1
        if not self._has_told_of_gone:
            self._has_told_of_gone = True
            self._listener.failed(
                UserError(
                    "it was gone before it was read",
                    where=arrival.volume_path,
                    remedy="Such volumes count as dropped, and this is told once: let them stay longer",
                )
            )

    def _keep(self, folder: Path) -> None:
        """Have the prediction written; that it cannot be is told once, until it can again."""
        try:
            self._network.keep(folder, self._is_stopped)
        except InferenceCrashed as error:
            self._restart(error)
        except UserError as error:
            if not self._cannot_keep:
                self._cannot_keep = True
                self._listener.failed(
                    UserError(
                        f"predictions are not kept: {error.problem}",
                        where=error.where,
                        remedy="The volumes are shown all the same, and this is told once: see to the "
                        "folder, or start the view without keeping them",
                    )
                )
        else:
            self._cannot_keep = False

    def _hand_out(self, arrival: Arrival, frame: LiveFrame) -> None:
        with self._lock:
            is_new = self._frame is None
            self._counts.dropped += not is_new
            self._frame = (arrival, frame)
        if is_new:
            self._listener.frame_came()

    def _give_up(self, error: Exception) -> None:
        if self._error is None:
            self._error = error
        self.stop()
