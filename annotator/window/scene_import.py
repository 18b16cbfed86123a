"""The import of what the first volume and the scene need, which takes seconds: in a thread."""

import importlib
import logging

from PySide6.QtCore import QObject, QTimer, Signal, Slot
from PySide6.QtGui import QGuiApplication

from annotations.app_folders import cache_folder
from annotations.fitting.pose_fit import prepare_fitting
from annotations.volumes import prepare_cache
from annotator.looks.redrawing import Redrawing
from annotator.scene.compiled_classes import kept_classes
from annotator.scene.drivers import load_drivers
from annotator.scene.libraries import load_libraries
from annotator.session import Session
from annotator.window.qt_classes import QtClasses

_log = logging.getLogger(__name__)

_PATIENCE_MS = 1000
"""A volume that comes later lets the import begin before it."""


class SceneImport(QObject):
    """Loads Mayavi, VTK, and what levels and the fit need, in a thread.

    Signals
    -------
    imported
    failed : Exception
    """

    imported = Signal()
    failed = Signal(object)

    def __init__(self, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._session = session
        self._qt_classes = QtClasses(self)
        self._beginning = Redrawing(self.begin, self)
        self._patience = QTimer(self, singleShot=True, interval=_PATIENCE_MS)
        self._patience.timeout.connect(self.begin)
        session.volume_changed.connect(self._on_session_volume_changed)

    def begin_after_volume(self) -> None:
        """Begin once a volume that is being opened has been painted.

        The import keeps Python's lock, and a processor, from whoever paints it.
        """
        self._patience.start()

    @Slot()
    def begin(self) -> None:
        """Begin now."""
        self._patience.stop()
        self._qt_classes.make(self._import)

    def complete(self) -> None:
        """Import, once the scene has been drawn, what comparing annotators needs.

        Whoever presses the button would wait for Python's lock while the window is drawn.
        """
        self._session.jobs.start(
            "Preparing comparisons",
            lambda _progress, _cancelled: importlib.import_module("annotations.agreement.comparison"),
            done=lambda _: None,
            failed=lambda error: _log.warning("Comparisons are not prepared: %s", error),
            shown=False,
        )

    def stop(self) -> None:
        """Begin nothing more, and call nobody."""
        self._patience.stop()
        self._beginning.drop()
        self._qt_classes.stop()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        if self._patience.isActive() and self._session.volume is not None:
            self._patience.stop()
            self._beginning.ask_apart()

    def _import(self) -> None:
        platform = QGuiApplication.platformName()
        self._session.jobs.start(
            "Preparing the scene",
            lambda _progress, _cancelled: _load_for_fit_and_scene(platform),
            done=lambda _: self.imported.emit(),
            failed=self.failed.emit,
            shown=False,
        )


def _load_for_fit_and_scene(platform: str) -> None:
    # First what takes less: the first level and the first fit need not wait for Mayavi.
    prepare_cache()
    prepare_fitting()
    load_libraries()
    with kept_classes(cache_folder()):
        importlib.import_module("annotator.scene.stage")
    load_drivers(platform)
