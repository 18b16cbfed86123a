"""Views are compared at every look: whatever is in them can be compared, and a change is noticed."""

from dataclasses import replace

import pytest

from annotations.fitting.refine import Refinement, Support
from annotations.geometry.kinematics import ToolPose
from annotator.session import Session
from annotator.session.viewing.view import Draft, View

POSE = ToolPose((1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 10.0})
REFINEMENT = Refinement(POSE, {"k0": 1.0}, {"link0": Support(3, 4)}, 2.0, 1.0, "")


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (REFINEMENT, replace(REFINEMENT, pose=replace(POSE, position_um=(1.0, 2.0, 4.0)))),
        (REFINEMENT, replace(REFINEMENT, moves_um={"k0": 2.0})),
        (REFINEMENT, None),
    ],
)
def test_views_with_a_refinement_are_compared(one: Refinement, other: Refinement | None) -> None:
    assert View(refinement=one) == View(refinement=replace(one))
    assert View(refinement=one) != View(refinement=other)


def test_poses_and_drafts_are_compared(session: Session) -> None:
    assert session.document is not None
    assert View(pose=POSE) == View(pose=replace(POSE, angles_deg={"theta1": 10.0}))
    assert View(pose=POSE) != View(pose=replace(POSE, angles_deg={}))
    draft = Draft(session.document, "Move link0")
    assert View(draft=draft) == View(draft=replace(draft))
    assert View(draft=draft) != View(draft=replace(draft, pose=POSE))


def test_an_equal_look_is_not_announced(session: Session) -> None:
    announced: list[object] = []
    session.look(refinement=REFINEMENT, pose=POSE)
    session.view_changed.connect(lambda before, after: announced.append((before, after)))
    session.look(refinement=replace(REFINEMENT), pose=replace(POSE))
    assert announced == []
    session.look(refinement=None)
    assert len(announced) == 1
