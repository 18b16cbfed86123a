"""Long work off the GUI thread: started here, shown with its progress, cancelled by a person."""

import math
import queue
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Literal, TypeVar

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from annotations.errors import Cancelled

# Three: a level may be built, and volumes be predicted, while picks and openings go on beside them.
_THREADS = 3
# A slab or a slice is read well within this; what takes longer is given up.
_PATIENCE_S = 2.0
WHEN_SHOWN_MS = 30
"""Until the window has shown what a person did: it wants Python's lock back after each call that paints."""

# A bar that moves more often is no smoother, and drawing it takes the time from the first pictures.
_PROGRESS_EVERY_S = 0.1

JobState = Literal["running", "done", "cancelled", "failed"]
Result = TypeVar("Result")


class Job:
    """A piece of long work.

    Attributes
    ----------
    title : str
        What it does, for the person who waits.
    progress : float or None
        Between 0 and 1; None while it cannot be told.
    state : str
    shown : bool
        Whether it is worth a progress bar, and a person may cancel it.
    writes : bool
        Whether it writes files: one that had written them when it was cancelled is done.
    """

    def __init__(self, title: str, *, shown: bool, writes: bool) -> None:
        self.title = title
        self.shown = shown
        self.writes = writes
        self.progress: float | None = None
        self.state: JobState = "running"
        self._cancelled = threading.Event()

    def is_cancelled(self) -> bool:
        """Say, from any thread, whether the work should stop."""
        return self._cancelled.is_set()

    def request_cancel(self) -> None:
        """Ask the work to stop."""
        self._cancelled.set()


class Jobs(QObject):
    """Runs work in threads and brings its results back to the thread that this object lives in.

    Signals
    -------
    job_changed : Job
        A job began, made progress or ended.
    """

    job_changed = Signal(object)
    _delivered = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._waiting: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        # Daemons: a read that hangs on a dead network share must not keep the program from ending.
        self._threads = [
            threading.Thread(target=self._work, name=f"job-{number}", daemon=True)
            for number in range(_THREADS)
        ]
        for thread in self._threads:
            thread.start()
        self._running: list[Job] = []
        self._closed = False
        self._delivered.connect(self._on_delivered, Qt.ConnectionType.QueuedConnection)

    @property
    def running(self) -> tuple[Job, ...]:
        """The jobs that have not ended, oldest first."""
        return tuple(self._running)

    @property
    def shown(self) -> tuple[Job, ...]:
        """Those of them that a person sees and may cancel; the others cancel themselves, or must not be."""
        return tuple(job for job in self._running if job.shown)

    def start(
        self,
        title: str,
        work: Callable[[Callable[[float], None], Callable[[], bool]], Result],
        *,
        done: Callable[[Result], None],
        failed: Callable[[Exception], None],
        cancelled: Callable[[], None] | None = None,
        shown: bool = True,
        writes: bool = False,
        delay_ms: int = 0,
    ) -> Job:
        """Run ``work(progress, cancelled)`` in a thread; progress is announced ten times a second at most.

        It begins after the delay, as soon as a thread is free; in ``running`` it is at once. Then, in this
        object's thread, ``done(result)`` or ``failed(exception)`` is called; for a job that was cancelled
        ``cancelled()`` instead, unless it writes and has come to its end. After `close` nothing begins or is
        called, and what is returned has been cancelled.
        """
        job = Job(title, shown=shown, writes=writes)
        if self._closed:
            job.request_cancel()
            job.state = "cancelled"
            return job
        self._running.append(job)
        self.job_changed.emit(job)

        told_s = -math.inf

        def report(progress: float) -> None:
            nonlocal told_s
            now_s = time.monotonic()
            if progress >= 1.0 or now_s - told_s >= _PROGRESS_EVERY_S:
                told_s = now_s
                self._deliver(lambda: self._advance(job, progress))

        def run() -> None:
            try:
                if job.is_cancelled():
                    raise Cancelled
                result = work(report, job.is_cancelled)
            except Cancelled:
                self._deliver(partial(self._end, job, "cancelled", None, cancelled))
            except Exception as error:  # noqa: BLE001 - whatever it is, the person who waits must hear of it
                # Not by a closure, which the error's frames hold: neither would go, nor what was worked on.
                self._deliver(partial(self._end, job, "failed", partial(failed, error), cancelled))
            else:
                self._deliver(partial(self._end, job, "done", partial(done, result), cancelled))

        if delay_ms:
            QTimer.singleShot(delay_ms, self, lambda: self._waiting.put(run))
        else:
            self._waiting.put(run)
        return job

    def cancel(self, job: Job) -> None:
        """Ask a job to stop; what it was to deliver is dropped, even if it is ready, as `start` says."""
        job.request_cancel()

    def close(self) -> None:
        """Cancel everything and take no more results; waits a moment for what is being done."""
        self._closed = True
        for job in self._running:
            job.request_cancel()
        for _ in self._threads:
            self._waiting.put(None)
        patience_ends = time.monotonic() + _PATIENCE_S
        for thread in self._threads:
            thread.join(max(0.0, patience_ends - time.monotonic()))
        self._running.clear()

    def _work(self) -> None:
        while (run := self._waiting.get()) is not None:
            run()
            # Or a thread that waits for work would hold on to what the last was about: a whole volume.
            del run

    def _deliver(self, call: Callable[[], None]) -> None:
        if not self._closed:
            self._delivered.emit(call)

    def _on_delivered(self, call: Callable[[], Any]) -> None:
        if not self._closed:
            call()

    def _advance(self, job: Job, progress: float) -> None:
        job.progress = progress
        self.job_changed.emit(job)

    def _end(
        self,
        job: Job,
        state: JobState,
        then: Callable[[], None] | None,
        cancelled: Callable[[], None] | None,
    ) -> None:
        has_written = job.writes and state == "done"
        job.state = "cancelled" if job.is_cancelled() and not has_written else state
        self._running.remove(job)
        self.job_changed.emit(job)
        follow = cancelled if job.state == "cancelled" else then
        if follow is not None:
            follow()
