"""A bar that shows how far something is."""

from PySide6.QtWidgets import QProgressBar


class ProgressBar(QProgressBar):
    """A progress bar that is painted when everything else is.

    Qt's own is painted at once, and with it whatever else waits in its window: in the middle of a change that
    many panels follow, most of them would be painted twice.
    """

    def show_progress(self, value: int, of: int) -> None:
        """Show that a part is done; of nothing, that something goes on without an end in sight."""
        self.setUpdatesEnabled(False)
        self.setRange(0, of)
        self.setValue(value)
        # It is painted once this is so again.
        self.setUpdatesEnabled(True)
