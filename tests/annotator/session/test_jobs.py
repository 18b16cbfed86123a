"""Background work: results in the right thread, progress, cancelling, failures."""

import threading
import time
import weakref
from collections.abc import Callable, Iterator

import pytest
from pytestqt.qtbot import QtBot

from annotations.errors import Cancelled
from annotator.session import jobs as jobs_module
from annotator.session.jobs import Jobs


@pytest.fixture
def jobs(qtbot: QtBot) -> Iterator[Jobs]:
    jobs = Jobs()
    yield jobs
    jobs.close()


def fail(error: Exception) -> None:
    raise error


def test_results_arrive_in_the_thread_that_asked(qtbot: QtBot, jobs: Jobs) -> None:
    threads: list[threading.Thread] = []
    jobs.start(
        "Count",
        lambda _progress, _cancelled: threading.current_thread(),
        done=lambda worker: threads.extend((worker, threading.current_thread())),
        failed=fail,
    )
    qtbot.waitUntil(lambda: len(threads) == 2)
    assert threads[0] is not threads[1] is threading.main_thread()
    assert jobs.running == ()


def test_progress_and_end_are_announced(qtbot: QtBot, jobs: Jobs) -> None:
    seen: list[tuple[str, float | None]] = []
    jobs.job_changed.connect(lambda job: seen.append((job.state, job.progress)))
    jobs.start("Half", lambda progress, _cancelled: progress(0.5), done=lambda _none: None, failed=fail)
    qtbot.waitUntil(lambda: seen == [("running", None), ("running", 0.5), ("done", 0.5)])


def test_progress_is_announced_now_and_then_and_at_the_end(
    qtbot: QtBot, jobs: Jobs, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs_module, "_PROGRESS_EVERY_S", 1000.0)
    seen: list[float | None] = []
    jobs.job_changed.connect(lambda job: seen.append(job.progress))

    def work(progress: Callable[[float], None], _cancelled: object) -> None:
        for step in range(101):
            progress(step / 100)

    jobs.start("Count", work, done=lambda _none: None, failed=fail)
    qtbot.waitUntil(lambda: not jobs.running)
    assert seen == [None, 0.0, 1.0, 1.0]


def test_a_cancelled_job_delivers_nothing_even_if_it_was_ready(qtbot: QtBot, jobs: Jobs) -> None:
    release = threading.Event()
    delivered: list[object] = []
    job = jobs.start("Wait", lambda _p, _c: release.wait(10), done=delivered.append, failed=delivered.append)
    jobs.cancel(job)
    release.set()
    qtbot.waitUntil(lambda: not jobs.running)
    assert job.state == "cancelled"
    assert delivered == []


def test_what_was_written_before_it_was_cancelled_is_done(qtbot: QtBot, jobs: Jobs) -> None:
    begun, release = threading.Event(), threading.Event()
    heard: list[object] = []

    def write(_progress: object, _cancelled: object) -> str:
        begun.set()
        assert release.wait(10)
        return "written"

    job = jobs.start(
        "Write",
        write,
        done=heard.append,
        failed=heard.append,
        cancelled=lambda: heard.append("cancelled"),
        writes=True,
    )
    assert begun.wait(10)
    jobs.cancel(job)
    release.set()
    qtbot.waitUntil(lambda: not jobs.running)
    assert job.state == "done"
    assert heard == ["written"]


def test_a_failure_comes_to_whoever_asked(qtbot: QtBot, jobs: Jobs) -> None:
    failures: list[Exception] = []

    def work(_progress: object, _cancelled: object) -> None:
        raise OSError("the disk is gone")

    job = jobs.start("Fail", work, done=lambda _none: None, failed=failures.append)
    qtbot.waitUntil(lambda: bool(failures))
    assert str(failures[0]) == "the disk is gone"
    assert job.state == "failed"


def test_closing_stops_work_and_takes_no_more_results(qtbot: QtBot) -> None:
    jobs = Jobs()
    begun = threading.Event()
    delivered: list[object] = []

    def work(_progress: object, cancelled: object) -> str:
        begun.set()
        while not cancelled():  # type: ignore[operator]
            pass
        return "too late"

    jobs.start("Spin", work, done=delivered.append, failed=fail)
    assert begun.wait(10)
    jobs.close()
    assert jobs.running == ()
    qtbot.wait(0)
    assert delivered == []


def test_a_delayed_job_is_running_at_once_and_works_later(qtbot: QtBot, jobs: Jobs) -> None:
    began: list[float] = []
    asked = time.monotonic()
    job = jobs.start(
        "Later",
        lambda _progress, _cancelled: began.append(time.monotonic()),
        done=lambda _none: None,
        failed=fail,
        delay_ms=60,
    )
    assert jobs.running == (job,)
    qtbot.waitUntil(lambda: not jobs.running)
    # Timers of Qt are a few milliseconds early.
    assert began[0] - asked > 0.055
    assert job.state == "done"


def test_a_job_that_is_cancelled_before_it_begins_never_does(qtbot: QtBot, jobs: Jobs) -> None:
    heard: list[str] = []
    job = jobs.start(
        "Never",
        lambda _progress, _cancelled: heard.append("worked"),
        done=lambda _none: heard.append("done"),
        failed=fail,
        cancelled=lambda: heard.append("cancelled"),
        delay_ms=20,
    )
    jobs.cancel(job)
    qtbot.waitUntil(lambda: not jobs.running)
    assert heard == ["cancelled"]


def test_nothing_begins_after_closing(qtbot: QtBot) -> None:
    jobs = Jobs()
    worked: list[str] = []
    jobs.start(
        "Never",
        lambda _progress, _cancelled: worked.append("worked"),
        done=lambda _none: worked.append("done"),
        failed=fail,
        delay_ms=10,
    )
    jobs.close()
    qtbot.wait(40)
    assert worked == []
    assert jobs.running == ()


@pytest.mark.parametrize("error", [None, Cancelled, ValueError])
def test_what_a_job_was_about_is_let_go_at_its_end(
    qtbot: QtBot, jobs: Jobs, error: type[Exception] | None
) -> None:
    class Volume:
        pass

    def start() -> weakref.ref[Volume]:
        volume = Volume()

        def read(_progress: object, _cancelled: object) -> Volume:
            if error is not None:
                raise error
            return volume

        jobs.start("Read", read, done=lambda _volume: None, failed=lambda _error: None)
        return weakref.ref(volume)

    held = start()
    qtbot.waitUntil(lambda: not jobs.running)
    # Without a collector of cycles: the tests have none.
    qtbot.waitUntil(lambda: held() is None)


def test_what_is_started_after_closing_has_been_cancelled(qtbot: QtBot) -> None:
    jobs = Jobs()
    jobs.close()
    heard: list[str] = []
    job = jobs.start(
        "Late",
        lambda _progress, _cancelled: heard.append("worked"),
        done=lambda _none: heard.append("done"),
        failed=fail,
        cancelled=lambda: heard.append("cancelled"),
    )
    qtbot.wait(0)
    assert job.state == "cancelled"
    assert jobs.running == ()
    assert heard == []
