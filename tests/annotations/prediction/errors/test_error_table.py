"""Rows of a table of errors, from predictions and truths."""

import math

import hypothesis.strategies as st
from hypothesis import given

from annotations.geometry.frames import Vector
from annotations.prediction.errors.error_table import JudgedPrediction, error_table
from tests.annotations.prediction.known_keypoints import FORCEPS
from tests.annotations.prediction.made_predictions import TRUE_UM, VOLUME, made_prediction

# Around the two ends of each axis, and exactly where the last voxel ends.
edge_positions = st.tuples(
    *(
        st.sampled_from([-0.5 * spacing_um, (count - 0.5) * spacing_um])
        | st.floats(-20.0, 20.0)
        | st.floats((count - 2) * spacing_um, (count + 1) * spacing_um)
        for count, spacing_um in zip(VOLUME.shape, VOLUME.spacing_um, strict=True)
    )
)


@given(st.dictionaries(st.sampled_from(FORCEPS.keypoint_names), edge_positions))
def test_keypoints_are_out_of_view_as_the_volume_says(truth_um: dict[str, Vector]) -> None:
    prediction = made_prediction()
    table = error_table([JudgedPrediction("v1", prediction, truth_um, "anna")], FORCEPS)

    expected = [
        name
        for name in FORCEPS.keypoint_names
        if name in truth_um and not prediction.volume.contains(truth_um[name])
    ]
    assert list(table.rows[0].out_of_view) == expected


def test_the_spread_is_that_of_the_keypoints_that_were_found() -> None:
    prediction = made_prediction({name: TRUE_UM[name] for name in ("k0", "k1", "k2")})
    [row] = error_table([JudgedPrediction("v1", prediction, TRUE_UM, "anna")], FORCEPS).rows

    found = [each for each in prediction.keypoints if each.position_um is not None]
    assert len(found) == 3
    assert row.spread_um == max(math.hypot(*each.confidence.spread_um) for each in found)
    [nothing] = error_table([JudgedPrediction("v1", made_prediction({}), TRUE_UM, "anna")], FORCEPS).rows
    assert nothing.spread_um is None
    assert nothing.visible_share == 1.0


def test_a_truth_without_keypoints_tells_nothing() -> None:
    [row] = error_table([JudgedPrediction("v1", made_prediction(), {}, "anna")], FORCEPS).rows

    assert (row.depth_um, row.visible_share, row.true_angles_deg, row.out_of_view) == (None, None, {}, ())


def test_a_table_of_nothing_has_no_rows() -> None:
    assert error_table([], FORCEPS).rows == ()
