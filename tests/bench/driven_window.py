"""The real application's window, driven as a person would; every frame is waited for."""

import time
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, QEventLoop, QObject, Qt, QTimer
from PySide6.QtWidgets import QApplication, QWidget

from annotator.looks.redrawing import Redrawing
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.session.viewing.view import Pane
from annotator.settings import Settings
from annotator.slices.slice_view import SliceView
from annotator.startup.freed_memory import FreedMemory
from annotator.startup.garbage import GarbageCollection
from annotator.startup.start import make_application
from annotator.window.four_up import SLICE_PANES
from annotator.window.main_window import MainWindow
from tests.bench.frames import Frames

CANVAS_PX = (1063, 851)
"""Of the peer's canvas, which ours is made as large as."""

PATIENCE_S = 900.0
_WINDOW_PX = (1400, 900)
_FITTING_TRIES = 5


class DrivenWindow:
    """One session and its window.

    Parameters
    ----------
    folder : Path
        For settings, recovery journals and levels of its own.
    canvas_px : (int, int)
        Width and height of the scene, or of a slice, that fills the window.

    Attributes
    ----------
    frames : Frames or None
        Those of the scene, once it is there.
    paintings : tuple of Paintings
        Those of the slices.
    level_folder : Path
        Where averaged levels are kept.
    """

    def __init__(
        self, folder: Path, annotator: str = "bench", canvas_px: tuple[int, int] = CANVAS_PX
    ) -> None:
        self._canvas_px = canvas_px
        application = QApplication.instance()
        self.application = application if isinstance(application, QApplication) else make_application()
        self.level_folder = folder / "levels"
        self.garbage = GarbageCollection()
        self.garbage.start()
        self.session = Session(
            SessionOptions(
                annotator_name=annotator,
                recovery_folder=folder / "recovery",
                level_cache_folder=self.level_folder,
            )
        )
        FreedMemory(self.session, parent=self.session)
        self.window = MainWindow(self.session, Settings(folder / "settings.ini"), folder / "log", asks=False)
        self.window.scene_prepared.connect(self.garbage.settle)
        self._errors: list[Exception] = []
        self.session.error_raised.connect(self._errors.append)
        self.window.resize(*_WINDOW_PX)
        self.window.show()
        self.frames: Frames | None = None
        self.paintings = tuple(Paintings(view) for view in self.window.slices)

    def wait(self, ready: Callable[[], bool], patience_s: float = PATIENCE_S) -> None:
        """Run the event loop until something holds; an error that a person would see is raised."""
        if ready():
            return
        loop, ends_s = QEventLoop(), time.perf_counter() + patience_s

        def look() -> None:
            if self._errors or ready() or time.perf_counter() > ends_s:
                loop.quit()

        timer = QTimer(interval=1, timerType=Qt.TimerType.PreciseTimer)
        timer.timeout.connect(look)
        timer.start()
        loop.exec()
        timer.stop()
        if self._errors:
            raise self._errors[0]
        if time.perf_counter() > ends_s:
            raise TimeoutError("the window did not become ready")

    def ms_until(self, work: Callable[[], object], ready: Callable[[], bool]) -> float:
        """Return how long it takes from a call until something holds."""
        begun_s = time.perf_counter()
        work()
        self.wait(ready)
        return 1000 * (time.perf_counter() - begun_s)

    def prepare_scene(self) -> None:
        """Load the scene, as the application does once its window is shown."""
        self.window.prepare_scene()
        self.wait(lambda: not self.session.jobs.running and self.window.scene._stage is not None)
        stage = self.window.scene._stage
        assert stage is not None
        self.frames = Frames(stage.canvas.window)

    def open(self, path: Path) -> None:
        """Open a path, and wait until nothing more of it is to come, and all of it is drawn."""
        self.session.open_path(path)
        self.wait(lambda: self.session.volume is not None)
        self.settle()

    def settle(self) -> None:
        """Wait until no job runs, seen slices are sharp, and all is drawn, the scene at its best."""
        views, scene = self.window.slices, self.window.scene
        redrawings = self.window.findChildren(Redrawing)
        self.wait(
            lambda: (
                not self.session.jobs.running
                and not any(redrawing.is_owed for redrawing in redrawings)
                and all(view.is_sharp for view in views if view.isVisible())
                and (scene.is_at_rest or not scene.isVisible())
            )
        )
        self.application.processEvents()

    def pause(self, pause_s: float) -> None:
        """Run the event loop for so long, as when a person's hand rests."""
        ends_s = time.perf_counter() + pause_s
        self.wait(lambda: time.perf_counter() > ends_s)

    def show_pane(self, pane: Pane | None) -> None:
        """Let one pane fill the window, its image as large as the peer's canvas; None for all four."""
        self.session.look(maximized=pane)
        self.application.processEvents()
        if pane is not None:
            self._fit(self._image_of(pane))
        self.settle()

    def frame_ms(self, change: Callable[[], object]) -> tuple[float, float]:
        """Return how long it takes from a call until the scene's next frame is on the screen.

        Whatever else the change makes Qt paint on the way there counts too. First by the clock, then of the
        processor by all threads, which other work on the machine adds little to.
        """
        assert self.frames is not None
        begun_s, begun_cpu_s, count = time.perf_counter(), time.process_time(), self.frames.count
        change()
        while self.frames.count == count:
            if time.perf_counter() - begun_s > PATIENCE_S:
                raise TimeoutError("the scene was not drawn")
            self.application.processEvents()
        self.frames.wait_for_gl()
        return 1000 * (time.perf_counter() - begun_s), 1000 * (time.process_time() - begun_cpu_s)

    def panels_ms(self, change: Callable[[], object]) -> float:
        """Return how long it takes from a call until the panels, drawn after the scene, are painted too."""
        begun_s = time.perf_counter()
        change()
        redrawings = self.window.findChildren(Redrawing)
        while any(redrawing.is_owed for redrawing in redrawings):
            self.application.processEvents()
        # What has just been drawn anew is painted.
        self.application.processEvents()
        return 1000 * (time.perf_counter() - begun_s)

    def close(self) -> None:
        """Close the window and end the session."""
        self.window.close()
        self.session.shut_down()
        self.garbage.stop()

    def _image_of(self, pane: Pane) -> QWidget:
        if pane == "scene":
            stage = self.window.scene._stage
            assert stage is not None
            return stage.canvas.widget
        return self.window.slices[SLICE_PANES.index(pane)]

    def _fit(self, view: QWidget) -> None:
        """Change the window's size until one of its widgets has the canvas's."""
        for _ in range(_FITTING_TRIES):
            more = (self._canvas_px[0] - view.width(), self._canvas_px[1] - view.height())
            if more == (0, 0):
                return
            self.window.resize(self.window.width() + more[0], self.window.height() + more[1])
            self.application.processEvents()


class Paintings(QObject):
    """Notes each painting of a slice: Qt's own paint events, none of which it changes.

    Attributes
    ----------
    count, fine_count, sharp_count : int
        How often the slice was painted, how often as sharp as the screen can show it, and how often in full
        resolution.
    times_s : list of float
        When each painting of a volume's slice ended, by `time.perf_counter`. On the screen it is a little
        later: Qt copies the picture of the window right after.
    """

    def __init__(self, view: SliceView) -> None:
        super().__init__(view)
        self._view = view
        self.count = self.fine_count = self.sharp_count = 0
        self.times_s: list[float] = []
        view.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() != QEvent.Type.Paint:
            return False
        # Here and now, so that what is counted has been painted.
        drawn_before = self._view.times_drawn
        watched.event(event)
        self.count += 1
        if self._view.times_drawn > drawn_before:
            self.times_s.append(time.perf_counter())
        self.fine_count += self._view.is_fine
        self.sharp_count += self._view.is_sharp
        return True
