from collections.abc import Callable

import numpy as np
import pytest

from annotations.agreement.compared import Compared
from annotations.agreement.results import TurnedBox
from annotations.agreement.turned_boxes import turned_boxes
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotations.geometry.tool import ToolSpecification

MakeCompared = Callable[..., Compared]


def boxes(compared_of: MakeCompared, *turns_deg: tuple[float, float, float] | None) -> Compared:
    """Return one volume with yaw, pitch and roll of link 1 by each annotator; other links are not there."""
    rotations = np.full((1, len(turns_deg), 3, 4), np.nan)
    for who, turn in enumerate(turns_deg):
        if turn is not None:
            rotations[0, who, 1] = from_yaw_pitch_roll(*turn)
    return compared_of(np.zeros((1, len(turns_deg), 6, 3)), rotations)


def test_box_in_the_minority_is_named(compared_of: MakeCompared, forceps: ToolSpecification) -> None:
    compared = boxes(compared_of, (30, 20, 40), (31, 19, -139), (29, 21, 45), None)
    assert turned_boxes(compared, forceps) == (TurnedBox(volume="v0", link="link1", annotators=("ben",)),)


def test_of_two_both_are_named_because_nobody_can_tell_which_is_right(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    (found,) = turned_boxes(boxes(compared_of, (0, 0, 0), (0, 0, 175)), forceps)
    assert found.annotators == ("anna", "ben")


@pytest.mark.parametrize(
    "other",
    [(0, 0, 90), (0, 0, 145), (180, 0, 180), (0, 20, 180), (0, 0, 10)],
    ids=["rolled", "not quite", "reversed", "another axis", "nearly the same"],
)
def test_what_is_not_the_same_body_is_not_turned(
    other: tuple[float, float, float], compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    assert turned_boxes(boxes(compared_of, (0, 0, 0), other), forceps) == ()


def test_keypoints_have_no_turned_boxes(compared_of: MakeCompared, forceps: ToolSpecification) -> None:
    assert turned_boxes(compared_of(np.zeros((1, 2, 6, 3))), forceps) == ()


def test_volumes_keep_their_order(compared_of: MakeCompared, forceps: ToolSpecification) -> None:
    rotations = np.zeros((2, 2, 3, 4))
    rotations[..., 0] = 1.0
    rotations[0, 0, 2] = rotations[1, 1, 0] = (0.0, 1.0, 0.0, 0.0)
    found = turned_boxes(compared_of(np.zeros((2, 2, 6, 3)), rotations), forceps)
    assert [(box.volume, box.link) for box in found] == [("v0", "link2"), ("v1", "link0")]
