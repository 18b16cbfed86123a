"""A live view at work: what is shown, dropped, asked and told."""

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from annotations.errors import Cancelled, UserError
from annotations.prediction.checkpoint import CheckpointError
from annotations.prediction.inference_child import InferenceCrashed
from annotations.prediction.live.arrival import Arrival, News, Unfinished
from annotations.prediction.live.frame import FrameTimes, LiveFrame
from annotations.prediction.live.run import Listener, LiveRun
from annotations.prediction.live.statistics import LiveCounts
from annotations.prediction.live.voxel_grids import VoxelGrid
from annotations.volumes import SpacingUm, VolumeError

PATIENCE_S = 20.0
SPACING_UM: SpacingUm = (622.0, 13.5, 9.4)
NO_TIMES = FrameTimes(0.0, 0.0, 0.0, 0.0)


SHAPE = (28, 40, 30)


def arrival(
    number: int, spacing_um: SpacingUm | None = SPACING_UM, shape: tuple[int, int, int] = SHAPE
) -> Arrival:
    return Arrival(Path(f"v{number}.npy"), None, shape, spacing_um, 2, time.time())


class Scripted:
    """A source that gives what a test puts into it."""

    def __init__(self) -> None:
        self._news: list[News] = []
        self._lock = threading.Lock()
        self.error: Exception | None = None
        self.unfinished: tuple[Unfinished, ...] = ()

    def put(self, *arrivals: Arrival, **more: object) -> None:
        with self._lock:
            self._news.append(News(arrivals, **more))  # type: ignore[arg-type]

    def look(self) -> News:
        if self.error is not None:
            raise self.error
        with self._lock:
            return self._news.pop(0) if self._news else News(unfinished=self.unfinished)


class StandIn:
    """A network that looks for as long as a test lets it, and fails when it is told to."""

    def __init__(self) -> None:
        self.may_answer = threading.Semaphore(0)
        self.looked: list[tuple[str, SpacingUm, int]] = []
        self.kept: list[Path] = []
        self.errors: list[Exception] = []
        self.keep_errors: list[Exception] = []
        self.start_errors: list[Exception] = []
        self.starts = 0
        self.has_ended = False
        self.is_closed = False

    def start(self, cancelled: Callable[[], bool]) -> None:
        if cancelled():
            raise Cancelled
        self.starts += 1
        self.has_ended = False
        if self.start_errors:
            raise self.start_errors.pop(0)

    def look(
        self,
        volume_path: Path,
        *,
        dataset: str | None,
        spacing_um: SpacingUm,
        depth_axis: int,
        cancelled: Callable[[], bool],
    ) -> LiveFrame:
        self.looked.append((volume_path.name, spacing_um, depth_axis))
        while not self.may_answer.acquire(timeout=0.01):
            if cancelled():
                raise Cancelled
        if self.errors:
            raise self.errors.pop(0)
        picture = np.zeros((2, 2), dtype=np.uint8)
        return LiveFrame(volume_path, (), None, (picture,) * 3, (0.0,) * 3, (1.0,) * 3, depth_axis, NO_TIMES)

    def keep(self, folder: Path, cancelled: Callable[[], bool]) -> Path:
        if self.keep_errors:
            raise self.keep_errors.pop(0)
        self.kept.append(folder)
        return folder

    def close(self) -> None:
        self.is_closed = True


class Told:
    """What a run tells."""

    def __init__(self) -> None:
        self.ready, self.came, self.over = threading.Event(), threading.Event(), threading.Event()
        self.errors: list[UserError] = []
        self.asked: list[Arrival] = []
        self.restarting: list[None] = []
        self.ended: Exception | None = None
        self.listener = Listener(
            self.ready.set,
            lambda: self.restarting.append(None),
            self.came.set,
            self.errors.append,
            self.asked.append,
            self._end,
        )

    def _end(self, error: Exception | None) -> None:
        self.ended = error
        self.over.set()


