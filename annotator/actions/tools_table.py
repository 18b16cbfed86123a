"""The actions of the menu Tools: what the geometry of the instrument knows, on demand."""

from annotator.actions.action import Action

TOOLS_ACTIONS: tuple[Action, ...] = (
    Action(
        "fill_in",
        "Fill In Unseen Keypoints from the Fit",
        "Tools",
        ("Ctrl+I",),
        "Give keypoints that nobody has placed the position that the others imply: occluded or out of view.",
        "keypoints",
    ),
    Action(
        "other_solution",
        "Pose the Tool in the Other Solution",
        "Tools",
        ("Ctrl+Alt+O",),
        "Where two poses explain what is placed equally well, take the other one.",
        "alternatives",
    ),
    Action(
        "refine",
        "Refine against the Volume…",
        "Tools",
        ("Ctrl+R",),
        "Look for the tool's surface in the volume near its pose, and propose what fits it best.",
        "positions",
        separated=True,
    ),
    Action(
        "every_relabelling",
        "Try Every Order of the Keypoints",
        "Tools",
        ("Ctrl+K",),
        "Look for any interchange of keypoints that would explain an implausible annotation.",
        "keypoints",
    ),
    Action(
        "calibrate",
        "Calibrate…",
        "Tools",
        ("Ctrl+Alt+C",),
        "Take link lengths and cross-sections from finished annotations into a new specification.",
        "volume",
        separated=True,
    ),
    Action(
        "compute_agreement",
        "Compute Agreement",
        "Tools",
        ("Ctrl+Alt+A",),
        "Say how far apart the annotators of the study or folder are, in micrometres and degrees.",
        separated=True,
    ),
    Action(
        "export_agreement",
        "Export Agreement…",
        "Tools",
        ("Ctrl+Alt+E",),
        "Write the report on the agreement into files: HTML, PDF, CSV, JSON.",
    ),
    Action(
        "check_study",
        "Check Study",
        "Tools",
        ("Ctrl+Alt+V",),
        "Look for everything that is missing, stale, orphaned or inconsistent in the open study.",
        "study",
        separated=True,
    ),
)
