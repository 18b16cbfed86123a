import logging
import sys
import threading
import weakref
from pathlib import Path

import pytest
from PySide6.QtCore import QTimer, qWarning

from annotator.startup.crash_log import CrashLog


@pytest.fixture
def crash_log(qapp, tmp_path: Path):
    log = CrashLog(tmp_path / "state" / "annotator.log")
    log.start()
    yield log
    log.stop()


def fail(text: str) -> None:
    raise RuntimeError(text)


def test_error_in_a_slot_is_logged_and_shown(crash_log, qtbot):
    with qtbot.waitSignal(crash_log.unexpected_error) as shown:
        QTimer.singleShot(0, lambda: fail("volume on fire"))
    assert str(shown.args[0]) == "volume on fire"
    assert "in fail" in crash_log.path.read_text()


def test_same_error_is_shown_once_and_logged_each_time(crash_log, qtbot):
    shown = []
    crash_log.unexpected_error.connect(shown.append)
    for _ in range(3):
        try:
            fail("again")
        except RuntimeError as error:
            crash_log._on_exception(RuntimeError, error, error.__traceback__)
    try:
        raise ValueError("another")
    except ValueError as error:
        crash_log._on_exception(ValueError, error, error.__traceback__)
    qtbot.waitUntil(lambda: len(shown) == 2)
    assert [str(error) for error in shown] == ["again", "another"]
    assert crash_log.path.read_text().count("RuntimeError: again") == 3


def test_what_an_error_was_about_is_let_go_though_python_keeps_the_error(crash_log, qtbot):
    class Volume:
        pass

    volumes = []

    def read() -> None:
        volume = Volume()
        volumes.append(weakref.ref(volume))
        fail("unreadable")

    def draw() -> None:
        try:
            read()
        except RuntimeError:
            # Two errors hang on this one: what it came from, and what it came in the middle of.
            raise ValueError("undrawn") from OSError("no disk")

    with qtbot.waitSignal(crash_log.unexpected_error) as shown:
        QTimer.singleShot(0, draw)
    assert sys.last_value is shown.args[0]
    assert "in draw" in crash_log.path.read_text()
    assert volumes[0]() is None


def test_error_in_a_thread_arrives_in_the_gui_thread(crash_log, qtbot):
    threads = []
    crash_log.unexpected_error.connect(lambda error: threads.append(threading.current_thread()))
    worker = threading.Thread(target=fail, args=("in a thread",))
    worker.start()
    worker.join()
    qtbot.waitUntil(lambda: bool(threads))
    assert threads == [threading.main_thread()]
    assert "in a thread" in crash_log.path.read_text()


@pytest.mark.qt_log_ignore("slice of nothing")
def test_complaint_of_qt_is_logged(crash_log):
    qWarning("slice of nothing")
    assert "WARNING MainThread: Qt: slice of nothing" in crash_log.path.read_text()


def test_keyboard_interrupt_is_left_alone(crash_log, monkeypatch):
    handed_on = []
    monkeypatch.setattr(crash_log, "_old_hooks", (lambda *arguments: handed_on.append(arguments), None))
    crash_log._on_exception(KeyboardInterrupt, KeyboardInterrupt(), None)
    monkeypatch.undo()
    assert handed_on
    assert handed_on[0][0] is KeyboardInterrupt


def test_stopping_puts_the_old_listeners_back(qapp, tmp_path):
    before = (sys.excepthook, threading.excepthook)
    log = CrashLog(tmp_path / "annotator.log")
    log.start()
    assert sys.excepthook != before[0]
    log.stop()
    assert (sys.excepthook, threading.excepthook) == before


def test_folder_that_cannot_be_made_is_no_obstacle(qapp, tmp_path, capsys, monkeypatch):
    # Else pytest-qt takes the exception for a failure of this test.
    monkeypatch.setattr(sys, "excepthook", sys.__excepthook__)
    (tmp_path / "file").write_text("in the way")
    log = CrashLog(tmp_path / "file" / "annotator.log")
    log.start()
    try:
        try:
            fail("unlogged")
        except RuntimeError as error:
            log._on_exception(RuntimeError, error, error.__traceback__)
    finally:
        log.stop()
    assert "unlogged" in capsys.readouterr().err


def test_what_the_library_remarks_is_logged_until_the_end(crash_log):
    logging.getLogger("annotations.volumes.cache").warning("a level could not be kept")
    crash_log.stop()
    logging.getLogger("annotations.volumes.cache").warning("nobody listens")
    logged = crash_log.path.read_text()
    assert "a level could not be kept" in logged
    assert "nobody listens" not in logged
