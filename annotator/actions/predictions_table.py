"""The actions of the menu Predictions: checkpoints, what they predict, and what is made of it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from annotator.actions.action import Action

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.verdicts.verdicts import Verdict

VERDICT_TITLES: "Mapping[Verdict, str]" = {
    "annotation_wrong": "The Annotation Is Wrong",
    "model_wrong": "The Model Is Wrong",
    "both_wrong": "Both Are Wrong",
    "neither_wrong": "Neither Is Wrong",
}
"""What the verdicts of a reviewer are called."""

PREDICTIONS_ACTIONS: tuple[Action, ...] = (
    Action(
        "load_checkpoint",
        "Load Checkpoint…",
        "Predictions",
        ("Ctrl+L",),
        "Open a trained network, and see what it is and whether it fits what is open.",
    ),
    Action(
        "shipped_checkpoint",
        "Load the One That Ships",
        "Predictions",
        ("Ctrl+Shift+L",),
        "Open the checkpoint that comes with the program for the tool in use.",
        "shipped",
    ),
    Action(
        "predict_volume",
        "Predict This Volume",
        "Predictions",
        ("Ctrl+P",),
        "Let the checkpoint find the keypoints of the open volume.",
        "predictable_volume",
        separated=True,
    ),
    Action(
        "predict_selection",
        "Predict the Selected Volumes",
        "Predictions",
        ("Ctrl+Alt+D",),
        "Let the checkpoint find the keypoints of the volumes that are selected in the list.",
        "predictable",
    ),
    Action(
        "predict_study",
        "Predict the Whole Study",
        "Predictions",
        ("Ctrl+Shift+P",),
        "Let the checkpoint find the keypoints of every volume of the study or folder.",
        "predictable",
    ),
    Action(
        "start_from_prediction",
        "Start from the Prediction",
        "Predictions",
        ("Ctrl+Alt+I",),
        "Put unplaced keypoints where the checkpoint has them; each counts as predicted until accepted.",
        "predicted",
        separated=True,
    ),
    Action(
        "accept_prediction",
        "Accept What Is Predicted",
        "Predictions",
        ("Ctrl+Return",),
        "Say that the keypoints that still are where the checkpoint has put them are right.",
        "started_from_prediction",
    ),
    Action(
        "next_worse",
        "Next Volume in the Ranking",
        "Predictions",
        ("Alt+PgDown",),
        "Open the next volume of the list of errors, the camera as it is.",
        "reviewed",
        separated=True,
    ),
    Action(
        "previous_worse",
        "Previous Volume in the Ranking",
        "Predictions",
        ("Alt+PgUp",),
        "Open the volume before in the list of errors, the camera as it is.",
        "reviewed",
    ),
    *(
        Action(
            f"verdict_{verdict}",
            text,
            "Predictions/Verdict",
            (f"Ctrl+Alt+F{number}",),
            "Record what you think of the open volume, or take the same verdict back.",
            "judgeable",
            checkable=True,
        )
        for number, (verdict, text) in enumerate(VERDICT_TITLES.items(), start=5)
    ),
    Action(
        "compute_errors",
        "Compute the Errors",
        "Predictions",
        ("Ctrl+Alt+G",),
        "Compare the predictions with the annotations that speak for the study's volumes.",
        "reviewable",
        separated=True,
    ),
    Action(
        "export_errors",
        "Export the Errors…",
        "Predictions",
        ("Ctrl+Shift+E",),
        "Write tables, plots, the worst volumes and the verdicts into files: HTML, CSV, JSON, text.",
        "errors",
    ),
    Action(
        "live_view",
        "Live View…",
        "Predictions",
        ("Ctrl+Alt+W",),
        "Show volumes and the predicted pose as they arrive in a folder, or as they were recorded.",
        separated=True,
    ),
)
