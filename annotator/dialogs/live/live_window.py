"""The live view's window: volumes and the predicted pose as they come."""

from datetime import datetime
from typing import TYPE_CHECKING

from PySide6.QtCore import QSize, Qt, QTimer, Signal, Slot
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QHBoxLayout, QPlainTextEdit, QPushButton, QVBoxLayout, QWidget

from annotations.errors import UserError
from annotations.volumes import Volume, offered_spacing_um, open_volume
from annotator.dialogs.files.spacing_dialog import SpacingDialog
from annotator.dialogs.live.live_projections import LiveProjections
from annotator.dialogs.live.live_readings import LiveReadings
from annotator.dialogs.live.live_source import LiveSource
from annotator.looks.folding import scrolling
from annotator.looks.labels import ElidedText
from annotator.looks.naming import named
from annotator.session import Session

if TYPE_CHECKING:
    from annotations.prediction.live.arrival import Arrival, Unfinished

_STATISTICS_EVERY_MS = 250
_MOST_MESSAGES = 200
_MESSAGE_LINES = 3
_NO_CHECKPOINT = "No checkpoint is loaded"
_CHOOSE_FOLDER = "Choose a folder, and start."
_CHOOSE_CHECKPOINT = "Load a checkpoint, which is to look at the volumes."
_STARTING = "The network is being made ready…"
_RESTARTING = "The network has crashed, and is being started anew…"
_STOPPED = "The live view has stopped"
_WAITING = "Waiting for a volume…"
_MOST_UNFINISHED = 3
"""Named one by one."""