class Bench:
    """A run, and everything around it."""

    def __init__(self, keep_in: Path | None = None) -> None:
        self.source, self.network, self.told = Scripted(), StandIn(), Told()
        self.run = LiveRun(self.source, self.network, self.told.listener, keep_in)

    def begin(self) -> None:
        self.run.start()
        assert self.told.ready.wait(PATIENCE_S)

    def until(self, holds: Callable[[], bool]) -> None:
        ends_s = time.monotonic() + PATIENCE_S
        while not holds():
            assert time.monotonic() < ends_s, "it never came true"
            time.sleep(0.005)

    def frame(self) -> str:
        """Wait for a frame, show it, and return of which volume it is."""
        assert self.told.came.wait(PATIENCE_S)
        self.told.came.clear()
        frame = self.run.take()
        assert frame is not None
        self.run.note_shown()
        return frame.volume_path.name


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.run.stop()
    made.run.join(PATIENCE_S)
    assert not made.run.is_alive


def test_volumes_are_shown_and_timed(bench: Bench) -> None:
    bench.begin()
    for number in range(3):
        bench.source.put(arrival(number))
        bench.network.may_answer.release()
        assert bench.frame() == f"v{number}.npy"

    statistics = bench.run.statistics()
    assert (statistics.shown, statistics.dropped, statistics.skipped) == (3, 0, 0)
    assert statistics.latency_s is not None
    assert 0 <= statistics.latency_s <= statistics.latency_p99_s  # type: ignore[operator]
    assert bench.network.looked[0] == ("v0.npy", SPACING_UM, 2)


def test_a_network_that_cannot_keep_up_takes_the_newest_and_the_others_are_counted(bench: Bench) -> None:
    bench.begin()
    bench.source.put(arrival(0))
    bench.until(lambda: len(bench.network.looked) == 1)
    for number in range(1, 6):
        bench.source.put(arrival(number))
    bench.source.put(arrival(6), arrival(7), passed=3)
    bench.until(lambda: bench.run.statistics().dropped == 9)
    bench.network.may_answer.release()
    assert bench.frame() == "v0.npy"
    bench.network.may_answer.release()

    assert bench.frame() == "v7.npy"
    assert [name for name, *_ in bench.network.looked] == ["v0.npy", "v7.npy"]
    assert bench.run.statistics().shown == 2


def test_a_screen_that_cannot_keep_up_gets_the_newest_frame(bench: Bench) -> None:
    bench.begin()
    bench.network.may_answer.release(3)
    for number in range(3):
        bench.source.put(arrival(number))
        bench.until(lambda: len(bench.network.looked) == number + 1)  # noqa: B023
    bench.until(lambda: bench.run.statistics().dropped == 2)

    assert bench.frame() == "v2.npy"
    assert bench.run.take() is None


