"""Ends of boxes that the scene proposes: kept by a second click, settled where two looks cross."""

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.volumes import Ray
from annotator.session import Session
from tests.annotator.session.editing.placed_boxes import BASE_UM, TIP_UM, box_of, place_two

SPACING_UM = (15.9, 13.5, 9.4)


def click(qtbot: QtBot, session: Session, index: tuple[int, int, int]) -> None:
    """Click in the scene, from above, at a voxel; and wait until the depth is read."""
    above_um = np.array(index) * SPACING_UM - [0, 0, 5000]
    session.pick_ray(Ray(tuple(above_um), (0.0, 0.0, 1.0)))
    qtbot.waitUntil(lambda: not session.jobs.running)


def test_a_proposal_of_the_scene_takes_the_place_of_what_is_aimed_at(
    qtbot: QtBot, boxes_session: Session
) -> None:
    session = boxes_session
    session.place(BASE_UM)
    session.aim_second_end(TIP_UM)
    session.pick_ray(Ray((25 * 15.9, 40 * 13.5, -5000.0), (0.0, 0.0, 1.0)))
    qtbot.waitUntil(lambda: not session.jobs.running)
    assert session.view.draft is None
    session.aim_second_end(TIP_UM)
    assert session.view.draft is None, "the proposal waits to be kept"
    session.keep_preview()
    assert box_of(session).tip_um[:2] == pytest.approx((25 * 15.9, 40 * 13.5))


def test_the_scene_places_a_box_by_two_proposals(qtbot: QtBot, boxes_session: Session) -> None:
    session = boxes_session
    session.set_mode("place")
    for index, name in (((15, 20, 20), "k0"), ((25, 40, 20), "k1")):
        click(qtbot, session, index)
        assert session.view.preview is not None
        assert session.view.preview.keypoint == name
        session.keep_preview()
        assert session.view.preview is None
    assert box_of(session).base_um[:2] == pytest.approx((15 * 15.9, 20 * 13.5))
    assert box_of(session).tip_um[:2] == pytest.approx((25 * 15.9, 40 * 13.5))


def test_an_end_that_the_scene_proposed_is_kept_on_the_axis_beneath_the_surface(
    qtbot: QtBot, boxes_session: Session
) -> None:
    session = boxes_session
    session.set_mode("place")
    click(qtbot, session, (15, 20, 20))
    assert session.view.preview is not None
    x_um, y_um, z_um = session.view.preview.position_um
    session.keep_preview()
    # The links of the tool are 4 mm high.
    assert session.view.first_end_um == pytest.approx((x_um, y_um, z_um + 2000.0))


def test_a_second_click_from_the_same_angle_keeps_the_base_and_proposes_the_tip(
    qtbot: QtBot, boxes_session: Session, box_messages: list[str]
) -> None:
    session = boxes_session
    session.set_mode("place")
    click(qtbot, session, (15, 20, 20))
    base_um = session.view.preview.position_um  # type: ignore[union-attr]
    click(qtbot, session, (25, 40, 20))
    assert session.view.preview is not None
    assert session.view.preview.keypoint == "k1"
    assert session.view.first_end_um == pytest.approx(np.add(base_um, (0.0, 0.0, 2000.0)))
    assert session.undo_stack.count == 0
    tip_um = session.view.preview.position_um
    session.keep_preview()
    assert box_of(session).tip_um == pytest.approx(np.add(tip_um, (0.0, 0.0, 2000.0)))
    assert not [message for message in box_messages if "Depth not settled" in message]


def test_a_third_click_places_the_box_and_proposes_the_next_base(
    qtbot: QtBot, boxes_session: Session
) -> None:
    session = boxes_session
    session.set_mode("place")
    for index in ((12, 20, 20), (18, 30, 20), (24, 40, 20)):
        click(qtbot, session, index)
    assert box_of(session).tip_um[:2] == pytest.approx((18 * 15.9, 30 * 13.5))
    assert session.undo_stack.count == 1
    assert session.view.active_part == "link1"
    assert session.view.first_end_um is None
    assert session.view.preview is not None
    assert session.view.preview.keypoint == "k2"
    assert session.view.preview.position_um[:2] == pytest.approx((24 * 15.9, 40 * 13.5))


def test_after_the_last_box_a_click_in_the_scene_only_keeps_its_tip(
    qtbot: QtBot, boxes_session: Session, box_messages: list[str]
) -> None:
    session = boxes_session
    session.set_mode("place")
    for _ in range(2):
        place_two(session)
    for index in ((12, 20, 20), (18, 30, 20), (24, 40, 20)):
        click(qtbot, session, index)
    assert box_of(session, "link2").tip_um[:2] == pytest.approx((18 * 15.9, 30 * 13.5))
    assert session.view.preview is None
    assert "roll of link2" in box_messages[-1]


def test_a_click_beside_everything_keeps_nothing(
    qtbot: QtBot, boxes_session: Session, box_messages: list[str]
) -> None:
    session = boxes_session
    session.set_mode("place")
    click(qtbot, session, (15, 20, 20))
    proposed = session.view.preview
    click(qtbot, session, (500, 20, 20))
    assert box_messages[-1].startswith("Nothing above the opacity threshold")
    assert session.view.preview == proposed
    assert session.view.first_end_um is None


def test_a_tip_at_the_base_is_proposed_anew(qtbot: QtBot, boxes_session: Session) -> None:
    session = boxes_session
    session.set_mode("place")
    for index in ((15, 20, 20), (15, 20, 20), (25, 40, 20)):
        click(qtbot, session, index)
    assert session.document is not None
    assert not session.document.placed_boxes
    assert session.view.preview is not None
    assert session.view.preview.keypoint == "k1"
    assert session.view.preview.position_um[:2] == pytest.approx((25 * 15.9, 40 * 13.5))


def test_a_second_click_from_another_angle_settles_the_end_where_the_two_cross(
    qtbot: QtBot, boxes_session: Session
) -> None:
    session = boxes_session
    session.set_mode("place")
    target_um = np.array([25.0, 25.0, 25.0]) * SPACING_UM
    for direction in ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)):
        session.pick_ray(Ray(tuple(target_um - 5000 * np.array(direction)), direction))
    assert session.view.first_end_um == pytest.approx(target_um)
    assert session.view.preview is None


def test_choosing_the_active_link_again_drops_nothing_that_is_proposed(boxes_session: Session) -> None:
    session = boxes_session
    session.set_mode("place")
    session.activate("link0")
    session.pick_ray(Ray((318.0, 405.0, -100.0), (0.0, 0.0, 1.0)))
    assert session.view.preview is not None
    session.activate("link0", jump=True)
    assert session.view.preview is not None
    session.activate("link1")
    assert session.view.preview is None
