"""What the application can be asked for: the type of one action. The table of all of them is `actions`."""

from dataclasses import dataclass
from typing import Literal

When = Literal[
    "always",
    "volume",
    "document",
    "active",
    "positioned",
    "seen",
    "keypoint",
    "box",
    "turnable",
    "posing",
    "positions",
    "keypoints",
    "alternatives",
    "preview",
    "undo",
    "redo",
    "previous",
    "next",
    "todo",
    "study",
    "reviewer",
    "report",
    "training",
    "settling",
    "jobs",
    "shipped",
    "predictable_volume",
    "predictable",
    "predicted",
    "started_from_prediction",
    "reviewable",
    "reviewed",
    "judgeable",
    "errors",
]
"""What must be there for an action to make sense; `annotator.actions.state` finds it in the session."""


@dataclass(frozen=True)
class Action:
    """Something that a person can ask for by menu, by key or by tool bar.

    Attributes
    ----------
    name : str
        Stable; the action's ``objectName`` is ``action_`` and this.
    text : str
        In the menu and in the shortcut sheet.
    menu : str
        Title of the menu, with the title of a submenu behind a slash.
    shortcuts : tuple of str
        Qt's portable key sequences; the first is shown in the menu.
    tooltip : str
        What happens, as a sentence.
    when : str
        See `When`.
    checkable : bool
        Shown with a mark while it is on.
    separated : bool
        A line stands above it in its menu.
    repeats : bool
        Happens again and again while the key is held.
    """

    name: str
    text: str
    menu: str
    shortcuts: tuple[str, ...]
    tooltip: str
    when: When = "always"
    checkable: bool = False
    separated: bool = False
    repeats: bool = False
