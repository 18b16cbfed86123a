"""Builds the application around a session, and runs it."""

import os
import sys
from pathlib import Path

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QApplication

from annotations import __version__
from annotations.app_folders import state_folder
from annotations.geometry.frames import Vector
from annotator.looks.theme import apply_theme
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.settings import Settings
from annotator.startup.crash_log import CrashLog
from annotator.startup.freed_memory import FreedMemory
from annotator.startup.garbage import GarbageCollection
from annotator.startup.heap import share_heap
from annotator.startup.termination import Termination
from annotator.window.main_window import MainWindow

_SWITCH_INTERVAL_S = 0.0001


def make_application() -> QApplication:
    """Return the one QApplication, with the program's names."""
    # Else Qt shares out even a circle's few pixels to its threads, and wakes them thousands of times a frame.
    os.environ["QT_NO_GUI_THREADPOOL"] = "1"
    # The scene has to be a window of the system's own. Else all the panels around it became ones, too, and
    # the system was asked for the place of each whenever one of them got another size.
    QApplication.setAttribute(Qt.ApplicationAttribute.AA_DontCreateNativeWidgetSiblings)
    # For so long a thread that computes keeps the interpreter to itself when the window asks for it, which is
    # after each call of Qt's: with Python's own 5 ms the window stood still while a report was made.
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    share_heap()
    application = QApplication(sys.argv[:1])
    application.setApplicationName("oct-annotator")
    application.setApplicationDisplayName("OCT Annotator")
    application.setApplicationVersion(__version__)
    return application


def run(
    path: Path | None, *, demo: bool, annotator: str | None, tool: str | None, spacing_um: Vector | None
) -> int:
    """Open the window, and return the exit code when it is closed.

    Parameters
    ----------
    path : Path or None
        What to open at once.
    demo : bool
        Open the demo study instead.
    annotator, tool : str or None
        For this run only; else those of the settings.
    spacing_um : (float, float, float) or None
        Of the volumes that no annotation was begun on yet.
    """
    application = make_application()
    settings = Settings()
    apply_theme(settings.theme)
    crash_log = CrashLog(state_folder() / "annotator.log")
    crash_log.start()
    garbage = GarbageCollection()
    garbage.start()
    session = Session(
        SessionOptions(
            annotator_name=annotator or settings.annotator_name,
            tool_name=tool or settings.tool_name,
            method=settings.method,
            spacing_override_um=spacing_um,
            autosave_s=settings.autosave_seconds,
            cache_limit_bytes=settings.cache_limit_mib * 2**20,
            remembered_spacing=settings.spacing_answer,
            remember_spacing=settings.remember_spacing_answer,
        )
    )
    FreedMemory(session, parent=session)
    window = MainWindow(session, settings, crash_log.path)
    crash_log.unexpected_error.connect(window.questions.show_error)
    window.scene_prepared.connect(garbage.settle)
    termination = Termination(window.close)

    def begin() -> None:
        if demo:
            window.open_demo()
        elif path is not None:
            window.open_path(path)
        session.offer_recoveries()
        window.prepare_scene(after_volume=demo or path is not None)

    window.show()
    QTimer.singleShot(0, begin)
    code = application.exec()
    termination.stop()
    session.shut_down()
    garbage.stop()
    crash_log.stop()
    return code
