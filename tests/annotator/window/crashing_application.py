"""The whole application with a restless person at it, in a process that will be killed.

Run as ``python crashing_application.py FOLDER SEED``. On standard output, one JSON line each:
``{"begun": n}`` before the nth key or click, ``{"finished": keypoints}`` as soon as the window hears of an
edit.
"""

import json
import os
import random
import sys
from pathlib import Path

from annotator.startup import toolkit

toolkit.prepare(headless=True)

from PySide6.QtCore import QPoint, Qt, QTimer  # noqa: E402 - after the platform is chosen
from PySide6.QtTest import QTest  # noqa: E402

from annotator.session import Session  # noqa: E402
from annotator.session.options import SessionOptions  # noqa: E402
from annotator.settings import Settings  # noqa: E402
from annotator.startup.start import make_application  # noqa: E402
from annotator.window.main_window import MainWindow  # noqa: E402

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
KEYS = (Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_PageDown, Qt.Key.Key_U, Qt.Key.Key_O, Qt.Key.Key_S)


def report(kind: str, content: object) -> None:
    """Write one line to the pipe in one system call."""
    os.write(1, json.dumps({kind: content}).encode() + b"\n")


class RestlessPerson:
    """Clicks, drags, nudges and takes back at every turn of the event loop."""

    def __init__(self, window: MainWindow, seed: int) -> None:
        self._window = window
        self._random = random.Random(seed)
        self._begun = 0
        self._timer = QTimer(window)
        self._timer.timeout.connect(self._turn)
        window.session.volume_changed.connect(self._begin)
        window.session.document_changed.connect(self._on_session_document_changed)

    def _begin(self) -> None:
        self._window.session.set_mode("place")
        self._timer.start(0)

    def _turn(self) -> None:
        self._begun += 1
        report("begun", self._begun)
        view = self._window.slices[self._random.randrange(3)]
        choice = self._random.random()
        if choice < 0.4:
            QTest.keyClick(view, f"{self._random.randint(1, 6)}")
            QTest.mouseClick(view, LEFT, NONE, self._somewhere(view.width(), view.height()))
        elif choice < 0.6:
            start = self._somewhere(view.width(), view.height())
            QTest.mousePress(view, LEFT, NONE, start)
            QTest.mouseMove(view, start + QPoint(9, 5))
            QTest.mouseRelease(view, LEFT, NONE, start + QPoint(12, 8))
        elif choice < 0.8:
            QTest.keyClick(view, self._random.choice(KEYS))
        else:
            QTest.keyClick(view, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)

    def _somewhere(self, width: int, height: int) -> QPoint:
        return QPoint(self._random.randrange(width), self._random.randrange(height // 2, height))

    def _on_session_document_changed(self, before: object, _after: object) -> None:
        document = self._window.session.document
        if before is not None and document is not None:
            report("finished", document.model_dump(mode="json")["keypoints"])


def main(folder: Path, seed: int) -> int:
    """Open the volume in the folder, and edit until killed."""
    application = make_application()
    session = Session(
        SessionOptions(
            annotator_name="anna",
            autosave_s=0.0,
            recovery_folder=folder / "recovery",
            level_cache_folder=folder / "levels",
            user_tool_folder=folder / "tools",
        )
    )
    window = MainWindow(session, Settings(folder / "settings.ini"), folder / "annotator.log")
    person = RestlessPerson(window, seed)
    window.show()
    window.activateWindow()
    window.prepare_scene()
    window.open_path(folder / "v001.npy")
    application.exec()
    raise SystemExit(f"nobody killed {person}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
