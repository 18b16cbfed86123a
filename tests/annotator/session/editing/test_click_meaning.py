"""Every pane says alike what a click would do."""

from annotations.geometry.boxes import Box
from annotator.session import Session
from annotator.session.editing.click_meaning import click_meaning, is_active_locked


def test_navigating_and_an_empty_window_promise_nothing(session: Session) -> None:
    assert click_meaning(session) == ""
    session.close_volume()
    session.set_mode("place")
    assert click_meaning(session) == ""
    assert not is_active_locked(session)


def test_keypoints_are_placed_or_locked(session: Session) -> None:
    session.set_mode("place")
    assert click_meaning(session) == "place k0"
    session.set_locked("k0", True)
    assert click_meaning(session) == "k0 is locked"
    assert is_active_locked(session)
    session.activate(None)
    assert click_meaning(session) == "place —"
    session.set_mode("pose")
    assert click_meaning(session) == "move the tool"


def test_a_box_needs_a_base_and_a_tip_and_is_then_adjusted(boxes_session: Session) -> None:
    session = boxes_session
    session.set_mode("place")
    assert click_meaning(session) == "base of link0"
    session.place((1.0, 2.0, 3.0))
    assert click_meaning(session) == "tip of link0"
    session.place((100.0, 2.0, 3.0))
    assert click_meaning(session) == "base of link1"
    session.type_box("link1", Box((0.0, 0.0, 0.0), (5000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0)))
    assert click_meaning(session) == "adjust link1"
    session.set_locked("link1", True)
    assert click_meaning(session) == "link1 is locked"
