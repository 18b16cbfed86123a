"""Which volumes a live view shows, and what becomes of them: the choices above it."""

from pathlib import Path

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QWidget,
)

from annotator.looks.labels import ElidedText
from annotator.looks.naming import named
from annotator.session.predictions.living import Playback

_ARRIVING, _RECORDED = "arriving", "recorded"
_NO_FOLDER = "No folder is chosen"


class LiveSource(QWidget):
    """A folder, whether its volumes arrive or were recorded, and how a recorded sequence is played.

    Signals
    -------
    changed
        ``folder`` is another one.
    """

    changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("live_source")
        self._folder: Path | None = None
        self._kind = named(
            QComboBox(),
            "live_kind",
            title="Which volumes",
            tooltip="New ones as they come, or those that are there already, in the order of their names",
        )
        self._kind.addItem("Volumes that arrive in", _ARRIVING)
        self._kind.addItem("A recorded sequence in", _RECORDED)
        self._kind.currentIndexChanged.connect(self._on_kind_current_index_changed)
        self._shown = ElidedText(_NO_FOLDER, name="live_folder")
        self._choose = named(QPushButton("&Choose…"), "live_choose", tooltip="Choose the folder")
        self._choose.clicked.connect(self._on_choose_clicked)
        self._rate = named(
            QDoubleSpinBox(), "live_rate", title="Volumes a second", tooltip="At which the sequence is played"
        )
        self._rate.setRange(0.1, 200.0)
        self._rate.setDecimals(1)
        self._rate.setValue(20.0)
        self._rate.setSuffix(" a second")
        self._loops = named(QCheckBox("&Again and again"), "live_loops")
        self._loops.setChecked(True)
        self._keeps = named(QCheckBox("&Keep predictions in the folder"), "live_keeps")
        self._keeps.setToolTip("Writes a file for each volume that is shown, in “predictions” in the folder")
        self._playing = QWidget()
        playing = QHBoxLayout(self._playing)
        playing.setContentsMargins(0, 0, 0, 0)
        playing.addWidget(QLabel("at"))
        playing.addWidget(self._rate)
        playing.addWidget(self._loops)
        options = QHBoxLayout()
        options.addWidget(self._playing)
        options.addWidget(self._keeps)
        options.addStretch(1)
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.addWidget(self._kind, 0, 0)
        grid.addWidget(self._shown, 0, 1)
        grid.addWidget(self._choose, 0, 2)
        grid.addLayout(options, 1, 1, 1, 2)
        grid.setColumnStretch(1, 1)
        self._draw()

    @property
    def folder(self) -> Path | None:
        """The folder that was chosen."""
        return self._folder

    @property
    def playback(self) -> Playback | None:
        """How the recorded sequence is played; None for volumes that arrive."""
        if self._kind.currentData() == _ARRIVING:
            return None
        return Playback(self._rate.value(), self._loops.isChecked())

    @property
    def keeps(self) -> bool:
        """Whether predictions are written."""
        return self._keeps.isChecked()

    def take_folder(self, folder: Path) -> None:
        """Choose a folder."""
        self._folder = folder
        self._shown.setText(str(folder))
        self.changed.emit()

    @Slot()
    def _on_choose_clicked(self) -> None:
        chosen = QFileDialog.getExistingDirectory(
            self, "Choose the folder of the volumes", "" if self._folder is None else str(self._folder)
        )
        if chosen:
            self.take_folder(Path(chosen))

    @Slot()
    def _on_kind_current_index_changed(self) -> None:
        self._draw()

    def _draw(self) -> None:
        self._playing.setVisible(self._kind.currentData() == _RECORDED)
