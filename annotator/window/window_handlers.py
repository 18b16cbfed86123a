"""What concerns the window itself: its dialogs, its colours, its panels."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path

from PySide6.QtCore import QByteArray, QSize, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QDockWidget, QMainWindow

from annotator.actions.table import sheet_rows
from annotator.dialogs.about_dialog import AboutDialog
from annotator.dialogs.settings_dialog import SettingsDialog
from annotator.dialogs.shortcut_sheet import ShortcutSheet
from annotator.looks.theme import THEMES, Theme, apply_theme
from annotator.session import Session
from annotator.settings import Settings
from annotator.window.four_up import FourUp
from annotator.window.questions import Questions

_FIRST_SIZE = QSize(1600, 1000)
# What the system's frame takes: it is drawn around the window only after that is shown.
_FRAME_SIZE = QSize(16, 56)


class WindowHandlers:
    """Shows and hides the window's parts and asks for a person's choices.

    Parameters
    ----------
    docks : mapping
        The panels' docks by the names of their panels.
    log_path : Path
        The log of unexpected errors.
    """

    def __init__(
        self,
        session: Session,
        settings: Settings,
        questions: Questions,
        window: QMainWindow,
        four_up: FourUp,
        docks: Mapping[str, QDockWidget],
        log_path: Path,
    ) -> None:
        self._session = session
        self._settings = settings
        self._questions = questions
        self._window = window
        self._four_up = four_up
        self._docks = docks
        self._log_path = log_path
        self._first_layout = QByteArray()

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        themes = {f"theme_{theme}": partial(self._choose_theme, theme) for theme in THEMES}
        panels = {f"panel_{name}": partial(self._toggle_panel, name) for name in self._docks}
        return (
            themes
            | panels
            | {
                "reset_layout": self._reset_layout,
                "full_screen": self._toggle_full_screen,
                "settings": self._change_settings,
                "shortcut_sheet": lambda: self._questions.show(ShortcutSheet(sheet_rows(), self._window)),
                "open_log": self._open_log,
                "about": lambda: self._questions.show(AboutDialog(self._window)),
            }
        )

    def checked(self) -> Iterator[str]:
        """Yield the names of the actions that are on."""
        yield f"theme_{self._settings.theme}"
        if self._window.isFullScreen():
            yield "full_screen"
        for name, dock in self._docks.items():
            # Behind another tab is not closed.
            if not dock.isHidden():
                yield f"panel_{name}"

    def restore_layout(self) -> None:
        """Give the window the size and the panes that it had last; its docks come once it is shown."""
        window, settings = self._window, self._settings
        window.resize(_FIRST_SIZE.boundedTo(window.screen().availableSize() - _FRAME_SIZE))
        if not settings.window_geometry.isEmpty():
            window.restoreGeometry(settings.window_geometry)
        if not settings.panes_state.isEmpty():
            self._four_up.restore(settings.panes_state)

    def write_layout(self) -> None:
        """Write the layout into the settings, for the next start."""
        self._settings.window_geometry = self._window.saveGeometry()
        self._settings.window_state = self._window.saveState()
        self._settings.panes_state = self._four_up.state()
        self._settings.flush()

    def keep_layout(self) -> None:
        """Remember the present layout as the one to come back to."""
        self._first_layout = self._window.saveState()

    def _choose_theme(self, theme: Theme) -> None:
        self._settings.theme = theme
        apply_theme(theme)

    def _toggle_panel(self, name: str) -> None:
        dock = self._docks[name]
        shown = dock.isHidden()
        dock.setVisible(shown)
        if shown:
            dock.raise_()

    def _reset_layout(self) -> None:
        self._window.restoreState(self._first_layout)
        self._four_up.reset()
        self._session.look(maximized=None)

    def _toggle_full_screen(self) -> None:
        if self._window.isFullScreen():
            self._window.showNormal()
        else:
            self._window.showFullScreen()

    def _change_settings(self) -> None:
        dialog = SettingsDialog(self._settings, self._window)
        dialog.accepted.connect(self._on_dialog_accepted)
        self._questions.show(dialog)

    def _on_dialog_accepted(self) -> None:
        apply_theme(self._settings.theme)
        self._session.set_annotator_name(self._settings.annotator_name)
        self._session.set_autosave(self._settings.autosave_seconds)

    def _open_log(self) -> None:
        if self._log_path.exists():
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._log_path)))
            self._session.post_message(f"The log is {self._log_path}")
        else:
            self._session.post_message("There is no log yet: nothing unexpected has happened")
