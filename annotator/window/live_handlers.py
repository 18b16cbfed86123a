"""What the menu Predictions does about volumes that come one after the other: it shows them in a window."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget

from annotator.session import Session

if TYPE_CHECKING:
    from annotator.dialogs.live.live_window import LiveWindow


class LiveHandlers:
    """Opens the live view, of which there is one.

    Parameters
    ----------
    window : QWidget
        Parent of the live view's window.
    trigger : callable
        Triggers an action by its name.
    """

    def __init__(self, session: Session, window: QWidget, trigger: Callable[[str], object]) -> None:
        self._session = session
        self._window = window
        self._trigger = trigger
        self._shown: LiveWindow | None = None

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        return {"live_view": self._show}

    def close(self) -> None:
        """Close the live view, which ends the network's process."""
        if self._shown is not None:
            self._shown.close()

    def _show(self) -> None:
        from annotator.dialogs.live.live_window import LiveWindow  # late: few have a scanner

        if self._shown is None:
            self._shown = LiveWindow(self._session, self._window)
            self._shown.action_requested.connect(self._trigger)
        self._shown.show()
        self._shown.activateWindow()
