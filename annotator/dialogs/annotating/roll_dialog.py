"""Boxes are to follow from keypoints that do not show how a link is turned about its own axis."""

import numpy as np
from PySide6.QtCore import Slot
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QFormLayout, QLineEdit, QVBoxLayout, QWidget

from annotator.dialogs.choice_dialog import Choice, ChoiceDialog
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named
from annotator.looks.typed_numbers import NotUnderstood, parse_number
from annotator.session.files.deriving import RollMeaning

_HEADING = "Which way round is {0}?"
_CANCEL = Choice("cancel", "Derive nothing", "The keypoints stay as they are, and no boxes are made.")


class RollChoiceDialog(ChoiceDialog):
    """Asks for the sense of the hinge, of which a bend shows only the line.

    Parameters
    ----------
    link : str
        The link whose roll it is.
    meanings : tuple of RollMeaning
        The rolls in question.
    """

    def __init__(self, link: str, meanings: tuple[RollMeaning, ...], parent: QWidget | None = None) -> None:
        super().__init__(
            "roll",
            _HEADING.format(link),
            "The bend shows the line of the hinge, but not its sense: turned by 180° about its own axis, the "
            "tool would look the same, and its signed angles would have the other sign. Say which it is; the "
            "new annotation keeps a note of it.",
            None,
            [
                Choice(str(number), f"Roll {_degrees(meaning.roll_deg)}", _explained(meaning, link))
                for number, meaning in enumerate(meanings)
            ],
            _CANCEL,
            parent,
        )
        self._meanings = meanings
        self.setWindowTitle("Sense of the hinge")

    @property
    def roll_deg(self) -> float | None:
        """The roll that was chosen, in degrees; None until then."""
        return None if self.choice == "cancel" else self._meanings[int(self.choice)].roll_deg


class RollEntryDialog(QDialog):
    """Asks for the roll of a straight tool, of which keypoints show nothing; none is suggested."""

    def __init__(self, link: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("roll_dialog")
        self.setWindowTitle("Roll of the tool")
        self._field = named(QLineEdit(), "roll_field", title=f"Roll of {link} in degrees")
        self._field.setPlaceholderText("degrees, from −180 to 180")
        self._field.textChanged.connect(self._on_field_text_changed)
        self._problem = WrappedText(name="roll_problem")
        self._problem.set_color(lambda colors: colors.error)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(buttons.button(QDialogButtonBox.StandardButton.Ok), "roll_ok")
        self._ok.setText("Derive with this roll")
        back = named(
            buttons.button(QDialogButtonBox.StandardButton.Cancel), "roll_cancel", tooltip=_CANCEL.explanation
        )
        back.setText(_CANCEL.title)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        form = QFormLayout()
        form.addRow(f"&Roll of {link}", self._field)
        layout = QVBoxLayout(self)
        layout.addWidget(Heading(_HEADING.format(link)))
        layout.addWidget(
            WrappedText(
                "No clear bend shows how the tool is turned about its own axis, so a person has to say it; "
                "the new annotation keeps a note of it.\nAt 0° the box's own +y, the hinge's axis, lies "
                "across the volume's z axis; a positive roll turns it right-handed about the way from base "
                "to tip."
            )
        )
        layout.addLayout(form)
        layout.addWidget(self._problem)
        layout.addStretch(1)
        layout.addWidget(buttons)
        self._draw()
        self._field.setFocus()

    @property
    def roll_deg(self) -> float | None:
        """The roll that was typed, in degrees; None as long as there is none."""
        try:
            return self._read()
        except NotUnderstood:
            return None

    def _read(self) -> float:
        roll_deg = parse_number(self._field.text().strip().removesuffix("°"))
        if not -180 <= roll_deg <= 180:
            raise NotUnderstood("A roll lies between −180° and 180°")
        return roll_deg

    @Slot()
    def _on_field_text_changed(self) -> None:
        self._draw()

    def _draw(self) -> None:
        problem = ""
        try:
            self._read()
        except NotUnderstood as error:
            problem = f"{error}."
        self._ok.setEnabled(not problem)
        # What is not there yet is not wrong yet.
        self._problem.setText(problem if self._field.text() else "")


def _explained(meaning: RollMeaning, link: str) -> str:
    along = int(np.argmax(np.abs(meaning.hinge_axis)))
    sense = "+" if meaning.hinge_axis[along] > 0 else "−"
    angles = " and ".join(f"{name} is {_degrees(angle)}" for name, angle in meaning.angles_deg.items())
    looks = f"The hinge's axis, own +y of {link}, looks mostly along {sense}{'xyz'[along]}"
    return f"{looks}; {angles}." if angles else f"{looks}."


def _degrees(angle_deg: float) -> str:
    return f"{angle_deg:+z.1f}°".replace("-", "−")
