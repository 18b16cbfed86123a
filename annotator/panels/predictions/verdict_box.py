"""What a reviewer says of the open volume: who is wrong, and why."""

from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer, Slot
from PySide6.QtWidgets import QGridLayout, QLineEdit, QPushButton, QVBoxLayout, QWidget

from annotator.actions.predictions_table import VERDICT_TITLES
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.session import Session

if TYPE_CHECKING:
    from annotations.prediction.prediction import CheckpointReference

_COLUMNS = 2
# Whoever types is left in peace; what was typed is safe soon after.
_NOTE_RESTS_MS = 1000
_NOTE_LATER = "A note, once you have said who is wrong"
_NOTE = "A note on your verdict"
_NO_ROW = "Open a volume of the list, and say who is wrong where the two differ."
_OUTDATED = "The annotation has been changed since your verdict: give it again, or another one."


class VerdictBox(QWidget):
    """A button for each verdict, which records it or takes it back, and a note, kept while it is typed."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._judging = session.judging
        self._about: tuple[str | None, CheckpointReference | None] = (None, None)
        self._is_keeping = False
        self._words = WrappedText(name="verdict_words")
        self._words.set_color(lambda colors: colors.muted)
        self._outdated = WrappedText(_OUTDATED, name="verdict_outdated")
        self._outdated.set_color(lambda colors: colors.warning)
        grid = QGridLayout()
        grid.setSpacing(self.fontMetrics().height() // 4)
        self._buttons: dict[str, QPushButton] = {}
        for place, (verdict, title) in enumerate(VERDICT_TITLES.items()):
            button = named(QPushButton(title.capitalize()), f"verdict_{verdict}")
            button.setToolTip("Records that at once; pressed again it is taken back")
            button.setCheckable(True)
            button.clicked.connect(partial(self._judging.judge, verdict))
            self._buttons[verdict] = button
            grid.addWidget(button, *divmod(place, _COLUMNS))
        self._note = named(QLineEdit(), "verdict_note", title="Note on the verdict")
        self._note.editingFinished.connect(self._on_note_editing_finished)
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(_NOTE_RESTS_MS)
        self._rest.timeout.connect(self._on_rest_timeout)
        self._note.textEdited.connect(self._on_note_text_edited)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._words)
        layout.addLayout(grid)
        layout.addWidget(self._outdated)
        layout.addWidget(self._note)
        self._judging.changed.connect(self._draw)
        session.reviewing.changed.connect(self._draw)
        self._draw()

    @Slot(str)
    def _on_note_text_edited(self, _: str) -> None:
        self._rest.start()

    @Slot()
    def _on_rest_timeout(self) -> None:
        self._keep_note()

    @Slot()
    def _on_note_editing_finished(self) -> None:
        self._keep_note()

    def _keep_note(self) -> None:
        """Write down what was typed, for what it was said of: the next volume may be open by now.

        What cannot be written stays in the field; nothing is lost that can still be copied from there.
        """
        self._rest.stop()
        volume, checkpoint = self._about
        if self._is_keeping or volume is None or checkpoint is None or not self._note.isModified():
            return
        typed = self._note.text()
        # Writing makes this box draw itself, by then perhaps for something else.
        self._is_keeping = True
        try:
            is_kept = self._judging.write_note(volume, checkpoint, typed)
        finally:
            self._is_keeping = False
        if is_kept and self._note.text() == typed:
            self._note.setModified(False)

    @Slot()
    def _draw(self) -> None:
        judging = self._judging
        volume = judging.open_volume
        about = (volume, judging.checkpoint)
        if about != self._about:
            self._keep_note()
        judgement = judging.open_judgement
        own = judgement.own
        note = own.note if own is not None else ""
        # An equal one would take the cursor from where it is being typed.
        if (about != self._about or not self._note.isModified()) and note != self._note.text():
            self._note.setText(note)
        self._about = about
        others = judgement.lines[1:] if own is not None else judgement.lines
        words = _NO_ROW if volume is None else "\n".join(others)
        self._words.setText(words)
        self._words.setVisible(bool(words))
        for verdict, button in self._buttons.items():
            button.setEnabled(volume is not None)
            button.setChecked(own is not None and own.verdict == verdict)
        self._outdated.setVisible(judgement.is_outdated)
        self._note.setEnabled(own is not None)
        self._note.setPlaceholderText(_NOTE if own is not None else _NOTE_LATER)
