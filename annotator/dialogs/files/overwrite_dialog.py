"""Another program changed the annotation's file: whose version stays?"""

from pathlib import Path

from PySide6.QtWidgets import QWidget

from annotator.dialogs.choice_dialog import Choice, ChoiceDialog

_CHOICES = (
    Choice(
        "save_elsewhere",
        "Save mine under another name…",
        "Both versions are kept, each in its own file.",
    ),
    Choice(
        "overwrite",
        "Keep mine",
        "Your version takes the file's name; the other program's version stays beside it, in a backup whose "
        "name ends in “.theirs.bak”.",
    ),
    Choice("reload", "Take theirs", "The file is read again, and your unsaved edits are given up."),
)
_CANCEL = Choice("cancel", "Cancel", "Nothing is saved now; your edits stay open, and in the recovery file.")


class OverwriteDialog(ChoiceDialog):
    """Asks before a file that was changed by another program is overwritten.

    The choices are ``save_elsewhere``, where the annotation may be kept in another file, ``overwrite``,
    ``reload`` and ``cancel``.
    """

    def __init__(
        self, problem: str, path: Path | None = None, parent: QWidget | None = None, *, may_move: bool = True
    ) -> None:
        choices = [choice for choice in _CHOICES if may_move or choice.value != "save_elsewhere"]
        super().__init__("overwrite", "Which version should stay?", problem, path, choices, _CANCEL, parent)
        self.setWindowTitle("File changed elsewhere")
