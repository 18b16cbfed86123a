"""The window drawn into a picture, without a display and without a question."""

import sys
import tempfile
import traceback
from pathlib import Path

from PySide6.QtCore import QBuffer, QIODevice, QPoint, QSize, QTimer
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QApplication

from annotations.durable_files import replace_durably
from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotations.volumes import DatasetChoice, Volume
from annotator.looks.redrawing import owes_drawing
from annotator.looks.theme import apply_theme
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.session.volumes.spacing_answer import SpacingAnswer
from annotator.settings import Settings
from annotator.startup.crash_log import CrashLog
from annotator.startup.garbage import GarbageCollection
from annotator.startup.start import make_application
from annotator.window.main_window import MainWindow

_UNIT_UM: Vector = (1.0, 1.0, 1.0)
_LOOK_EVERY_MS = 50
_PATIENCE_MS = 30 * 60 * 1000


class Photographer:
    """Opens a path in a window, waits until nothing more is to come, and keeps the picture.

    Attributes
    ----------
    code : int
        0 if a picture was taken, 1 if the path could not be opened or the picture not be written.
    """

    def __init__(self, window: MainWindow, picture_path: Path) -> None:
        self.code = 1
        self._window = window
        self._session = window.session
        self._picture_path = picture_path
        self._failed = False
        self._timer = QTimer(window)
        self._timer.setInterval(_LOOK_EVERY_MS)
        self._timer.timeout.connect(self._on_timer_timeout)
        self._waited_ms = 0
        session = self._session
        session.spacing_requested.connect(self._on_session_spacing_requested)
        session.dataset_requested.connect(self._on_session_dataset_requested)
        session.error_raised.connect(self._on_session_error_raised)
        session.checkpoints.opened.connect(self._on_checkpoints_answered)
        session.checkpoints.conversion_requested.connect(self._on_checkpoints_answered)

    def begin(self, path: Path | None) -> None:
        """Open a path, or the demo study, and take the picture when all of it is there."""
        if path is None:
            self._window.open_demo()
        else:
            self._session.open_path(path)
        self._window.prepare_scene()
        self._timer.start()

    def give_up(self, error: Exception) -> None:
        """Leave without a picture because of an error that nobody foresaw."""
        _say("".join(traceback.format_exception(error)))
        self._failed = True

    def _on_session_spacing_requested(self, volume: Volume, _offered_um: object) -> None:
        self._window.status.say_spacing_is_unknown()
        self._session.provide_spacing(volume.path, SpacingAnswer(_UNIT_UM, volume.depth_axis, "once"))

    def _on_session_dataset_requested(self, path: Path, choices: tuple[DatasetChoice, ...]) -> None:
        largest = max(choices, key=lambda choice: choice.shape[0] * choice.shape[1] * choice.shape[2])
        _say(f"{path}: several arrays; this is {largest.name!r}, the largest.")
        self._session.provide_dataset(path, largest.name)

    def _on_session_error_raised(self, error: UserError) -> None:
        _say(str(error))
        # What comes with a volume that is open is a warning.
        self._failed = self._session.volume is None

    def _on_checkpoints_answered(self, _: object) -> None:
        _say("A picture shows a volume. What a checkpoint is says 'annotations checkpoint info'.")
        self._failed = True

    def _on_timer_timeout(self) -> None:
        self._waited_ms += _LOOK_EVERY_MS
        if self._failed or self._waited_ms > _PATIENCE_MS:
            self._finish()
        elif self._is_complete():
            self._take()
            self._finish()

    def _is_complete(self) -> bool:
        if self._session.volume is None or self._session.jobs.running or not self._window.scene.isVisible():
            return False
        if owes_drawing(self._window):
            return False
        # A disk that gives no more leaves the coarse slices.
        return self._window.fetcher.is_failing or all(view.is_sharp for view in self._window.slices)

    def _take(self) -> None:
        window = self._window
        scene = window.scene.picture()
        picture = window.grab()
        painter = QPainter(picture)
        # On a real display the scene has a native window of its own, that a grab leaves out.
        painter.drawImage(window.scene.mapTo(window, QPoint(0, 0)), scene)
        painter.end()
        buffer = QBuffer()
        buffer.open(QIODevice.OpenModeFlag.WriteOnly)
        picture.save(buffer, "PNG")
        try:
            replace_durably(self._picture_path, bytes(buffer.data().data()))
        except UserError as error:
            _say(str(error))
        else:
            self.code = 0

    def _finish(self) -> None:
        self._timer.stop()
        self._window.close()
        QApplication.exit(self.code)


def take_screenshot(
    picture_path: Path,
    path: Path | None,
    *,
    annotator: str | None,
    tool: str | None,
    spacing_um: Vector | None,
    size: tuple[int, int],
) -> int:
    """Draw the window with a path open in it into a PNG file, and return the exit code.

    Nothing of the user's is changed: settings, recovery journals and the answer to what is unknown are this
    call's own.

    Parameters
    ----------
    path : Path or None
        None for the demo study.
    size : (int, int)
        Width and height in pixels.
    """
    application = make_application()
    apply_theme("dark")
    with tempfile.TemporaryDirectory(prefix="oct-annotator-") as name:
        folder = Path(name)
        settings = Settings(folder / "settings.ini")
        session = Session(
            SessionOptions(
                annotator_name=annotator or Settings().annotator_name,
                tool_name=tool or Settings().tool_name,
                method=Settings().method,
                spacing_override_um=spacing_um,
                autosave_s=0.0,
                recovery_folder=folder / "recovery",
            )
        )
        crash_log = CrashLog(folder / "annotator.log")
        crash_log.start()
        garbage = GarbageCollection()
        garbage.start()
        window = MainWindow(session, settings, crash_log.path, asks=False)
        window.resize(QSize(*size))
        window.show()
        photographer = Photographer(window, picture_path)
        crash_log.unexpected_error.connect(photographer.give_up)
        QTimer.singleShot(0, lambda: photographer.begin(path))
        application.exec()
        session.shut_down()
        garbage.stop()
        crash_log.stop()
    return photographer.code


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")
