"""Prediction documents to test with, and what Hypothesis draws for one."""

from collections.abc import Mapping
from datetime import UTC
from typing import Any

import hypothesis.strategies as st
import numpy as np

from annotations.documents.annotation import VolumeReference
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import quaternion
from annotations.geometry.tool_library import shipped_tools
from annotations.prediction.predicted_pose import fit_prediction
from annotations.prediction.prediction import (
    CheckpointReference,
    Confidence,
    FittedPose,
    PredictedKeypoint,
    Prediction,
    prediction_of,
)
from tests.annotations.prediction.known_keypoints import FORCEPS, SHA256, described, predicted

POSE = ToolPose(
    (8000.0, 7000.0, 5000.0), quaternion((0.7, 0.1, 0.05, 0.7)), {"theta1": -20.0, "theta2": 40.0}
)
TRUE_UM = keypoints_um(POSE, FORCEPS)
VOLUME = VolumeReference(
    path="../../volumes/v001.npy",
    shape=(1096, 1936, 1152),
    dtype="uint8",
    spacing_um=(15.9, 13.5, 9.4),
    fingerprint="0" * 64,
)
CHECKPOINT = CheckpointReference(name="Known", sha256=SHA256, path="../../known.onnx")


def made_prediction(
    positions_um: Mapping[str, Vector] = TRUE_UM,
    volume: VolumeReference = VOLUME,
    checkpoint: CheckpointReference = CHECKPOINT,
) -> Prediction:
    found = predicted(positions_um)
    return prediction_of(found, fit_prediction(found, described()), volume, checkpoint, FORCEPS)


words = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
names = words.filter(bool)
paths = names.filter(lambda text: "\0" not in text)
numbers = st.floats(allow_nan=False, allow_infinity=False)
positions = st.tuples(numbers, numbers, numbers)
not_negative = st.floats(min_value=0, allow_infinity=False)
lengths = st.floats(min_value=5e-324, allow_infinity=False)
moments = st.datetimes(timezones=st.just(UTC)).map(lambda moment: moment.replace(microsecond=0))

volumes = st.builds(
    VolumeReference,
    path=paths,
    dataset=st.none() | words,
    shape=st.tuples(*[st.integers(1, 10_000)] * 3),
    dtype=words,
    spacing_um=st.tuples(lengths, lengths, lengths),
    fingerprint=words,
)
checkpoints = st.builds(
    CheckpointReference,
    name=names,
    sha256=st.text("0123456789abcdef", min_size=64, max_size=64),
    path=st.none() | paths,
)
confidences = st.builds(
    Confidence,
    peak=numbers,
    presence=st.floats(0, 1),
    spread_um=st.tuples(not_negative, not_negative, not_negative),
)


@st.composite
def keypoints(draw: st.DrawFn) -> PredictedKeypoint:
    fields: dict[str, Any] = {"name": draw(words), "confidence": draw(confidences)}
    fields["state"] = draw(st.sampled_from(["placed", "out_of_view", "unplaced"]))
    if fields["state"] != "unplaced":
        fields |= {"position_um": draw(positions), "source": "predicted"}
    return PredictedKeypoint(**fields)


poses = st.builds(
    FittedPose,
    position_um=positions,
    rotation_wxyz=st.tuples(*[st.floats(-1, 1)] * 4)
    .filter(lambda parts: np.linalg.norm(parts) > 1e-3)
    .map(quaternion),
    angles_deg=st.dictionaries(words, numbers, max_size=2),
    open=st.lists(words, max_size=2).map(tuple),
    keypoints_um=st.dictionaries(words, positions, max_size=3),
    rms_um=not_negative,
    left_out=st.lists(words, max_size=2).map(tuple),
)


@st.composite
def predictions(draw: st.DrawFn) -> Prediction:
    tool = draw(st.sampled_from(list(shipped_tools().values())))
    travels = draw(st.booleans())
    return Prediction(
        volume=draw(volumes),
        tool=tool.name if travels else draw(words),
        tool_fingerprint=tool.fingerprint if travels else draw(st.none() | words),
        tool_copy=tool if travels else None,
        checkpoint=draw(checkpoints),
        keypoints=tuple(draw(st.lists(keypoints(), max_size=6, unique_by=lambda each: each.name))),
        pose=draw(st.none() | poses),
        created=draw(moments),
        program=draw(words),
    )
