"""A volume is to be marked as done, and some of its keypoints nobody has judged since they were predicted."""

from collections.abc import Sequence

from PySide6.QtWidgets import QWidget

from annotator.dialogs.choice_dialog import Choice, ChoiceDialog

_CHOICES = (
    Choice(
        "accept",
        "They are right: accept them",
        "They count as found right by you, and the volume is done.",
    ),
    Choice(
        "leave",
        "Mark as done as it is",
        "They stay predicted: comparisons and training leave them out.",
    ),
)
_CANCEL = Choice("cancel", "Look again", "Nothing is changed.")


class UnjudgedDialog(ChoiceDialog):
    """Asks what is to become of predicted keypoints; the choices are ``accept``, ``leave`` and ``cancel``."""

    def __init__(self, names: Sequence[str], parent: QWidget | None = None) -> None:
        still, them = ("is still", "it") if len(names) == 1 else ("are still", "them")
        super().__init__(
            "unjudged",
            "Are the predicted keypoints right?",
            f"{', '.join(names)} {still} where a checkpoint has put {them}.",
            None,
            _CHOICES,
            _CANCEL,
            parent,
        )
        self.setWindowTitle("Mark as done")
