"""How long the GUI thread cannot answer: the longest steps of its event loop, and what it did in them."""

import faulthandler
import re
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from types import TracebackType
from typing import IO

from PySide6.QtCore import Qt, QTimer

from tests.bench.frames import Frames

BEAT_MS = 2
LIMIT_MS = 50.0
"""No step is to take longer, apart from one frame of VTK."""

_SAMPLE_S = 0.005
# With less than this share of the processor, the GUI thread has mostly waited.
_WAITING = 0.4
# What is not sampled is too short to matter.
_SAMPLED_FROM_S = 0.015
_KEPT = 5
_KEPT_STACKS = 3
_NAMED_CALLS = 6
# What threads that have nothing to do are in.
_AT_REST = ("wait", "get", "_work", "select", "poll", "read_message", "_listen", "_fulfil_next")
_OURS = ("/annotator/", "/annotations/")
# Where event loops are run, and what hands jobs on.
_LOOPS = ("/annotator/startup/start.py", "/annotator/__main__.py", "/tests/bench/")
_WAYS = ("/annotator/session/jobs.py",)
_THREAD = re.compile(r"(?:Current t|T)hread (0x[0-9a-f]+)")
_CALL = re.compile(r'  File "(.*)", line (\d+) in (.*)')
_QT = "no call of the application's: Qt itself, or what it paints"


Call = tuple[str, int, str]
"""File, line and function."""

Stack = tuple[Call, ...]
"""From the outermost call on."""


@dataclass(frozen=True)
class Step:
    """One step of the event loop.

    Attributes
    ----------
    ms : float
        How long the loop did not turn, by the clock.
    cpu_ms : float
        Of the processor, by the GUI thread alone: what other work on the machine does not add to.
    frame_ms : float
        Of the clock, in the longest drawing by VTK.
    at_s : float
        Since the watch began.
    stacks : tuple of str
        Where the GUI thread was, from the outermost call on: the commonest of the samples first.
    beside : str
        Where another thread was most often: it has Python's lock where the GUI thread used little of the
        processor.
    """

    ms: float
    cpu_ms: float
    frame_ms: float
    at_s: float
    stacks: tuple[str, ...] = ()
    beside: str = ""

    @property
    def rest_ms(self) -> float:
        """How long it took, apart from one frame of VTK."""
        return self.ms - self.frame_ms

    @property
    def culprit(self) -> str:
        """What it was spent with: in the GUI thread, or else in the one that this waited for."""
        if self.beside and self.cpu_ms < _WAITING * self.rest_ms:
            return f"waiting for another thread: {self.beside}"
        return self.stacks[0] if self.stacks else "too short to be seen"


@dataclass
class Watch:
    """What a watchdog has seen.

    Attributes
    ----------
    longest : list of Step
        The longest ones apart from a frame of VTK, the longest first.
    longest_frame_ms : float
    over_limit : int
        Steps longer than `LIMIT_MS`, apart from one frame.
    """

    longest: list[Step] = field(default_factory=list)
    longest_frame_ms: float = 0.0
    over_limit: int = 0

    @property
    def rest_ms(self) -> float:
        """The longest step apart from one frame of VTK, in ms."""
        return self.longest[0].rest_ms if self.longest else 0.0

    @property
    def rest_cpu_ms(self) -> float:
        """The most of the processor that a kept step took apart from one frame of VTK, in ms."""
        return max((min(step.cpu_ms, step.rest_ms) for step in self.longest), default=0.0)

    def plain(self) -> dict[str, object]:
        """Return what was seen in types that JSON has."""
        return {
            "rest_ms": self.rest_ms,
            "rest_cpu_ms": self.rest_cpu_ms,
            "longest_frame_ms": self.longest_frame_ms,
            "over_limit": self.over_limit,
            "longest": [
                {**asdict(step), "rest_ms": step.rest_ms, "culprit": step.culprit} for step in self.longest
            ],
        }

    def add(self, step: Step) -> None:
        """Take another step in."""
        self.longest_frame_ms = max(self.longest_frame_ms, step.frame_ms)
        self.over_limit += step.rest_ms > LIMIT_MS
        self.longest = sorted([*self.longest, step], key=lambda each: -each.rest_ms)[:_KEPT]


