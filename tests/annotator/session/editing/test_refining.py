"""A pose that is polished against the volume: proposed, and accepted, rejected or dropped."""

from dataclasses import replace

import pytest
from pytestqt.qtbot import QtBot

from annotations.errors import UserError
from annotations.fitting.refine import Refinement, Support
from annotator.session import Session
from tests.annotator.held_refiner import HeldRefiner
from tests.annotator.session.editing.posed_tool import POSE


@pytest.fixture
def refiner(monkeypatch: pytest.MonkeyPatch) -> HeldRefiner:
    moved = replace(POSE, position_um=(3100.0, 4000.0, 2000.0))
    return HeldRefiner(
        monkeypatch, Refinement(moved, {"k0": 1.0}, {"link0": Support(90, 100)}, 80.0, 20.0, "")
    )


def test_a_refinement_is_a_proposal_that_is_accepted_as_one_edit(
    qtbot: QtBot, posed: Session, refiner: HeldRefiner, messages: list[str]
) -> None:
    before, steps = posed.document, posed.undo_stack.count
    posed.refine()
    assert posed.is_refining
    refiner.go_on.set()
    qtbot.waitUntil(lambda: posed.view.refinement is not None)
    assert not posed.is_refining
    assert refiner.poses == [POSE]
    assert posed.document is before
    assert "Return accepts" in messages[-1]
    assert posed.refinement_moves_um() == pytest.approx(dict.fromkeys((f"k{n}" for n in range(6)), 100.0))
    assert [solid.kind for solid in posed.solids()].count("proposal") == 3
    posed.accept_refinement()
    assert posed.view.refinement is None
    assert posed.undo_stack.count == steps + 1
    assert {part.source for part in posed.document.parts} == {"refined"}  # type: ignore[union-attr]
    assert posed.settled_pose is refiner.result.pose  # type: ignore[union-attr]
    posed.undo_stack.undo()
    assert posed.document == before


def test_a_refinement_is_rejected_or_dropped_by_another_edit(
    qtbot: QtBot, posed: Session, refiner: HeldRefiner
) -> None:
    refiner.go_on.set()
    before = posed.document
    for give_up in (posed.reject_refinement, posed.drop_preview, lambda: posed.set_locked("k0", True)):
        posed.refine()
        qtbot.waitUntil(lambda: posed.view.refinement is not None)
        give_up()
        assert posed.view.refinement is None
        assert posed.refinement_moves_um() == {}
        posed.accept_refinement()
    assert posed.document.positions_um == before.positions_um  # type: ignore[union-attr]


def test_what_is_refined_of_an_older_document_is_not_proposed(
    qtbot: QtBot, posed: Session, refiner: HeldRefiner, messages: list[str]
) -> None:
    posed.refine()
    posed.nudge(0, 1)
    refiner.go_on.set()
    qtbot.waitUntil(lambda: not posed.is_refining)
    assert posed.view.refinement is None
    assert "refine again" in messages[-1]


def test_a_second_refinement_takes_the_place_of_the_first(
    qtbot: QtBot, posed: Session, refiner: HeldRefiner
) -> None:
    posed.refine()
    qtbot.waitUntil(lambda: len(refiner.poses) == 1)
    posed.refine()
    qtbot.waitUntil(lambda: len(refiner.poses) == 2)
    qtbot.waitUntil(lambda: sum(job.title.startswith("Refining") for job in posed.jobs.running) == 1)
    assert posed.is_refining, "the end of the first is not that of the second"
    refiner.go_on.set()
    qtbot.waitUntil(lambda: posed.view.refinement is not None)
    assert not posed.is_refining


def test_a_refinement_is_cancelled_by_a_person_and_by_closing(
    qtbot: QtBot, posed: Session, refiner: HeldRefiner
) -> None:
    posed.refine()
    (job,) = (job for job in posed.jobs.running if job.title.startswith("Refining"))
    posed.jobs.cancel(job)
    qtbot.waitUntil(lambda: not posed.is_refining)
    posed.refine()
    posed.abandon()
    assert not posed.is_refining
    qtbot.waitUntil(lambda: not posed.jobs.running)
    assert posed.view.refinement is None


def test_a_refinement_that_fails_says_why(
    qtbot: QtBot, posed: Session, refiner: HeldRefiner, messages: list[str]
) -> None:
    refiner.result = UserError("the volume shows nothing of the tool", remedy="Bring it nearer")
    refiner.go_on.set()
    posed.refine()
    qtbot.waitUntil(lambda: not posed.is_refining)
    assert "shows nothing of the tool" in messages[-1]


def test_nothing_is_refined_where_nothing_is_placed(
    session: Session, refiner: HeldRefiner, messages: list[str]
) -> None:
    session.refine()
    assert "Place keypoints or boxes first" in messages[-1]
    session.set_mode("pose")
    session.refine()
    assert not session.is_refining
