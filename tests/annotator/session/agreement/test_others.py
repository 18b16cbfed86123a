"""The others' annotations: there where they are wanted and allowed, and nowhere else."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.record import changed
from annotations.documents.study import CONSENSUS, ViewingRules, annotation_path, load_study, save_study
from annotator.session import Session
from annotator.session.agreement import others as others_module
from annotator.session.options import SessionOptions
from tests.annotator.compared_study import IDS, POSE, TOOL, annotate, position_um, write_compared
from tests.annotator.conftest import open_and_wait, write_volume

ALL = ("anna", "ben", "chloe")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study that anna, ben and chloe have done."""
    return write_compared(tmp_path / "study", methods=("keypoints", "boxes"))


def want(qtbot: QtBot, session: Session) -> None:
    session.others.want()
    qtbot.waitUntil(lambda: not session.jobs.running)


def test_nothing_is_read_before_somebody_asks(rita: Session) -> None:
    assert not rita.others.is_wanted
    assert rita.others.shown == ()


def test_each_one_comes_with_what_they_placed_in_the_order_of_the_study(qtbot: QtBot, rita: Session) -> None:
    want(qtbot, rita)

    assert [(each.annotator, each.number, each.initials) for each in rita.others.shown] == [
        ("anna", 0, "A"),
        ("ben", 1, "B"),
        ("chloe", 2, "C"),
    ]
    assert rita.others.shown[1].positions_um["k3"] == position_um(ALL, "ben", IDS[0], "k3")
    assert rita.others.drawn == rita.others.shown


def test_boxes_come_with_their_ends(qtbot: QtBot, rita: Session) -> None:
    rita.set_method("boxes")
    qtbot.waitUntil(lambda: rita.document is not None and rita.document.method == "boxes")
    want(qtbot, rita)

    (anna, _, _) = rita.others.shown
    assert set(anna.boxes) == {link.name for link in TOOL.links}
    assert anna.positions_um["k0"] == pytest.approx(position_um(ALL, "anna", IDS[0], "k0"))


def test_ones_own_is_not_among_the_others(qtbot: QtBot, empty_session: Session, folder: Path) -> None:
    open_and_wait(qtbot, empty_session, folder)
    want(qtbot, empty_session)

    assert [each.annotator for each in empty_session.others.shown] == ["ben", "chloe"]
    lines = empty_session.others.differences()
    assert {line.number for line in lines} == {0, 1, 2}
    assert len(lines) == 3 * len(TOOL.keypoint_names)