def test_a_volume_that_cannot_be_shown_is_told_and_passed(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("v0.npy").touch()
    bench.begin()
    bench.network.errors = [VolumeError("it is damaged", where=Path("v0.npy"))]
    bench.network.may_answer.release(2)
    bench.source.put(arrival(0), errors=(UserError("it is none"),))
    bench.until(lambda: len(bench.told.errors) == 2)
    bench.source.put(arrival(1))

    assert bench.frame() == "v1.npy"
    assert [error.problem for error in bench.told.errors] == ["it is none", "it is damaged"]
    assert bench.run.statistics().skipped == 2


def test_a_volume_that_is_gone_before_it_is_read_is_dropped_and_told_once(bench: Bench) -> None:
    bench.begin()
    bench.network.errors = [
        VolumeError("it does not exist", where=Path(f"v{number}.npy")) for number in (0, 1)
    ]
    bench.network.may_answer.release(3)
    for number in range(2):
        bench.source.put(arrival(number))
        bench.until(lambda: bench.run.statistics().dropped == number + 1)  # noqa: B023
    bench.source.put(arrival(2))

    assert bench.frame() == "v2.npy"
    assert [error.problem for error in bench.told.errors] == ["it was gone before it was read"]
    assert bench.told.errors[0].where == Path("v0.npy")
    assert "disk" not in str(bench.told.errors[0])
    assert bench.run.statistics().skipped == 0


def test_what_is_still_being_written_is_told_until_it_is_not(bench: Bench) -> None:
    bench.begin()
    bench.source.unfinished = (Unfinished(Path("v0.npy"), 0.4),)
    bench.until(lambda: bench.run.statistics().unfinished == bench.source.unfinished)
    assert bench.run.statistics().skipped == 0

    bench.source.unfinished = ()
    bench.until(lambda: bench.run.statistics().unfinished == ())


def test_after_a_crash_it_goes_on_and_says_so(bench: Bench) -> None:
    bench.begin()
    bench.network.errors = [InferenceCrashed("it has crashed"), InferenceCrashed("it has crashed")]
    bench.network.may_answer.release(3)
    for number in range(2):
        bench.source.put(arrival(number))
        bench.until(lambda: len(bench.told.errors) == number + 1)  # noqa: B023
    bench.source.put(arrival(2))

    assert bench.frame() == "v2.npy"
    assert bench.run.statistics().restarts == len(bench.told.restarting) == 2
    assert not bench.told.over.is_set()
    # At once, not when the next volume comes.
    assert bench.network.starts == 3
    assert str(bench.told.errors[1]) == "v1.npy: it has crashed. It is being started anew."


def test_one_that_has_ended_between_two_volumes_is_started_anew_and_told(bench: Bench) -> None:
    bench.begin()
    bench.network.may_answer.release(2)
    bench.source.put(arrival(0))
    assert bench.frame() == "v0.npy"
    bench.network.has_ended = True
    bench.source.put(arrival(1))

    assert bench.frame() == "v1.npy"
    assert [error.where for error in bench.told.errors] == [Path("v0.npy")]
    assert bench.run.statistics().restarts == len(bench.told.restarting) == 1


def test_one_that_crashes_while_it_is_started_anew_counts_as_crashed_again(bench: Bench) -> None:
    bench.begin()
    bench.network.errors = [InferenceCrashed("it has crashed")]
    bench.network.start_errors = [InferenceCrashed("it has crashed"), InferenceCrashed("it has crashed")]
    bench.network.may_answer.release()
    bench.source.put(arrival(0))

    assert bench.told.over.wait(PATIENCE_S)
    assert isinstance(bench.told.ended, InferenceCrashed)
    assert bench.run.statistics().skipped == 1


def test_one_that_crashes_at_every_volume_is_given_up(bench: Bench) -> None:
    bench.begin()
    bench.network.errors = [InferenceCrashed("it has crashed") for _ in range(3)]
    bench.network.may_answer.release(3)
    for number in range(3):
        bench.source.put(arrival(number))
        bench.until(lambda: len(bench.network.looked) == number + 1)  # noqa: B023

    assert bench.told.over.wait(PATIENCE_S)
    assert isinstance(bench.told.ended, InferenceCrashed)
    assert bench.network.is_closed
    assert "3 times one after the other" in bench.told.ended.problem
    assert bench.told.ended.where == Path("v2.npy")
    assert "start the view again" in bench.told.ended.remedy
    assert len(bench.told.errors) == 2


def test_a_checkpoint_that_cannot_be_used_any_more_ends_it(bench: Bench) -> None:
    bench.begin()
    bench.network.errors = [CheckpointError("another has taken its place")]
    bench.network.may_answer.release()
    bench.source.put(arrival(0))

    assert bench.told.over.wait(PATIENCE_S)
    assert isinstance(bench.told.ended, CheckpointError)


def test_a_source_that_fails_ends_it(bench: Bench) -> None:
    bench.begin()
    bench.source.error = VolumeError("it does not exist")

    assert bench.told.over.wait(PATIENCE_S)
    assert bench.told.ended is bench.source.error


def test_an_unknown_spacing_is_asked_for_once(bench: Bench) -> None:
    bench.begin()
    bench.source.put(arrival(0, None))
    bench.until(lambda: len(bench.told.asked) == 1)
    bench.source.put(arrival(1, None))
    bench.until(lambda: bench.run.statistics().waiting == 2)
    assert not bench.network.looked
    assert bench.run.statistics().skipped == 0
    bench.network.may_answer.release(2)

    bench.run.tell_grid(SHAPE, VoxelGrid((600.0, 15.0, 10.0), 1))

    assert bench.frame() == "v1.npy"
    bench.source.put(arrival(2, None))
    assert bench.frame() == "v2.npy"
    assert len(bench.told.asked) == 1
    assert bench.network.looked[0][1:] == ((600.0, 15.0, 10.0), 1)
    statistics = bench.run.statistics()
    assert (statistics.shown, statistics.dropped, statistics.skipped, statistics.waiting) == (2, 1, 0, 0)


def test_a_shape_whose_spacing_nobody_knows_is_left_out_and_the_others_are_shown(bench: Bench) -> None:
    bench.begin()
    bench.source.put(arrival(0, None, (2, 2, 2)))
    bench.until(lambda: len(bench.told.asked) == 1)

    bench.run.decline_grid((2, 2, 2))

    bench.source.put(arrival(1, None, (2, 2, 2)))
    bench.until(lambda: bench.run.statistics().skipped == 2)
    bench.network.may_answer.release()
    bench.source.put(arrival(2))
    assert bench.frame() == "v2.npy"
    assert len(bench.told.asked) == 1
    assert bench.run.statistics().waiting == 0


def test_a_question_that_was_put_off_is_asked_again(bench: Bench) -> None:
    bench.begin()
    for number in range(2):
        bench.source.put(arrival(number, None))
        bench.until(lambda: len(bench.told.asked) == number + 1)  # noqa: B023
        bench.run.put_grid_off(SHAPE)

    assert [asked.volume_path.name for asked in bench.told.asked] == ["v0.npy", "v1.npy"]
    statistics = bench.run.statistics()
    assert (statistics.dropped, statistics.waiting) == (2, 0)


def test_what_is_shown_is_kept_where_that_is_wanted(tmp_path: Path) -> None:
    bench = Bench(keep_in=tmp_path)
    bench.begin()
    bench.network.may_answer.release()
    bench.source.put(arrival(0))

    assert bench.frame() == "v0.npy"
    bench.until(lambda: bench.network.kept == [tmp_path])
    bench.run.stop()
    bench.run.join(PATIENCE_S)


def test_what_cannot_be_kept_is_told_once_and_shown_all_the_same(tmp_path: Path) -> None:
    bench = Bench(keep_in=tmp_path)
    bench.begin()
    bench.network.keep_errors = [UserError("it cannot be written", where=tmp_path) for _ in range(2)]
    bench.network.may_answer.release(3)
    for number in range(3):
        bench.source.put(arrival(number))
        assert bench.frame() == f"v{number}.npy"

    bench.until(lambda: bench.network.kept == [tmp_path])
    [error] = bench.told.errors
    assert error.problem == "predictions are not kept: it cannot be written"
    assert error.where == tmp_path
    statistics = bench.run.statistics()
    assert (statistics.shown, statistics.skipped) == (3, 0)
    bench.run.stop()
    bench.run.join(PATIENCE_S)


def test_a_sequence_that_is_over_ends_it_after_its_last_volume(bench: Bench) -> None:
    bench.begin()
    bench.source.put(arrival(0))
    bench.source.put(is_over=True)
    bench.network.may_answer.release()

    assert bench.told.over.wait(PATIENCE_S)
    assert bench.told.ended is None
    assert bench.frame() == "v0.npy"
    assert bench.network.is_closed


def test_it_stops_in_the_middle_of_a_volume(bench: Bench) -> None:
    bench.begin()
    bench.source.put(arrival(0))
    bench.until(lambda: len(bench.network.looked) == 1)

    bench.run.stop()

    assert bench.told.over.wait(PATIENCE_S)
    assert bench.told.ended is None
    assert bench.network.is_closed


def test_frames_a_second_are_those_of_the_last_seconds() -> None:
    counts = LiveCounts()
    for number in range(100):
        counts.note_shown(number * 0.05 - 0.04, number * 0.05)

    statistics = counts.statistics(99 * 0.05)
    assert statistics.rate_hz == pytest.approx(20)
    assert statistics.latency_s == pytest.approx(0.04)
    assert counts.statistics(60.0).rate_hz == 0
    assert counts.statistics(60.0).shown == 100


def test_a_volume_that_was_there_before_has_no_latency() -> None:
    counts = LiveCounts()
    counts.note_shown(None, 10.0)

    assert counts.statistics(10.0).latency_s is None
    assert counts.statistics(10.0).shown == 1
