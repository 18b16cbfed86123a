"""The fit of the tool to what is placed, live, and what can be made of it."""

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.annotation.fit_readout import FitReadout, fit_readout
from annotator.panels.widgets.readings_grid import ReadingsGrid
from annotator.session import Session

_TOO_LITTLE = {
    "keypoints": "Place the two ends of a link, and the tool is fitted to them.",
    "boxes": "Place the box of a link, and the tool is fitted to it.",
}


class FitSection(QWidget):
    """Residual, joints and roll of the fit; what the data leave open, with the other solutions to take."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._others: list[QPushButton] = []
        self._nothing = WrappedText(name="fit_nothing")
        self._nothing.set_color(lambda colors: colors.muted)
        self._grid = ReadingsGrid()
        self._remarks = WrappedText(name="fit_remarks")
        self._remarks.set_color(lambda colors: colors.warning)
        self._choices = QVBoxLayout()
        self._fill_in = named(QPushButton("Fill in from the fit"), "fit_fill_in")
        self._fill_in.clicked.connect(self._on_fill_in_clicked)
        fill_row = QHBoxLayout()
        fill_row.addWidget(self._fill_in)
        fill_row.addStretch(1)
        # What comes and goes is held together, so that its height can be kept while something is dragged.
        self._changing = QWidget()
        changing = QVBoxLayout(self._changing)
        changing.setContentsMargins(0, 0, 0, 0)
        changing.addWidget(self._remarks)
        changing.addLayout(self._choices)
        changing.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 0, 0, 4)
        layout.addWidget(self._nothing)
        layout.addWidget(self._grid)
        layout.addWidget(self._changing)
        layout.addLayout(fill_row)

    def draw(self) -> None:
        """Show the fit of the shown document."""
        fit, tool, document = self._session.tool_fit, self._session.tool, self._session.document
        readout = fit_readout(fit, tool) if fit is not None and tool is not None else None
        self._nothing.setText(_TOO_LITTLE[document.method] if document is not None else "")
        self._nothing.setVisible(readout is None)
        self._grid.setVisible(readout is not None)
        self._hold_height()
        self._show_what_is_open(readout)
        if readout is not None:
            self._grid.show_lines(readout.lines)
        self._draw_fill_in(has_fit=readout is not None)

    def _hold_height(self) -> None:
        """Let nothing below move up while something is dragged: remarks come and go with it."""
        view = self._session.view
        is_on_its_way = view.draft is not None or view.preview is not None
        self._changing.setMinimumHeight(self._changing.height() if is_on_its_way else 0)

    def _show_what_is_open(self, readout: FitReadout | None) -> None:
        remarks = readout.remarks if readout is not None else ()
        others = readout.others if readout is not None else ()
        self._remarks.setText("\n".join(remarks))
        self._remarks.setVisible(bool(remarks))
        while len(self._others) < len(others):
            number = len(self._others)
            button = named(QPushButton(), f"fit_other_{number}")
            button.setToolTip("Pose the tool in this solution, which explains what is placed as well")
            button.clicked.connect(self._on_other_clicked)
            self._others.append(button)
            self._choices.addWidget(button, 0, Qt.AlignmentFlag.AlignLeft)
        for button, other in zip(self._others, others, strict=False):
            button.setText(f"Take {other}")
        for number, button in enumerate(self._others):
            button.setVisible(number < len(others))

    def _draw_fill_in(self, *, has_fit: bool) -> None:
        document = self._session.document
        by_keypoints = document is not None and document.method == "keypoints"
        unplaced = (
            [] if document is None else [key.name for key in document.keypoints if key.state == "unplaced"]
        )
        fillable = self._session.fillable_keypoints
        untold = [name for name in unplaced if name not in fillable]
        self._fill_in.setVisible(by_keypoints)
        self._fill_in.setEnabled(bool(fillable))
        is_again = bool(fillable) and not set(fillable) & set(unplaced)
        self._fill_in.setText("Fill in again" if is_again else "Fill in from the fit")
        left_out = f"What is placed does not tell where {', '.join(untold)} would be" if untold else ""
        if is_again:
            why = f"The fit has changed since {', '.join(fillable)} got its positions: take the new ones"
        elif fillable:
            why = (
                f"Give {', '.join(fillable)} the fit's position, as occluded or out of view, never as placed"
            )
        elif not unplaced:
            why = "Every keypoint has a position"
        elif not has_fit:
            why = "There is no fit yet"
        else:
            why = ""
        self._fill_in.setToolTip(". ".join(filter(None, (why, left_out if has_fit else ""))))

    @Slot()
    def _on_fill_in_clicked(self) -> None:
        self._session.fill_in()

    @Slot()
    def _on_other_clicked(self) -> None:
        button = self.sender()
        if isinstance(button, QPushButton):
            self._session.take_alternative(self._others.index(button))
