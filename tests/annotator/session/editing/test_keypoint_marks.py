"""What is drawn of each keypoint follows from the document and the view."""

import pytest

from annotations.documents import edits
from annotator.session import Session
from annotator.session.editing.keypoint_marks import keypoint_marks
from annotator.session.viewing.view import Preview


def test_only_keypoints_with_a_position_or_a_preview_are_marked(session: Session) -> None:
    assert keypoint_marks(session.document, session.tool, session.view) == ()
    session.place((100.0, 200.0, 300.0), keypoint="k0")
    session.look(preview=Preview("k3", (1.0, 2.0, 3.0), "dragged"))
    first, second = keypoint_marks(session.document, session.tool, session.view)
    assert (first.name, first.position_um, first.preview) == ("k0", (100.0, 200.0, 300.0), False)
    assert (second.name, second.position_um, second.preview) == ("k3", (1.0, 2.0, 3.0), True)


def test_a_preview_stands_in_for_the_position_in_the_document(session: Session) -> None:
    session.place((100.0, 200.0, 300.0), keypoint="k0")
    session.look(preview=Preview("k0", (1.0, 2.0, 3.0), "dragged"))
    (mark,) = keypoint_marks(session.document, session.tool, session.view)
    assert mark.position_um == (1.0, 2.0, 3.0)
    assert mark.text == "k0"


def test_marks_say_what_a_person_said(session: Session) -> None:
    session.place((100.0, 200.0, 300.0), keypoint="k2")
    session.set_state("k2", "occluded")
    session.set_certainty("k2", "unsure")
    session.activate("k2")
    (mark,) = keypoint_marks(session.document, session.tool, session.view)
    assert (mark.state, mark.unsure, mark.active, mark.text) == ("occluded", True, True, "k2 ?")
    assert session.tool is not None
    assert mark.color == session.tool.link("link1").color


def test_the_ends_of_boxes_are_marked_and_the_first_click_on_its_way(boxes_session: Session) -> None:
    session = boxes_session
    session.place((100.0, 200.0, 300.0))
    (begun,) = keypoint_marks(session.shown_document, session.tool, session.view)
    assert (begun.name, begun.position_um, begun.preview) == ("k0", (100.0, 200.0, 300.0), True)
    session.aim_second_end((600.0, 200.0, 300.0))
    base, tip = keypoint_marks(session.shown_document, session.tool, session.view)
    assert (base.name, tip.name) == ("k0", "k1")
    assert tip.position_um == pytest.approx((600.0, 200.0, 300.0))
    session.place((600.0, 200.0, 300.0))
    session.set_state("link0", "occluded")
    session.set_certainty("link0", "unsure")
    session.set_locked("link0", True)
    base, tip = keypoint_marks(session.shown_document, session.tool, session.view)
    for mark in (base, tip):
        assert (mark.state, mark.unsure, mark.locked, mark.preview) == ("occluded", True, True, False)


def test_without_a_tool_a_keypoint_has_a_color_of_its_own(session: Session) -> None:
    assert session.document is not None
    document = edits.place_keypoint(session.document, "k0", (1.0, 2.0, 3.0), "clicked")
    (mark,) = keypoint_marks(document, None, session.view)
    assert mark.color.startswith("#")
    assert keypoint_marks(None, None, session.view) == ()