class Watchdog:
    """Watches the GUI thread's event loop while the block of a ``with`` statement runs.

    A timer of the event loop beats every 2 ms. A thread looks what the GUI thread is doing when the beat has
    not come for a while. Where a call holds Python's lock, as one of VTK does, the look comes right after it.

    Attributes
    ----------
    watch : Watch
    frames : Frames or None
        Those of the scene; without them a frame is a step as any other.
    """

    def __init__(self, frames: Frames | None = None) -> None:
        self.watch = Watch()
        self.frames = frames
        self._gui_thread = threading.get_ident()
        self._timer = QTimer(interval=BEAT_MS, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._on_timer_timeout)
        self._ended = threading.Event()
        self._sampler = threading.Thread(target=self._sample, name="watchdog", daemon=True)
        self._samples: list[Stack] = []
        self._samples_beside: list[Stack] = []
        self._began_s = self._beat_s = 0.0
        self._beat_cpu_s = 0.0

    def __enter__(self) -> Watch:
        self._began_s = self._beat_s = time.perf_counter()
        self._beat_cpu_s = time.thread_time()
        self._timer.start()
        self._sampler.start()
        return self.watch

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self._on_timer_timeout()
        self._timer.stop()
        self._ended.set()
        self._sampler.join()

    def _on_timer_timeout(self) -> None:
        beat_s, beat_cpu_s = time.perf_counter(), time.thread_time()
        taken_s = beat_s - self._beat_s
        if taken_s > _SAMPLED_FROM_S:
            frame_s = self.frames.longest_within_s(self._beat_s, beat_s) if self.frames else 0.0
            samples, self._samples = self._samples, []
            beside, self._samples_beside = self._samples_beside, []
            self.watch.add(
                Step(
                    ms=1000 * taken_s,
                    cpu_ms=1000 * (beat_cpu_s - self._beat_cpu_s),
                    frame_ms=1000 * frame_s,
                    at_s=self._beat_s - self._began_s,
                    stacks=_commonest(samples)[:_KEPT_STACKS],
                    beside=next(iter(_commonest(beside)), ""),
                )
            )
        self._beat_s, self._beat_cpu_s = beat_s, beat_cpu_s

    def _sample(self) -> None:
        with tempfile.TemporaryFile() as file:
            self._sample_into(file)

    def _sample_into(self, file: IO[bytes]) -> None:
        while not self._ended.wait(_SAMPLE_S):
            beat_s = self._beat_s
            if time.perf_counter() - beat_s < _SAMPLED_FROM_S:
                self._samples, self._samples_beside = [], []
                continue
            stacks = _stacks(file)
            if beat_s == self._beat_s:
                own = {self._gui_thread, threading.get_ident()}
                self._samples += [stack for thread, stack in stacks.items() if thread == self._gui_thread]
                self._samples_beside += [
                    stack
                    for thread, stack in stacks.items()
                    if thread not in own and stack[-1][2] not in _AT_REST
                ]


def _stacks(file: IO[bytes]) -> dict[int, Stack]:
    """Return the calls of each thread, from the outermost on; the file is written over.

    C code writes them down, which holds nothing. Who looks at `sys._current_frames` holds the frames of the
    window's thread as long, and what is in them: painters that outlive their painting, until Qt crashes.
    """
    file.seek(0)
    file.truncate()
    faulthandler.dump_traceback(file, all_threads=True)
    file.seek(0)
    stacks: dict[int, Stack] = {}
    thread, calls = 0, []
    for line in file.read().decode(errors="replace").splitlines():
        if (begins := _THREAD.match(line)) is not None:
            thread, calls = int(begins[1], 16), []
        elif (call := _CALL.match(line)) is not None:
            calls.append((call[1], int(call[2]), call[3]))
            stacks[thread] = tuple(reversed(calls))
    return stacks


def _commonest(samples: Sequence[Stack]) -> tuple[str, ...]:
    """Return the stacks in words, the commonest first, but those without a call of the application's last."""
    named = [_words(stack) for stack in samples]
    return tuple(sorted(set(named), key=lambda each: (each != _QT, named.count(each)), reverse=True))


def _words(stack: Stack) -> str:
    """Return the application's own calls in a stack, and the innermost call, in one line."""
    innermost, _, _ = stack[-1]
    if any(loop in innermost for loop in _LOOPS):
        return _QT
    named = [
        f"{_module(filename)}:{line} {function}"
        for place, (filename, line, function) in enumerate(stack, start=1)
        if place == len(stack) or (_is_own(filename) and not function.startswith("<"))
    ]
    return " → ".join(["…", *named[-_NAMED_CALLS:]] if len(named) > _NAMED_CALLS else named)


def _is_own(filename: str) -> bool:
    return any(folder in filename for folder in _OURS) and not any(
        way in filename for way in (*_LOOPS, *_WAYS)
    )


def _module(filename: str) -> str:
    for folder in _OURS:
        if folder in filename:
            return f"{folder[1:]}{filename.rpartition(folder)[2]}"
    return filename.rpartition("/site-packages/")[2].rpartition("/lib/")[2]
