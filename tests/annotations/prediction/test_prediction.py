"""The prediction document."""

import pytest
from pydantic import ValidationError

from annotations.documents.record import changed
from annotations.geometry.tool import ToolSpecification
from annotations.prediction.predicted_pose import fit_prediction
from annotations.prediction.prediction import (
    Confidence,
    PredictedKeypoint,
    Prediction,
    prediction_of,
)
from tests.annotations.prediction.known_keypoints import FORCEPS, SHA256, described, predicted
from tests.annotations.prediction.made_predictions import (
    CHECKPOINT,
    POSE,
    TRUE_UM,
    VOLUME,
    made_prediction,
)

CONFIDENCE = Confidence(peak=0.2, presence=1.0, spread_um=(1.0, 2.0, 3.0))


def test_it_says_what_was_predicted_and_by_what() -> None:
    prediction = made_prediction()

    assert prediction.positions_um == TRUE_UM
    assert {each.source for each in prediction.keypoints} == {"predicted"}
    assert {each.state for each in prediction.keypoints} == {"placed"}
    assert prediction.checkpoint == CHECKPOINT
    assert prediction.tool_fingerprint == FORCEPS.fingerprint
    assert prediction.tool_copy is None
    assert prediction.pose is not None
    assert prediction.pose.angles_deg == pytest.approx(POSE.angles_deg, abs=0.01)
    assert prediction.pose.position_um == pytest.approx(POSE.position_um, abs=1.0)
    assert prediction.pose.left_out == ()


def test_a_tool_that_does_not_ship_travels_along() -> None:
    own = ToolSpecification.model_validate(FORCEPS.model_dump(mode="json") | {"name": "own"})
    about = described(tool=own)
    found = predicted(TRUE_UM, about)

    prediction = prediction_of(found, fit_prediction(found, about), VOLUME, CHECKPOINT, own)

    assert prediction.tool == "own"
    assert prediction.tool_copy == own


def test_states_follow_from_the_volume_and_the_range() -> None:
    some_um = {name: TRUE_UM[name] for name in ("k0", "k1", "k2", "k3")} | {"k4": (-50.0, 100.0, 100.0)}

    prediction = made_prediction(some_um)

    assert [each.state for each in prediction.keypoints] == [
        *["placed"] * 4,
        "out_of_view",
        "unplaced",
    ]
    assert prediction.keypoints[5].position_um is None
    assert prediction.keypoints[5].source is None
    assert prediction.keypoints[5].confidence.presence == 0


def test_what_the_keypoints_do_not_tell_is_no_angle() -> None:
    prediction = made_prediction({name: TRUE_UM[name] for name in ("k0", "k1")})

    assert prediction.pose is not None
    assert dict(prediction.pose.angles_deg) == {}
    assert {"theta1_deg", "theta2_deg", "rotation_x_deg"} <= set(prediction.pose.open)
    assert set(prediction.pose.keypoints_um) == {"k0", "k1"}


def test_without_keypoints_there_is_no_pose() -> None:
    assert made_prediction({}).pose is None


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        ({"state": "placed"}, "is placed but has no position_um"),
        ({"state": "unplaced", "position_um": (1.0, 2.0, 3.0)}, "is unplaced but has a position_um"),
        ({"state": "placed", "position_um": (1.0, 2.0, 3.0)}, "needs a source"),
        ({"state": "occluded", "position_um": (1.0, 2.0, 3.0), "source": "predicted"}, "Input should be"),
        ({"state": "placed", "position_um": (1.0, 2.0, 3.0), "source": "clicked"}, "Input should be"),
        ({"state": "placed", "position_um": (1.0, 2.0, float("nan")), "source": "predicted"}, "finite"),
    ],
)
def test_a_keypoint_that_contradicts_itself_is_refused(fields: dict[str, object], problem: str) -> None:
    with pytest.raises(ValidationError, match=problem):
        PredictedKeypoint.model_validate({"name": "k0", "confidence": CONFIDENCE} | fields)


@pytest.mark.parametrize("field", ["peak", "presence", "spread_um"])
def test_no_confidence_is_nan(field: str) -> None:
    nan = float("nan")
    with pytest.raises(ValidationError):
        changed(CONFIDENCE, **{field: (nan, 1.0, 1.0) if field == "spread_um" else nan})


def test_one_keypoint_stands_once() -> None:
    prediction = made_prediction()
    with pytest.raises(ValidationError, match="keypoint 'k0' stands more than once"):
        changed(prediction, keypoints=(*prediction.keypoints, prediction.keypoints[0]))


def test_a_copy_of_another_tool_is_refused() -> None:
    with pytest.raises(ValidationError, match="tool_copy is 'magnetic-forceps'"):
        changed(made_prediction(), tool="other", tool_copy=FORCEPS)


def test_it_is_reused_for_the_same_volume_and_checkpoint_alone() -> None:
    prediction: Prediction = made_prediction()

    assert prediction.is_of(SHA256, VOLUME.fingerprint)
    assert not prediction.is_of("0" * 64, VOLUME.fingerprint)
    assert not prediction.is_of(SHA256, "1" * 64)
