"""The actions of the menu View: what is shown, and how; none of them touches an annotation."""

from typing import get_args

from annotator.actions.action import Action
from annotator.session.viewing.view import Layer, Pane, Preset

PANE_TITLES: dict[Pane, str] = {
    "scene": "Scene",
    "slice0": "Slice across x",
    "slice1": "Slice across y",
    "slice2": "Slice across z",
}
LAYER_TITLES: dict[Layer, str] = {
    "volume": "Volume",
    "planes": "Slice Planes",
    "axes": "Axes and Outline",
    "scale_bar": "Scale Bars",
    "names": "Keypoint Names",
    "links": "Links",
    "ghost": "Fitted Tool (Ghost)",
    "crosshair": "Crosshair",
    "others": "Other Annotators",
    "prediction": "Prediction",
    "truth": "Ground Truth",
    "errors": "Lines from Truth to Prediction",
    "distances": "Distances",
    "predicted_tool": "Predicted Tool (Ghost)",
    "heatmaps": "Heatmaps",
}
_LAYER_KEYS: dict[Layer, str] = {
    "volume": "Shift+V",
    "planes": "Shift+S",
    "axes": "Shift+A",
    "scale_bar": "Shift+B",
    "names": "Shift+N",
    "links": "Shift+L",
    "ghost": "Shift+G",
    "crosshair": "Shift+C",
    "others": "Shift+O",
    "prediction": "Shift+P",
    "truth": "Shift+T",
    "errors": "Shift+E",
    "distances": "Shift+D",
    "predicted_tool": "Shift+U",
    "heatmaps": "Shift+H",
}
_PREDICTION_HINTS: dict[Layer, str] = {
    "prediction": "Show or hide what the checkpoint in use says of the volume, with all that belongs to it.",
    "truth": "Show or hide the keypoints that a prediction is held against.",
    "errors": "Show or hide a line from each keypoint to where it is predicted.",
    "distances": "Show or hide how far each keypoint is from where it is predicted.",
    "predicted_tool": "Show or hide the tool in the predicted pose.",
    "heatmaps": "Show or hide the cloud in which a network takes the active keypoint to be, or all of them.",
}
"""Of the layers that a prediction consists of: a menu of their own."""

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
            f"show_{pane}",
            f"{PANE_TITLES[pane]} Alone",
            "View/Panes",
            (f"F{number}",),
            "Let this pane fill the window.",
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
        for number, preset in enumerate(get_args(Preset), start=1)
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
        "Zoom to Active Keypoint or Box",
        "View",
        ("Z",),
        "Show the surroundings of the active keypoint or box in every pane.",
        "seen",
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
        Action(
            f"layer_{layer}",
            title,
            "View/Layers",
            (_LAYER_KEYS[layer],),
            "Show or hide this layer.",
            checkable=True,
        )
        for layer, title in LAYER_TITLES.items()
        if layer not in _PREDICTION_HINTS
    ),
    *(
        Action(
            f"layer_{layer}",
            LAYER_TITLES[layer],
            "View/Prediction",
            (_LAYER_KEYS[layer],),
            hint,
            checkable=True,
        )
        for layer, hint in _PREDICTION_HINTS.items()
    ),
    Action(
        "review_colors",
        "Blue and Orange",
        "View/Prediction",
        ("Shift+R",),
        "Draw truth and prediction in colours that colour-blind people can tell apart.",
        checkable=True,
        separated=True,
    ),
    Action(
        "detail",
        "Detail around Keypoint or Box",
        "View",
        ("D",),
        "Show the full resolution around the active keypoint or box in the scene.",
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
            (
                ("worklist", "Volumes"),
                ("keypoints", "Keypoints or Boxes"),
                ("pose", "Pose"),
                ("display", "Display"),
                ("agreement", "Agreement"),
                ("consensus", "Consensus"),
                ("predictions", "Predictions"),
            ),
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
