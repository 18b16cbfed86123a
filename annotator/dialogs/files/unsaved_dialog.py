"""The annotation could not be saved: what to do so that nothing is lost."""

from pathlib import Path

from PySide6.QtWidgets import QWidget

from annotator.dialogs.choice_dialog import Choice, ChoiceDialog

_CANCEL = Choice("cancel", "Stay here", "The annotation stays open as it is.")


class UnsavedDialog(ChoiceDialog):
    """Asks what to do when an annotation that is to be closed cannot be saved.

    The choices are ``retry``, ``save_elsewhere``, ``leave`` and ``cancel``.

    Parameters
    ----------
    problem : str
        Why it could not be saved.
    path : Path or None
        The annotation's file.
    leaving : str
        What happens after all if the person insists, such as ``Quit without saving``.
    may_move : bool
        Whether the annotation may be kept in another file.
    """

    def __init__(
        self,
        problem: str,
        path: Path | None,
        leaving: str,
        parent: QWidget | None = None,
        *,
        may_move: bool = True,
    ) -> None:
        choices = [
            Choice(
                "retry", "Try again", "After making room, or after giving yourself the right to write there."
            ),
            Choice("save_elsewhere", "Save elsewhere…", "In another folder or on another disk."),
            Choice(
                "leave", leaving, "Every edit is kept in the recovery file and offered at the next start."
            ),
        ]
        if not may_move:
            choices = [choice for choice in choices if choice.value != "save_elsewhere"]
        heading = "The annotation could not be saved. Nothing is lost."
        super().__init__("unsaved", heading, problem, path, choices, _CANCEL, parent)
        self.setWindowTitle("The annotation is not saved")
