"""What errors may depend on."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from annotations.documents.record import changed
from annotations.geometry.frames import Vector, vector
from annotations.prediction.errors.circumstances import depth_um, truth_sha256, visible_share
from tests.annotations.prediction.known_keypoints import FORCEPS
from tests.annotations.prediction.made_predictions import TRUE_UM, VOLUME

numbers = st.floats(-40_000, 40_000)
points = st.tuples(numbers, numbers, numbers)


def test_depth_is_the_mean_along_the_axis_of_the_light() -> None:
    assert depth_um({"a": (1.0, 2.0, 3.0), "b": (3.0, 8.0, 5.0)}, 2) == 4.0
    assert depth_um({"a": (1.0, 2.0, 3.0), "b": (3.0, 8.0, 5.0)}, 1) == 5.0
    assert depth_um({}, 2) is None


@given(st.fixed_dictionaries(dict.fromkeys(FORCEPS.keypoint_names, points)))
def test_the_visible_share_is_that_of_many_points_along_the_links(truth_um: dict[str, Vector]) -> None:
    lengths_um, shares = [], []
    for link in FORCEPS.links:
        base_um, tip_um = np.array(truth_um[link.base]), np.array(truth_um[link.tip])
        steps = (np.arange(400) + 0.5) / 400
        along_um = base_um + steps[:, None] * (tip_um - base_um)
        lengths_um.append(np.linalg.norm(tip_um - base_um))
        shares.append(np.mean([VOLUME.contains(vector(point_um)) for point_um in along_um]))

    share = visible_share(truth_um, FORCEPS, VOLUME)

    if sum(lengths_um) == 0:
        assert share is None
    else:
        assert share is not None
        assert share == pytest.approx(np.average(shares, weights=lengths_um), abs=0.006)
        assert 0 <= share <= 1


def test_a_tool_that_ends_in_the_outer_half_of_a_voxel_is_wholly_visible() -> None:
    last_um = (1095.4 * 15.9, 1935.4 * 13.5, 1151.4 * 9.4)
    inside = {**TRUE_UM, "k5": last_um}
    assert visible_share(inside, FORCEPS, VOLUME) == 1.0
    beyond = {**TRUE_UM, "k5": vector(np.add(last_um, 9.4))}
    share = visible_share(beyond, FORCEPS, VOLUME)
    assert share is not None
    assert 0.99 < share < 1.0


def test_links_without_both_ends_do_not_count() -> None:
    only = {name: TRUE_UM[name] for name in ("k0", "k1", "k2")}
    assert visible_share(only, FORCEPS, VOLUME) == 1.0
    assert visible_share({"k0": TRUE_UM["k0"]}, FORCEPS, VOLUME) is None
    tiny = changed(VOLUME, shape=(1, 1, 1))
    assert visible_share(TRUE_UM, FORCEPS, tiny) == 0.0


def test_a_moved_keypoint_changes_the_hash_and_rounding_does_not() -> None:
    before = truth_sha256(TRUE_UM)
    assert truth_sha256(dict(reversed(TRUE_UM.items()))) == before
    assert truth_sha256({**TRUE_UM, "k0": vector(np.add(TRUE_UM["k0"], (0.0, 0.0, 0.1)))}) != before
    assert truth_sha256({name: TRUE_UM[name] for name in ("k0", "k1")}) != before
    assert truth_sha256({"a": (-1e-9, 0.0, 1.0)}) == truth_sha256({"a": (0.0, -0.0, 1.0 + 1e-9)})