def test_with_one_other_left_the_lines_lead_to_ones_own(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    open_and_wait(qtbot, empty_session, folder)
    want(qtbot, empty_session)
    empty_session.others.set_visible("chloe", False)

    assert [each.annotator for each in empty_session.others.drawn] == ["ben"]
    assert len(empty_session.others.shown) == 2
    assert empty_session.document is not None
    own_um = empty_session.document.positions_um
    assert {line.reference_um for line in empty_session.others.differences()} == set(own_um.values())


def test_the_lines_follow_a_drag(qtbot: QtBot, empty_session: Session, folder: Path) -> None:
    open_and_wait(qtbot, empty_session, folder)
    want(qtbot, empty_session)
    empty_session.others.set_visible("chloe", False)
    empty_session.begin_preview("k0", POSE.position_um, "dragged")

    assert POSE.position_um in {line.reference_um for line in empty_session.others.differences()}


def test_who_was_switched_off_stays_so_in_the_next_volume(qtbot: QtBot, rita: Session) -> None:
    want(qtbot, rita)
    rita.others.set_visible("ben", False)
    rita.open_item(1)
    qtbot.waitUntil(lambda: rita.current_index == 1 and not rita.jobs.running)

    assert [each.annotator for each in rita.others.drawn] == ["anna", "chloe"]
    assert rita.others.shown[0].positions_um["k0"] == position_um(ALL, "anna", IDS[1], "k0")


def test_they_vanish_as_another_volume_opens(qtbot: QtBot, rita: Session) -> None:
    want(qtbot, rita)
    seen = []
    rita.volume_changed.connect(lambda: seen.append(rita.others.shown))
    rita.open_item(1)
    qtbot.waitUntil(lambda: rita.current_index == 1)
    assert seen[0] == ()

    rita.close_volume()
    assert rita.others.shown == ()


def test_without_the_wish_they_are_put_away(qtbot: QtBot, rita: Session) -> None:
    want(qtbot, rita)
    with qtbot.waitSignal(rita.others.changed):
        rita.toggle_layer("others")

    assert rita.others.shown == ()


def test_before_ones_own_is_done_nothing_is_read_and_it_is_said_why(
    qtbot: QtBot, empty_session: Session, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    annotation_path(folder, "anna", IDS[0], "boxes").unlink()
    open_and_wait(qtbot, empty_session, folder)
    monkeypatch.setattr(others_module, "_read", lambda *_: pytest.fail("the others' files were read"))
    with qtbot.waitSignal(empty_session.message_posted) as said:
        want(qtbot, empty_session)

    assert empty_session.others.shown == ()
    assert "not done yet" in empty_session.others.reason
    assert said.args == [empty_session.others.reason]
    assert empty_session.viewings == ()


def test_when_ones_own_is_done_they_come_and_that_is_written_down(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_compared(tmp_path / "work")
    path = annotation_path(folder, "anna", IDS[0], "keypoints")
    path.unlink()
    open_and_wait(qtbot, empty_session, folder)
    want(qtbot, empty_session)
    assert empty_session.others.shown == ()

    empty_session.place((100.0, 110.0, 120.0))
    empty_session.set_status("done")
    qtbot.waitUntil(lambda: len(empty_session.others.shown) == 2)

    (viewing,) = load_annotation(path)[0].viewings
    assert (viewing.shown, viewing.status) == ("annotations", "done")

    empty_session.undo()
    assert empty_session.others.shown == ()


def test_looking_anyway_shows_them_and_is_written_down_first(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_compared(tmp_path / "work", viewing=ViewingRules(may_look=True))
    path = annotation_path(folder, "anna", IDS[0], "keypoints")
    path.unlink()
    open_and_wait(qtbot, empty_session, folder)
    want(qtbot, empty_session)
    assert empty_session.seeing.look_anyway()
    qtbot.waitUntil(lambda: len(empty_session.others.shown) == 2)

    assert [viewing.status for viewing in load_annotation(path)[0].viewings] == ["in_progress"]


def test_where_nobody_sees_the_others_the_rules_hold_for_what_is_done(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    save_study(changed(load_study(folder), viewing=ViewingRules(others="never")), folder)
    open_and_wait(qtbot, empty_session, folder)
    want(qtbot, empty_session)

    assert empty_session.others.shown == ()
    assert "neither each other" in empty_session.others.reason


def test_what_cannot_be_written_down_is_not_shown(
    qtbot: QtBot, empty_session: Session, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_and_wait(qtbot, empty_session, folder)
    monkeypatch.setattr(empty_session.seeing, "note_shown", lambda _: False)
    want(qtbot, empty_session)

    assert empty_session.others.shown == ()


def test_beside_loose_volumes_the_folders_of_others_are_found(
    qtbot: QtBot, empty_session: Session, options: SessionOptions, tmp_path: Path
) -> None:
    loose = tmp_path / "loose"
    loose.mkdir()
    path = write_volume(loose / "v001.npy")
    bens = Session(replace(options, annotator_name="ben"))
    open_and_wait(qtbot, bens, path)
    bens.place((100.0, 110.0, 120.0), keypoint="k0")
    assert bens.save()
    bens.shut_down()
    open_and_wait(qtbot, empty_session, path)
    want(qtbot, empty_session)

    (ben,) = empty_session.others.shown
    assert (ben.annotator, dict(ben.positions_um)) == ("ben", {"k0": (100.0, 110.0, 120.0)})
    assert empty_session.viewings == ()


def test_where_nobody_else_was_it_is_said(qtbot: QtBot, session: Session) -> None:
    want(qtbot, session)

    assert session.others.shown == ()
    assert session.others.reason == "Nobody else has annotated this volume by keypoints"


def test_a_file_that_cannot_be_read_leaves_its_author_out(qtbot: QtBot, rita: Session, folder: Path) -> None:
    annotation_path(folder, "ben", IDS[0], "keypoints").write_text("{")
    want(qtbot, rita)

    assert [(each.annotator, each.number) for each in rita.others.shown] == [("anna", 0), ("chloe", 2)]


def test_after_a_comparison_the_files_are_read_again(qtbot: QtBot, rita: Session, folder: Path) -> None:
    want(qtbot, rita)
    annotate(folder, (*ALL, "dora"), "dora", IDS[0])
    with qtbot.waitSignal(rita.agreeing.computed, timeout=60_000):
        rita.agreeing.compute()
    qtbot.waitUntil(lambda: len(rita.others.shown) == 4)

    assert rita.others.shown[3].annotator == "dora"


def test_a_truth_that_nobody_placed_is_left_out_and_changes_nobodys_look(
    qtbot: QtBot, rita: Session, folder: Path
) -> None:
    own, _ = load_annotation(annotation_path(folder, "anna", IDS[0], "keypoints"))
    parts = tuple(changed(part, source="synthesized") for part in own.keypoints)
    for name in ("aaron", CONSENSUS):
        path = annotation_path(folder, name, IDS[0], "keypoints")
        path.parent.mkdir(parents=True, exist_ok=True)
        source = {} if name == CONSENSUS else {"keypoints": parts}
        save_annotation(changed(own, annotator=name, **source), path, expected="")
    want(qtbot, rita)

    assert [(each.annotator, each.number, each.initials) for each in rita.others.shown][:3] == [
        ("anna", 0, "A"),
        ("ben", 1, "B"),
        ("chloe", 2, "C"),
    ]
    assert [each.annotator for each in rita.others.shown][3:] == [CONSENSUS]


def test_without_points_of_ones_own_the_others_are_named_and_looked_at(qtbot: QtBot, rita: Session) -> None:
    assert rita.shown_anchor_um("k3") is None
    want(qtbot, rita)

    assert "k3" in rita.others.unnamed
    mean_um = np.mean([position_um(ALL, person, IDS[0], "k3") for person in ALL], axis=0)
    assert rita.shown_anchor_um("k3") == pytest.approx(tuple(mean_um))
    worst = rita.others.worst()
    assert worst is not None
    rita.activate(worst, jump=True)
    assert rita.view.crosshair_um == pytest.approx(rita.others.mean_um(worst), abs=20)
