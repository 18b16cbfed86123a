"""Another computer has the document open and says nothing: is the document to be changed here?"""

from PySide6.QtWidgets import QWidget

from annotations.documents.locks import LockHolder
from annotator.dialogs.choice_dialog import Choice, ChoiceDialog

_TAKE_OVER = Choice(
    "take_over",
    "Take it over",
    "You can change the annotation here, as it was saved last. If the program over there still runs, it "
    "is told, and changes the file no more. Edits that were not saved there are in that computer's "
    "recovery file alone: they are offered when the program is started there again. The takeover is "
    "written down beside the annotation, in takeovers.log.",
)
_CANCEL = Choice("cancel", "Open read-only", "You can look at the annotation, and nothing is changed.")
_MINUTE_S = 60


class TakeoverDialog(ChoiceDialog):
    """Asks before the lock of a computer that says nothing is taken over.

    The choices are ``take_over`` and ``cancel``, after which the document stays read-only.
    """

    def __init__(self, holder: LockHolder, parent: QWidget | None = None) -> None:
        problem = (
            f"This annotation is open elsewhere: {holder}. A program that has an annotation open says so "
            f"every half a minute; this one was last heard of {_ago(holder.age_s)}. It may have crashed, or "
            "its computer may sleep or be off the network."
        )
        super().__init__(
            "takeover", "Take the annotation over?", problem, None, (_TAKE_OVER,), _CANCEL, parent
        )
        self.setWindowTitle("Open on another computer")


def _ago(age_s: float) -> str:
    minutes = round(age_s / _MINUTE_S)
    if minutes < 2 * _MINUTE_S:
        return f"{minutes} minutes ago"
    hours = round(minutes / 60)
    return f"{hours} hours ago" if hours < 48 else f"{round(hours / 24)} days ago"