class LiveWindow(QWidget):
    """Shows what a network sees in each volume that comes, and where it has the tool.

    Closing it ends the network's process, and takes away what was shown.

    Signals
    -------
    action_requested : str
        The name of one of the program's actions: a checkpoint is to be loaded.
    """

    action_requested = Signal(str)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self._session = session
        self._living = session.living
        self.setObjectName("live_window")
        self.setWindowTitle("Live view")
        self._source = LiveSource()
        self._source.changed.connect(self._draw)
        self._checkpoint = ElidedText(name="live_checkpoint")
        self._load = named(QPushButton("&Load…"), "live_load", tooltip="Load a checkpoint from a file")
        self._load.clicked.connect(self._on_load_clicked)
        self._ship = named(QPushButton("&The one that ships"), "live_ship")
        self._ship.setToolTip("Load the checkpoint that comes with the program for the tool in use")
        self._ship.clicked.connect(self._on_ship_clicked)
        self._start = named(QPushButton(), "live_start")
        self._start.setDefault(True)
        self._start.clicked.connect(self._on_start_clicked)
        self.projections = LiveProjections()
        self._readings = LiveReadings()
        self._unfinished = ElidedText(name="live_unfinished")
        # Its room stays, so that the pictures do not jump.
        policy = self._unfinished.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self._unfinished.setSizePolicy(policy)
        self._unfinished.setVisible(False)
        self._questions: list[Arrival] = []
        self._is_asking = False
        self._messages = named(QPlainTextEdit(), "live_messages", title="Messages")
        self._messages.setReadOnly(True)
        self._messages.setMaximumBlockCount(_MOST_MESSAGES)
        self._messages.setPlaceholderText("Volumes that cannot be shown, and other troubles, are told here")
        self._messages.setFixedHeight((_MESSAGE_LINES + 1) * self.fontMetrics().lineSpacing())
        self._timer = QTimer(self)
        self._timer.setInterval(_STATISTICS_EVERY_MS)
        self._timer.timeout.connect(self._draw_statistics)
        self._lay_out()
        living = self._living
        living.running_changed.connect(self._on_living_running_changed)
        living.frame_came.connect(self._on_living_frame_came)
        living.failed.connect(self._on_living_failed)
        living.stopped.connect(self._on_living_stopped)
        living.kept_from_view.connect(self._clear)
        living.grid_requested.connect(self._on_living_grid_requested)
        session.predicting.checkpoints_changed.connect(self._draw)
        self._draw()
        self._draw_statistics()

    def sizeHint(self) -> QSize:
        return QSize(1060, 720)

    def closeEvent(self, event: QCloseEvent) -> None:
        self._living.leave()
        self._clear()
        super().closeEvent(event)

    def _lay_out(self) -> None:
        checkpoint = QHBoxLayout()
        checkpoint.addWidget(self._checkpoint, 1)
        checkpoint.addWidget(self._ship)
        checkpoint.addWidget(self._load)
        checkpoint.addWidget(self._start)
        readings = scrolling(self._readings, "live_readings_scroll")
        readings.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        readings.setFixedWidth(self._readings.minimumWidth() + 2 * self.fontMetrics().height())
        middle = QHBoxLayout()
        middle.addWidget(self.projections, 1)
        middle.addWidget(readings)
        layout = QVBoxLayout(self)
        layout.addWidget(self._source)
        layout.addLayout(checkpoint)
        layout.addLayout(middle, 1)
        layout.addWidget(self._unfinished)
        layout.addWidget(self._messages)

    def _draw(self) -> None:
        checkpoint, is_running = self._living.checkpoint, self._living.is_running
        self._source.setEnabled(not is_running)
        if checkpoint is None:
            self._checkpoint.setText(_NO_CHECKPOINT)
        else:
            description = checkpoint.description
            self._checkpoint.setText(f"Checkpoint “{description.name}”, for {description.tool.name}")
            self._readings.show_tool(description.tool)
        self._ship.setVisible(checkpoint is None and self._session.predicting.shipped_path is not None)
        self._load.setEnabled(not is_running)
        self._start.setText("&Stop" if is_running else "&Start")
        self._start.setEnabled(is_running or (checkpoint is not None and self._source.folder is not None))
        if self._living.is_restarting:
            words = _RESTARTING
        elif is_running:
            words = _WAITING if self._living.is_ready else _STARTING
        else:
            words = _CHOOSE_CHECKPOINT if checkpoint is None else _CHOOSE_FOLDER
        self.projections.show_words(words)

    def _draw_statistics(self) -> None:
        statistics = self._living.statistics
        self._readings.show_statistics(statistics)
        words = "" if statistics is None else _unfinished_words(statistics.unfinished)
        self._unfinished.setText(words)
        self._unfinished.setVisible(bool(words))

    @Slot()
    def _clear(self) -> None:
        """Take away what was shown, and what was said of it."""
        self.projections.clear()
        self._readings.clear()
        self._unfinished.setText("")
        self.projections.show_note("")
        self._messages.clear()

    def _tell(self, text: str) -> None:
        # In its own words: no volume of a blind study is shown, and a number would tell another one's.
        self._messages.appendPlainText(f"{datetime.now().astimezone():%H:%M:%S}  {text}")

    @Slot()
    def _on_start_clicked(self) -> None:
        folder = self._source.folder
        if self._living.is_running:
            self._living.stop()
        elif folder is not None:
            self._clear()
            self._living.start(folder, self._source.playback, keeps=self._source.keeps)

    @Slot()
    def _on_load_clicked(self) -> None:
        self.action_requested.emit("load_checkpoint")

    @Slot()
    def _on_ship_clicked(self) -> None:
        self.action_requested.emit("shipped_checkpoint")

    @Slot()
    def _on_living_running_changed(self) -> None:
        if self._living.is_running:
            self._timer.start()
        else:
            self._timer.stop()
            self._questions.clear()
        self.projections.show_note(_RESTARTING if self._living.is_restarting else "")
        self._draw()
        self._draw_statistics()

    @Slot()
    def _on_living_frame_came(self) -> None:
        frame, checkpoint = self._living.take_frame(), self._living.checkpoint
        if frame is None or checkpoint is None:
            return
        if self.projections.show_frame(frame, checkpoint.description.tool):
            self._living.note_shown()
        self._readings.show_frame(frame)

    @Slot(object)
    def _on_living_failed(self, error: UserError) -> None:
        self._tell(str(error))

    @Slot(object)
    def _on_living_stopped(self, error: UserError) -> None:
        self._tell(f"{_STOPPED}. {error}")
        self.projections.show_words(f"{_STOPPED}: why, stands below.")
        self.projections.show_note(_STOPPED)

    @Slot(object)
    def _on_living_grid_requested(self, arrival: "Arrival") -> None:
        self._questions.append(arrival)
        self._ask_next()

    def _ask_next(self) -> None:
        """Ask for the spacing of the next shape, one at a time."""
        while self._questions and not self._is_asking:
            arrival = self._questions.pop(0)
            try:
                volume = open_volume(arrival.volume_path, dataset=arrival.dataset)
            except UserError:
                # Gone since: the next one asks.
                self._living.put_grid_off(arrival)
                continue
            self._ask(arrival, volume)
            volume.close()

    def _ask(self, arrival: "Arrival", volume: Volume) -> None:
        dialog = SpacingDialog(volume, offered_spacing_um(volume.shape), self, is_for_now=True)

        def on_dialog_accepted() -> None:
            if (answer := dialog.answer) is not None:
                self._living.provide_grid(arrival, answer)

        def on_dialog_rejected() -> None:
            if not self._living.is_running:
                return
            self._living.decline_grid(arrival)
            shape = " × ".join(str(count) for count in arrival.shape)
            self._tell(
                f"Volumes of {shape} voxels, such as {arrival.volume_path}, are not shown: nobody said how "
                "far apart their voxels are. To be asked again, stop the view and start it."
            )

        def on_dialog_finished() -> None:
            dialog.deleteLater()
            self._is_asking = False
            self._ask_next()

        dialog.accepted.connect(on_dialog_accepted)
        dialog.rejected.connect(on_dialog_rejected)
        dialog.finished.connect(on_dialog_finished)
        self._is_asking = True
        dialog.open()


def _unfinished_words(unfinished: "tuple[Unfinished, ...]") -> str:
    """Say which volumes are still being written, or were cut short; empty where none is."""
    if not unfinished:
        return ""
    named_ones = [
        f"{each.volume_path}" + ("" if each.share is None else f" ({each.share:.0%})")
        for each in unfinished[:_MOST_UNFINISHED]
    ]
    more = len(unfinished) - len(named_ones)
    return f"Still being written, or cut short: {', '.join(named_ones)}" + (
        f", and {more} more" if more else ""
    )
