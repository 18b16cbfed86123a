"""Weights that a training left were opened: is a checkpoint to be made of them?"""

from pathlib import Path

from PySide6.QtWidgets import QWidget

from annotator.dialogs.choice_dialog import Choice, ChoiceDialog

_CONVERT = Choice(
    "convert",
    "Make a checkpoint…",
    "You choose its name; the weights stay as they are. It takes some seconds, beside your work, and needs "
    "PyTorch, which the extra “train” brings. No code from the file is run.",
)
_CANCEL = Choice("cancel", "Cancel", "Nothing is made of it.")


class ConversionDialog(ChoiceDialog):
    """Asks whether weights are to become a checkpoint; the choices are ``convert`` and ``cancel``."""

    def __init__(self, weights_path: Path, parent: QWidget | None = None) -> None:
        problem = (
            "A file like this has the weights of a network, as a training leaves them. A checkpoint has them "
            "with everything that turns a volume into keypoints: predictions are made by checkpoints."
        )
        super().__init__(
            "conversion",
            "Make a checkpoint of these weights?",
            problem,
            weights_path,
            (_CONVERT,),
            _CANCEL,
            parent,
        )
        self.setWindowTitle("Weights of a network")
