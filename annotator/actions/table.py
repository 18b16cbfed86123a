"""Every action of the application, as data.

The menus, the tool bar, the shortcut sheet and ``docs/shortcuts.md`` are all made from this table and the one
of the mouse's gestures; ``python -m annotator.actions.table`` prints the last of them.
"""

from itertools import groupby

from annotator.actions.action import Action
from annotator.actions.annotate_table import ANNOTATE_ACTIONS
from annotator.actions.mouse_gestures import GESTURES
from annotator.actions.predictions_table import PREDICTIONS_ACTIONS
from annotator.actions.tools_table import TOOLS_ACTIONS
from annotator.actions.view_table import VIEW_ACTIONS
from annotator.settings import RECENT_FILES

MENUS = ("File", "Edit", "Annotate", "Tools", "Predictions", "View", "Go", "Help")

TOOL_BAR: tuple[tuple[str, ...], ...] = (
    ("open_file", "save"),
    ("navigate_mode", "place_mode", "pose_mode"),
    ("undo", "redo"),
    ("next_unplaced", "mark_done"),
    ("previous_volume", "next_volume"),
    ("shortcut_sheet",),
)
"""Names of the actions in the tool bar, in groups."""

_FILE = (
    Action("open_file", "Open Volume or Annotation…", "File", ("Ctrl+O",), "Open a volume or an annotation."),
    Action(
        "open_folder", "Open Folder…", "File", ("Ctrl+Shift+O",), "Open a study, or every volume in a folder."
    ),
    Action(
        "open_demo",
        "Open Demo Study",
        "File",
        ("Ctrl+Shift+D",),
        "Open a study of synthetic volumes.",
    ),
    *(
        Action(
            f"recent_{number}",
            f"Recent {number}",
            "File/Open Recent",
            (f"Ctrl+Alt+{number}",),
            "Open again what was open before.",
        )
        for number in range(1, RECENT_FILES + 1)
    ),
    Action(
        "new_study",
        "New Study…",
        "File",
        ("Ctrl+N",),
        "Make a study of the volumes in a folder: who annotates them, by which rules.",
        separated=True,
    ),
    Action(
        "study_settings",
        "Study Settings…",
        "File",
        ("Ctrl+Alt+N",),
        "Add volumes and annotators to the open study, or change its rules.",
        "study",
    ),
    Action(
        "save",
        "Save",
        "File",
        ("Ctrl+S",),
        "Write the annotation to its file now; that also happens by itself.",
        "document",
        separated=True,
    ),
    Action(
        "save_as",
        "Save As…",
        "File",
        ("Ctrl+Shift+S",),
        "Keep the annotation in another file from now on.",
        "document",
    ),
    Action(
        "recover",
        "Recover Unsaved Edits…",
        "File",
        ("Ctrl+Shift+R",),
        "Look for edits that were left unsaved when the program ended.",
        separated=True,
    ),
    Action(
        "close_volume",
        "Close Volume",
        "File",
        ("Ctrl+W",),
        "Save, and put the volume away.",
        "volume",
        separated=True,
    ),
    Action("quit", "Quit", "File", ("Ctrl+Q",), "Save, and leave the program."),
)

_EDIT = (
    Action("undo", "Undo", "Edit", ("Ctrl+Z",), "Take the last edit back.", "undo", repeats=True),
    Action("redo", "Redo", "Edit", ("Ctrl+Shift+Z", "Ctrl+Y"), "Make the edit again.", "redo", repeats=True),
    Action(
        "copy_pose",
        "Copy Pose",
        "Edit",
        ("Ctrl+Shift+C",),
        "Copy position, orientation and angles as a table.",
        "document",
        separated=True,
    ),
    Action(
        "choose_tool",
        "Tool…",
        "Edit",
        ("T",),
        "Choose the instrument for new annotations.",
        separated=True,
    ),
    Action(
        "settings",
        "Settings…",
        "Edit",
        ("Ctrl+,",),
        "Annotator's name, theme, renderer, autosave and cache.",
    ),
)

_GO = (
    Action(
        "previous_volume",
        "Previous Volume",
        "Go",
        ("Ctrl+PgUp",),
        "Save, and open the volume before this one.",
        "previous",
    ),
    Action(
        "next_volume",
        "Next Volume",
        "Go",
        ("Ctrl+PgDown",),
        "Save, and open the volume after this one.",
        "next",
    ),
    Action(
        "next_todo",
        "Next Volume to Do",
        "Go",
        ("Ctrl+Shift+PgDown",),
        "Save, and open the next volume that is not done.",
        "todo",
    ),
    Action(
        "cancel_jobs",
        "Cancel Background Work",
        "Go",
        ("Ctrl+.",),
        "Stop the work that the status line shows; what is open stays as it is.",
        "jobs",
        separated=True,
    ),
)

_HELP = (
    Action("shortcut_sheet", "Shortcuts", "Help", ("?", "F1"), "Show every key and every gesture."),
    Action(
        "open_log", "Show Log", "Help", ("Ctrl+Alt+L",), "Show the file in which unexpected errors are kept."
    ),
    Action("about", "About", "Help", ("Shift+F1",), "Versions, licence and folders.", separated=True),
)

ACTIONS: tuple[Action, ...] = (
    *_FILE,
    *_EDIT,
    *ANNOTATE_ACTIONS,
    *TOOLS_ACTIONS,
    *PREDICTIONS_ACTIONS,
    *VIEW_ACTIONS,
    *_GO,
    *_HELP,
)


def sheet_rows() -> tuple[tuple[str, str, str], ...]:
    """Return (group, text, shortcut) of every action and gesture, as the shortcut sheet shows them."""
    rows = []
    for menu in MENUS:
        entries = [entry for entry in ACTIONS if entry.menu.split("/")[0] == menu]
        for _, group in groupby(entries, _kind):
            same = list(group)
            text, keys = same[0].text, ", ".join(same[0].shortcuts)
            if len(same) > 1:
                text, keys = f"{text} to {len(same)}", f"{keys} … {same[-1].shortcuts[0]}"
            rows.append((same[0].menu.replace("/", " › "), text, keys))
    return (*rows, *((f"Mouse › {entry.place}", entry.effect, entry.gesture) for entry in GESTURES))


def _kind(entry: Action) -> str:
    """Name what a row of the sheet is about: the numbered recent files are one, and so are the keypoints."""
    return next((kind for kind in ("recent_", "keypoint_") if entry.name.startswith(kind)), entry.name)


def markdown() -> str:
    """Return the page of shortcuts for the documentation."""
    lines = [
        "# Shortcuts and gestures",
        "",
        "Made from `annotator/actions` by `python -m annotator.actions.table > docs/shortcuts.md`; the",
        "application shows the same list with `?`. Keys do nothing to an annotation while text is typed.",
    ]
    for menu in MENUS:
        lines += ["", f"## {menu}", "", "| action | keys | what happens |", "|---|---|---|"]
        for entry in ACTIONS:
            title, _, submenu = entry.menu.partition("/")
            if title == menu:
                text = f"{submenu} › {entry.text}" if submenu else entry.text
                keys = ", ".join(f"`{key}`" for key in entry.shortcuts)
                lines.append(f"| {text} | {keys} | {entry.tooltip} |")
    lines += ["", "## Mouse", "", "| where | gesture | what happens |", "|---|---|---|"]
    lines += [f"| {entry.place} | {entry.gesture} | {entry.effect} |" for entry in GESTURES]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(markdown(), end="")
