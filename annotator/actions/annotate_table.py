"""The actions of the menu Annotate: modes, choosing, moving, turning, bending, and judging what is placed."""

from annotator.actions.action import Action

KEYPOINT_KEYS = 9
BENT_JOINTS = 2
"""How many joints have keys that bend them."""

_TURNS = (
    ("", "On by a Degree", ""),
    ("_back", "Back by a Degree", "Shift+"),
    ("_ten", "On by Ten", "Ctrl+Alt+"),
    ("_back_ten", "Back by Ten", "Ctrl+Alt+Shift+"),
)
_MOVES = (
    ("left", "Left", "Left"),
    ("right", "Right", "Right"),
    ("up", "Up", "Up"),
    ("down", "Down", "Down"),
    ("before", "One Plane Back", "PgUp"),
    ("behind", "One Plane On", "PgDown"),
)
_MOVE_HELP = (
    "in the slice used last: the active keypoint or box in place mode, the tool in pose mode, "
    "else the crosshair."
)

ANNOTATE_ACTIONS: tuple[Action, ...] = (
    Action(
        "navigate_mode",
        "Navigate",
        "Annotate",
        ("Esc",),
        "No click moves an annotation. First drops what is on its way, then leaves the other modes.",
        checkable=True,
    ),
    Action(
        "place_mode",
        "Place Keypoints or Boxes",
        "Annotate",
        ("P",),
        "A click places the active keypoint or an end of the active box; drags move keypoints and handles.",
        "document",
        checkable=True,
    ),
    Action(
        "pose_mode",
        "Pose the Whole Tool",
        "Annotate",
        ("B",),
        "Handles and keys move, turn and bend the tool as one body; everything placed follows.",
        "document",
        checkable=True,
    ),
    Action(
        "keep_preview",
        "Keep What Is Proposed",
        "Annotate",
        ("Return", "Enter"),
        "Keep the position that a click in the scene proposed, or the pose that the volume did.",
        "preview",
    ),
    *(
        Action(
            f"method_{method}",
            f"By {method.title()}",
            "Annotate/Method",
            (key,),
            f"Annotate by {method}; each method has a file of its own, and both stay.",
            checkable=True,
        )
        for method, key in (("keypoints", "Ctrl+Shift+K"), ("boxes", "Ctrl+Shift+B"))
    ),
    Action(
        "derive",
        "Derive the Other Method…",
        "Annotate/Method",
        ("Ctrl+E",),
        "Make a new, marked annotation: boxes from the keypoints, or keypoints from the boxes.",
        "positions",
        separated=True,
    ),
    Action(
        "next_unplaced",
        "Next Unplaced",
        "Annotate",
        ("N",),
        "Make the next keypoint or box that is not placed the active one.",
        "document",
        separated=True,
    ),
    *(
        Action(
            f"keypoint_{number}",
            f"Keypoint or Link {number}",
            "Annotate/Keypoint or Link",
            (str(number),),
            "Make this keypoint or link the active one, and go to it.",
            "document",
            checkable=True,
        )
        for number in range(1, KEYPOINT_KEYS + 1)
    ),
    Action(
        "go_to_keypoint",
        "Go to Active Part",
        "Annotate",
        ("G",),
        "Bring the crosshair and the slices to the active keypoint or box.",
        "seen",
    ),
    *(
        Action(
            f"move_{name}",
            text,
            "Annotate/Move by a Voxel",
            (key,),
            f"Move by one voxel {_MOVE_HELP}",
            "volume",
            repeats=True,
        )
        for name, text, key in _MOVES
    ),
    *(
        Action(
            f"move_{name}_ten",
            f"{text} by Ten" if number < 4 else text.replace("One Plane", "Ten Planes"),
            "Annotate/Move by a Voxel",
            (f"Shift+{key}",),
            f"Move by ten voxels {_MOVE_HELP}",
            "volume",
            separated=number == 0,
            repeats=True,
        )
        for number, (name, text, key) in enumerate(_MOVES)
    ),
    *(
        Action(
            f"turn_{axis}{name}",
            f"About Own {axis}, {words}",
            "Annotate/Turn",
            (f"{modifier}{key}",),
            f"Turn the active box, or in pose mode the tool, about its own {axis} axis.",
            "turnable",
            repeats=True,
            separated=bool(name) and name.endswith("ten") and axis == "x" and "back" not in name,
        )
        for name, words, modifier in _TURNS
        for axis, key in (("x", "X"), ("y", "Y"), ("z", "Q"))
    ),
    Action(
        "turn_over",
        "Turn the Box Over",
        "Annotate/Turn",
        ("I",),
        "Turn the active box 180° about its own x: the same body, with the hinge's axis in the other sense.",
        "box",
        separated=True,
    ),
    *(
        Action(
            f"bend_{joint}{name}",
            f"Joint {joint}, {words}",
            "Annotate/Bend",
            (f"{modifier}{key}",),
            "Bend this joint of the tool in pose mode, within its limits.",
            "posing",
            repeats=True,
        )
        for name, words, modifier in _TURNS
        for joint, key in zip(range(1, BENT_JOINTS + 1), "JK", strict=True)
    ),
    *(
        Action(
            f"face_{sense}_{direction}{far}",
            f"{text} {direction.title()}{' by Ten' if far else ''}",
            "Annotate/Resize the Box",
            (f"{modifier}+{'Shift+' if far else ''}{direction.title()}",),
            f"{effect} {'ten voxels' if far else 'one voxel'} along the arrow, in the slice used last.",
            "box",
            repeats=True,
            separated=direction == "left" and bool(far or sense == "in"),
        )
        for sense, text, modifier, effect in (
            ("out", "Grow", "Ctrl", "Move the face that looks along the arrow"),
            ("in", "Shrink", "Alt", "Move the face opposite to the one that looks along the arrow"),
        )
        for far in ("", "_ten")
        for direction in ("left", "right", "up", "down")
    ),
    Action(
        "free_cross_section",
        "Free Cross-section",
        "Annotate/Resize the Box",
        ("C",),
        "Let the active box change its width and height; otherwise they are held as they are.",
        "box",
        checkable=True,
        separated=True,
    ),
    Action(
        "snap_maximum",
        "Snap to Brightest Point",
        "Annotate",
        ("M",),
        "Move the active keypoint to the brightest point near it.",
        "keypoint",
        separated=True,
    ),
    Action(
        "snap_edge",
        "Snap to Edge",
        "Annotate",
        ("E",),
        "Move the active keypoint to the strongest edge near it.",
        "keypoint",
    ),
    Action(
        "state_placed",
        "Placed",
        "Annotate/State",
        ("S",),
        "The active keypoint or box is seen where it stands.",
        "positioned",
        checkable=True,
    ),
    Action(
        "state_occluded",
        "Occluded",
        "Annotate/State",
        ("O",),
        "The active keypoint or box is hidden by something: its position is inferred.",
        "positioned",
        checkable=True,
    ),
    Action(
        "state_out_of_view",
        "Out of View",
        "Annotate/State",
        ("V",),
        "The active keypoint or box lies outside what was scanned.",
        "positioned",
        checkable=True,
    ),
    Action(
        "clear",
        "Unplaced (Clear)",
        "Annotate/State",
        ("Del", "Backspace"),
        "Take the active keypoint or box away.",
        "positioned",
        separated=True,
    ),
    Action(
        "unsure",
        "Unsure",
        "Annotate",
        ("U",),
        "Say that the place of the active keypoint or box is uncertain.",
        "positioned",
        checkable=True,
    ),
    Action(
        "lock",
        "Locked",
        "Annotate",
        ("L",),
        "Protect the active keypoint or box from every change.",
        "active",
        checkable=True,
    ),
    Action(
        "mark_done",
        "Done",
        "Annotate",
        ("Ctrl+D",),
        "Say that this volume is finished; it stays editable.",
        "document",
        checkable=True,
        separated=True,
    ),
    Action(
        "flag",
        "Flag Volume…",
        "Annotate",
        ("Ctrl+Shift+F",),
        "Say why somebody should look at this volume, or take that back.",
        "document",
        checkable=True,
    ),
)
