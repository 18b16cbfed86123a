"""A prediction that is shown without a checkpoint: made by hand, for tests of what draws it."""

from dataclasses import replace

import numpy as np
import pytest

from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.prediction.volume_heatmaps import VolumeHeatmaps
from annotator.session import Session
from annotator.session.editing.solids import posed_solids
from annotator.session.predictions.predicted import KeypointPair, ShownPrediction
from annotator.session.predictions.predicting import Predicting

OFF_UM = (900.0, -1400.0, 400.0)
_STEP_UM, _SIGMA_UM = 500.0, 700.0


def show_prediction(monkeypatch: pytest.MonkeyPatch, session: Session, pose: ToolPose) -> ShownPrediction:
    """Let a session show the tool in a pose as Ben's truth, and all of it predicted `OFF_UM` beside."""
    tool = session.tool
    assert tool is not None
    true_um = keypoints_um(pose, tool)
    moved = replace(pose, position_um=beside(pose.position_um))
    predicted_um = keypoints_um(moved, tool)
    shown = ShownPrediction(
        "forceps-3",
        "ben",
        tuple(KeypointPair(name, true_um[name], predicted_um[name]) for name in tool.keypoint_names),
        posed_solids(moved, tool, "prediction"),
        heatmaps=VolumeHeatmaps(
            tool.keypoint_names,
            np.stack([_gaussian(predicted_um[name]) for name in tool.keypoint_names]),
            (0.0, 0.0, 0.0),
            (_STEP_UM, _STEP_UM, _STEP_UM),
        ),
    )
    monkeypatch.setattr(Predicting, "shown", property(lambda _: shown))
    session.look(layers=session.view.layers | {"prediction"})
    session.predicting.shown_changed.emit()
    return shown


def beside(position_um: Vector) -> Vector:
    """Return where the prediction has what is at a position in truth."""
    x, y, z = np.add(position_um, OFF_UM).tolist()
    return (x, y, z)


def _gaussian(middle_um: Vector) -> np.ndarray:
    places_um = _STEP_UM * np.stack(np.meshgrid(*(np.arange(56),) * 3, indexing="ij"), axis=-1)
    values = np.exp(-((places_um - middle_um) ** 2).sum(axis=-1) / (2 * _SIGMA_UM**2))
    return (values / values.sum()).astype(np.float32)
