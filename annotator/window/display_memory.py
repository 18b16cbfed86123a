"""Carries how volumes are looked at from one volume, and one start, to the next."""

from collections.abc import Mapping

import numpy as np
from PySide6.QtCore import QObject, QTimer

from annotations.volumes import intensity_window
from annotator.looks.colormaps import COLORMAPS
from annotator.session import Session
from annotator.session.viewing.view import View
from annotator.settings import Settings

_WRITE_AFTER_MS = 1000


class DisplayMemory(QObject):
    """Remembers the window that a person chose, colours and the rendering, and brings them back.

    A window is remembered by the volume's data type, and comes back only for a volume of which it shows
    something: another scanner's window may leave a picture black. The automatic window is not worth it.
    """

    def __init__(self, session: Session, settings: Settings, parent: QObject) -> None:
        super().__init__(parent)
        self._session = session
        self._settings = settings
        self._window_is_chosen = False
        # A slider moves many times a second.
        self._write_timer = QTimer(self)
        self._write_timer.setSingleShot(True)
        self._write_timer.setInterval(_WRITE_AFTER_MS)
        self._write_timer.timeout.connect(self.write)
        # After every view has drawn the new volume: a change of the view in the middle of that would
        # reach some views before the volume does.
        self._restore_timer = QTimer(self)
        self._restore_timer.setSingleShot(True)
        self._restore_timer.timeout.connect(self._restore)
        session.volume_changed.connect(self._on_session_volume_changed)
        session.view_changed.connect(self._on_session_view_changed)

    def write(self) -> None:
        """Write what was chosen into the settings now."""
        self._write_timer.stop()
        view, volume, level = self._session.view, self._session.volume, self._session.slice_level
        if volume is None or level is None or self._restore_timer.isActive():
            return
        self._settings.colormap = view.colormap
        self._settings.rendering = view.rendering
        self._settings.review_colors = view.review_colors
        if not self._window_is_chosen:
            return
        if view.window == intensity_window(level):
            self._settings.forget_display_window(volume.dtype.name)
        else:
            self._settings.remember_display_window(volume.dtype.name, view.window)

    def _restore(self) -> None:
        if looks := self._kept_looks():
            self._session.look(**looks)
            self._window_is_chosen = False

    def _kept_looks(self) -> Mapping[str, object]:
        """Return what the settings say of how the open volume is drawn, by the names of `View`."""
        volume, level = self._session.volume, self._session.slice_level
        if volume is None or level is None:
            return {}
        colormap = self._settings.colormap
        changes: dict[str, object] = {
            "rendering": self._settings.rendering,
            "review_colors": self._settings.review_colors,
        }
        if colormap in COLORMAPS:
            changes["colormap"] = colormap
        window = self._settings.display_window(volume.dtype.name)
        if window is not None and window[0] < np.nanmax(level.data) and window[1] > np.nanmin(level.data):
            changes["window"] = window
        return changes

    def _on_session_volume_changed(self) -> None:
        self._window_is_chosen = False
        self._write_timer.stop()
        if self._session.volume is not None:
            self._restore_timer.start(0)

    def _on_session_view_changed(self, before: View, after: View) -> None:
        if self._session.volume is None or self._restore_timer.isActive():
            return
        if before.window != after.window:
            self._window_is_chosen = True
        if _remembered(before) != _remembered(after):
            self._write_timer.start()


def _remembered(view: View) -> tuple[object, ...]:
    return (view.window, view.colormap, view.rendering, view.review_colors)
