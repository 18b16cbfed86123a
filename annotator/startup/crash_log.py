"""Unexpected errors: each into a log file, and once before the eyes of the person; the program goes on."""

import faulthandler
import logging
import logging.handlers
import sys
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from PySide6.QtCore import QMessageLogContext, QObject, Qt, QtMsgType, Signal, qInstallMessageHandler

_LOG_BYTES = 1_000_000
_OLD_LOGS = 3
_LEVELS = {
    QtMsgType.QtDebugMsg: logging.DEBUG,
    QtMsgType.QtInfoMsg: logging.INFO,
    QtMsgType.QtWarningMsg: logging.WARNING,
    QtMsgType.QtCriticalMsg: logging.ERROR,
    QtMsgType.QtFatalMsg: logging.CRITICAL,
}


class CrashLog(QObject):
    """Takes what nobody caught, in any thread, and Qt's own complaints.

    Parameters
    ----------
    path : Path
        The log file; its folder is made. A few older ones are kept beside it.

    Signals
    -------
    unexpected_error : Exception
        Emitted in the GUI thread, once for each place in the program that fails.
    """

    unexpected_error = Signal(object)
    _caught = Signal(object)

    def __init__(self, path: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.path = path
        self._seen: set[str] = set()
        self._logger = logging.getLogger("annotator")
        # The library speaks under its own name.
        self._heard = (self._logger, logging.getLogger("annotations"))
        self._handler = _handler(path)
        self._handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(threadName)s: %(message)s"))
        self._fault_stream: TextIO | None = None
        self._old_hooks = (sys.excepthook, threading.excepthook)
        self._old_message_handler: Callable[[QtMsgType, QMessageLogContext, str], Any] | None = None
        self._caught.connect(self._on_caught, Qt.ConnectionType.QueuedConnection)

    def start(self) -> None:
        """Begin to listen."""
        for logger in self._heard:
            logger.setLevel(logging.INFO)
            logger.addHandler(self._handler)
        sys.excepthook = self._on_exception
        threading.excepthook = self._on_thread_exception
        self._old_message_handler = qInstallMessageHandler(self._on_qt_message)
        if isinstance(self._handler, logging.FileHandler):
            # A fault in Qt, VTK or a driver ends the program at once: at least the place is kept.
            self._fault_stream = self.path.with_suffix(".fault.log").open("w")
            faulthandler.enable(self._fault_stream)

    def stop(self) -> None:
        """Stop listening, and put back what listened before."""
        sys.excepthook, threading.excepthook = self._old_hooks
        qInstallMessageHandler(self._old_message_handler)
        if self._fault_stream is not None:
            faulthandler.disable()
            self._fault_stream.close()
            self._fault_stream = None
        for logger in self._heard:
            logger.removeHandler(self._handler)
        self._handler.close()

    def _on_exception(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        if not isinstance(error, Exception):
            # Ctrl+C in the terminal, or an exit: not for us.
            self._old_hooks[0](kind, error, trace)
            return
        self._logger.error("unexpected error", exc_info=(kind, error, trace))
        if isinstance(self._handler, logging.NullHandler):
            self._old_hooks[0](kind, error, trace)
        self._caught.emit(error)

    def _on_thread_exception(self, arguments: threading.ExceptHookArgs) -> None:
        if arguments.exc_value is not None:
            self._on_exception(arguments.exc_type, arguments.exc_value, arguments.exc_traceback)

    def _on_qt_message(self, kind: QtMsgType, _: QMessageLogContext, message: str | None) -> None:
        self._logger.log(_LEVELS.get(kind, logging.WARNING), "Qt: %s", message)

    def _on_caught(self, error: Exception) -> None:
        place = _place(error)
        _let_go(error)
        if place not in self._seen:
            self._seen.add(place)
            self.unexpected_error.emit(error)


def _handler(path: Path) -> logging.Handler:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return logging.handlers.RotatingFileHandler(
            path, maxBytes=_LOG_BYTES, backupCount=_OLD_LOGS, encoding="utf-8", delay=False
        )
    except OSError:
        # A read-only home is no reason not to start; errors then go to standard error.
        return logging.NullHandler()


def _place(error: Exception) -> str:
    """Name the kind of an error and the line that raised it: what makes two errors the same one."""
    frames = traceback.extract_tb(error.__traceback__)
    return f"{type(error).__name__} {frames[-1].filename}:{frames[-1].lineno}" if frames else repr(error)


def _let_go(error: BaseException | None) -> None:
    """Clear what an error was about, a whole volume maybe, out of the frames that it came through.

    Python keeps the last error that nobody caught, in `sys.last_value`, until the next one.
    """
    let_go: set[int] = set()
    linked = [error]
    while linked:
        error = linked.pop()
        # An error may have been raised from itself.
        if error is not None and id(error) not in let_go:
            let_go.add(id(error))
            traceback.clear_frames(error.__traceback__)
            linked += [error.__cause__, error.__context__]
