"""The others' work, before one's own is done: look at it anyway?"""

from PySide6.QtWidgets import QWidget

from annotator.dialogs.choice_dialog import Choice, ChoiceDialog

_CHOICES = (
    Choice(
        "look",
        "Look anyway",
        "Your own annotation of the volume is opened, and the others' and predictions may be shown over it. "
        "That is written into your annotation and cannot be taken back; the study's report keeps it apart.",
    ),
)
_CANCEL = Choice("cancel", "Do not look", "What is open stays as it is, and nothing is written.")


class LookDialog(ChoiceDialog):
    """Asks before the others' work is shown too early; the choices are ``look`` and ``cancel``."""

    def __init__(self, reason: str, parent: QWidget | None = None) -> None:
        problem = f"{reason}. In this study you may look all the same, but not unnoticed."
        super().__init__("look", "Look at the others' work now?", problem, None, _CHOICES, _CANCEL, parent)
        self.setWindowTitle("Somebody else's annotation")
