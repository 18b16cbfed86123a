"""What is likely wrong with what is placed, each with a way to what it is about, and to put it right."""

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QToolButton, QVBoxLayout, QWidget

from annotations.fitting.mistakes import Mistake
from annotator.looks.labels import ColoredLabel, WrappedText
from annotator.looks.naming import named
from annotator.panels.annotation.mistake_readout import MistakeReading, mistake_readings, right_names
from annotator.session import Session

_FEWEST_POSITIONS = 3
_TOO_FEW = {
    "keypoints": f"From {_FEWEST_POSITIONS} positions on it is checked whether they go together.",
    # Each gives two.
    "boxes": "From 2 boxes on it is checked whether they go together.",
}
_SOUND = "Nothing implausible."
_LOOKING = "Looking whether the positions go together…"
_EVERY_ORDER = "Try every way in which keypoints may have been interchanged, not only two at a time: slower"


class MistakesSection(QWidget):
    """The likely mistakes, a row each; while they are looked for, what was found last stays."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._readings: tuple[MistakeReading, ...] = ()
        self._rows: list[MistakeRow] = []
        self._verdict = WrappedText(_LOOKING, name="mistakes_verdict")
        self._list = QVBoxLayout()
        self._every_order = named(QPushButton("Try every order"), "mistakes_every_order")
        self._every_order.setToolTip(_EVERY_ORDER)
        self._every_order.clicked.connect(self._on_every_order_clicked)
        order_row = QHBoxLayout()
        order_row.addWidget(self._every_order)
        order_row.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 0, 0, 4)
        layout.addWidget(self._verdict)
        layout.addLayout(self._list)
        layout.addLayout(order_row)
        session.mistakes_changed.connect(self._on_session_mistakes_changed)

    def draw(self) -> None:
        """Show what was found in the document, once it has been looked at."""
        document, tool = self._session.document, self._session.tool
        if document is None or tool is None:
            self._show_rows(())
            return
        has_enough = len(self._session.shown_positions_um()) >= _FEWEST_POSITIONS
        self._every_order.setEnabled(has_enough and document.method == "keypoints")
        if self._session.is_searching_mistakes:
            return
        heading, readings = mistake_readings(self._session.mistakes, tool, document.method)
        has_looked = self._session.has_looked_for_mistakes
        verdict = _TOO_FEW[document.method] if not has_enough else _SOUND if has_looked else _LOOKING
        self._verdict.setText(heading if readings else verdict)
        is_told = bool(readings) or verdict == _SOUND
        self._verdict.set_color(None if is_told else lambda colors: colors.muted)
        self._verdict.setVisible(bool(heading) or not readings)
        self._show_rows(readings)

    def _show_rows(self, readings: tuple[MistakeReading, ...]) -> None:
        if readings == self._readings:
            return
        self._readings = readings
        for row in self._rows:
            self._list.removeWidget(row)
            row.deleteLater()
        self._rows = [MistakeRow(reading, number) for number, reading in enumerate(readings)]
        for row in self._rows:
            row.part_requested.connect(self._on_row_part_requested)
            row.correction_requested.connect(self._on_row_correction_requested)
            self._list.addWidget(row)

    @Slot()
    def _on_session_mistakes_changed(self) -> None:
        self.draw()

    @Slot()
    def _on_every_order_clicked(self) -> None:
        self._session.search_every_relabelling()

    @Slot(str)
    def _on_row_part_requested(self, part: str) -> None:
        self._session.activate(part, jump=True)

    @Slot(object)
    def _on_row_correction_requested(self, mistake: Mistake) -> None:
        session, tool = self._session, self._session.tool
        by_boxes = session.document is not None and session.document.method == "boxes"
        if tool is None or not session.has_looked_for_mistakes:
            # It was put right by the click before, or the volume is another one by now.
            return
        if mistake.kind == "turned_over":
            session.activate(mistake.parts[0], jump=True)
            session.turn_over()
        elif mistake.kind == "rolled":
            session.roll_boxes(dict(zip(mistake.parts, mistake.turns_deg, strict=True)))
        elif mistake.kind == "reversed" and by_boxes:
            session.reverse(mistake.parts[0])
        else:
            session.relabel(right_names(mistake, tool))


class MistakeRow(QWidget):
    """One likely mistake in words, the parts that it is about, and a correction where there is one.

    Signals
    -------
    part_requested : str
        A person wants to see this part. Clicks beside the buttons ask for one after the other.
    correction_requested : Mistake
    """

    part_requested = Signal(str)
    correction_requested = Signal(object)

    def __init__(self, reading: MistakeReading, number: int, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._reading = reading
        self._clicks = 0
        self.setObjectName(f"mistake_{number}")
        mark = ColoredLabel("▲")
        mark.setAccessibleName("Likely mistake")
        mark.set_color(lambda colors: colors.warning)
        text = WrappedText(reading.text, name=f"mistake_text_{number}")
        # A click on the text is one on the row.
        text.setTextInteractionFlags(Qt.TextInteractionFlag.NoTextInteraction)
        buttons = QHBoxLayout()
        for part in reading.parts:
            button = named(QToolButton(), f"mistake_{number}_{part}", title=f"Go to {part}")
            button.setText(part)
            button.setToolTip(f"Make {part} active, and go to it")
            button.clicked.connect(self._on_part_clicked)
            buttons.addWidget(button)
        if reading.correction:
            correct = named(QPushButton(reading.correction), f"mistake_correct_{number}")
            correct.setToolTip("One step, which can be undone")
            correct.clicked.connect(self._on_correct_clicked)
            buttons.addWidget(correct)
        buttons.addStretch(1)
        words = QVBoxLayout()
        words.addWidget(text)
        words.addLayout(buttons)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(mark, 0, Qt.AlignmentFlag.AlignTop)
        layout.addLayout(words, 1)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        parts = self._reading.parts
        if event.button() == Qt.MouseButton.LeftButton and parts:
            self.part_requested.emit(parts[self._clicks % len(parts)])
            self._clicks += 1
        else:
            super().mousePressEvent(event)

    @Slot()
    def _on_part_clicked(self) -> None:
        button = self.sender()
        if isinstance(button, QToolButton):
            self.part_requested.emit(button.text())

    @Slot()
    def _on_correct_clicked(self) -> None:
        self.correction_requested.emit(self._reading.mistake)
