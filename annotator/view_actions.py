"""The actions of the menu View: what is shown, and how; none of them touches an annotation."""

from typing import get_args

from annotator.action import Action
from annotator.view import Layer, Pane

_PANE_TEXTS: dict[Pane, str] = {
    "scene": "Scene Alone",
    "slice0": "Slice across x Alone",
    "slice1": "Slice across y Alone",
    "slice2": "Slice across z Alone",
}
_LAYER_TEXTS: dict[Layer, tuple[str, str]] = {
    "volume": ("Volume", "Shift+V"),
    "planes": ("Slice Planes", "Shift+S"),
    "axes": ("Axes and Outline", "Shift+A"),
    "scale_bar": ("Scale Bars", "Shift+B"),
    "names": ("Keypoint Names", "Shift+N"),
    "links": ("Links", "Shift+L"),
    "crosshair": ("Crosshair", "Shift+C"),
}

PRESETS = ("+x", "-x", "+y", "-y", "+z", "-z", "home")
"""Directions of the scene's camera, in the order of their keys."""

VIEW_ACTIONS: tuple[Action, ...] = (
    Action(
        "maximize",
        "Maximize Pane",
        "View",
        ("F",),
        "Let the pane used last fill the window, or show all four again; so does a double click on a header.",
        checkable=True,
    ),
    *(
        Action(
            f"show_{pane}", _PANE_TEXTS[pane], "View/Panes", (f"F{number}",), "Let this pane fill the window."
        )
        for number, pane in enumerate(get_args(Pane), start=5)
    ),
    Action(
        "four_up", "All Four", "View/Panes", ("F4",), "Show the scene and the three slices.", separated=True
    ),
    *(
        Action(
            f"camera_{preset}",
            "Home" if preset == "home" else f"Look along {preset.replace('-', '−')}",
            "View/Camera",
            (f"Ctrl+{number}",),
            "Turn the scene's camera.",
            "volume",
        )
        for number, preset in enumerate(PRESETS, start=1)
    ),
    Action(
        "perspective",
        "Perspective",
        "View/Camera",
        ("Ctrl+8",),
        "Draw what is near larger; otherwise one scale holds at every depth.",
        checkable=True,
        separated=True,
    ),
    Action("zoom_fit", "Zoom to Fit", "View", ("Ctrl+0",), "Fit the whole volume into every pane.", "volume"),
    Action("zoom_in", "Zoom In", "View", ("Ctrl++", "Ctrl+="), "Enlarge the slices.", "volume", repeats=True),
    Action("zoom_out", "Zoom Out", "View", ("Ctrl+-",), "Shrink the slices.", "volume", repeats=True),
    Action(
        "zoom_keypoint",
        "Zoom to Active Keypoint",
        "View",
        ("Z",),
        "Show the active keypoint's surroundings in every pane.",
        "positioned",
    ),
    Action(
        "hide_overlays",
        "Hide Overlays While Held",
        "View",
        ("H",),
        "Show the bare image as long as the key is held.",
        "volume",
        checkable=True,
        separated=True,
    ),
    *(
        Action(f"layer_{layer}", text, "View/Layers", (key,), "Show or hide this layer.", checkable=True)
        for layer, (text, key) in _LAYER_TEXTS.items()
    ),
    Action(
        "detail",
        "Detail around Keypoint",
        "View",
        ("D",),
        "Show the full resolution around the active keypoint in the scene.",
        "volume",
        checkable=True,
    ),
    Action(
        "rendering",
        "Maximum Intensity Projection",
        "View",
        ("R",),
        "Show the brightest voxel along each ray instead of surfaces.",
        "volume",
        checkable=True,
    ),
    Action(
        "auto_window",
        "Automatic Window",
        "View",
        ("W",),
        "Set window and level by the intensities.",
        "volume",
    ),
    *(
        Action(
            f"theme_{theme}",
            theme.title(),
            "View/Theme",
            (f"Ctrl+F{number}",),
            "Choose the colours of the window.",
            checkable=True,
        )
        for number, theme in enumerate(("light", "dark", "system"), start=9)
    ),
    *(
        Action(
            f"panel_{panel}",
            text,
            "View/Panels",
            (f"Alt+{number}",),
            "Show or hide this panel.",
            checkable=True,
        )
        for number, (panel, text) in enumerate(
            (("worklist", "Volumes"), ("keypoints", "Keypoints"), ("pose", "Pose"), ("display", "Display")),
            start=1,
        )
    ),
    Action(
        "reset_layout",
        "Reset Layout",
        "View/Panels",
        ("Alt+0",),
        "Put every panel back to where it was at first.",
        separated=True,
    ),
    Action(
        "full_screen", "Full Screen", "View", ("F11",), "Fill the screen.", checkable=True, separated=True
    ),
)
