"""A document of the other method is derived beside the first one, which stays; no roll is invented."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.files import DocumentError, load_annotation
from annotations.documents.study import Study, StudyVolume, save_study
from annotations.durable_files import SaveError
from annotations.geometry.box_conversion import RollUnknown
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotations.geometry.tool_library import shipped_tools
from annotator.session import Session
from annotator.session.files.deriving import roll_meanings, write_derived
from annotator.session.options import SessionOptions
from tests.annotator.status_line import messages_of

FORCEPS = shipped_tools()["magnetic-forceps"]
# Both joints bent: the second one tells the hinge's sense.
BENT = ToolPose(
    (3000.0, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 30.0), {"theta1": 40.0, "theta2": 25.0}
)
# The second one closed: the hinge's line is known, its sense is not.
SENSELESS = replace(BENT, angles_deg={"theta1": 40.0})
STRAIGHT = replace(BENT, angles_deg={})


def place(session: Session, pose: ToolPose, names: str = "k0 k1 k2 k3 k4 k5") -> None:
    for name, position_um in keypoints_um(pose, FORCEPS).items():
        if name in names.split():
            session.place(position_um, keypoint=name)


def wait_for_method(qtbot: QtBot, session: Session, method: str) -> None:
    qtbot.waitUntil(lambda: session.document is not None and session.document.method == method)


@pytest.fixture
def messages(session: Session) -> list[str]:
    return messages_of(session)


def test_boxes_follow_from_keypoints_and_are_opened(
    qtbot: QtBot, session: Session, volume_path: Path, messages: list[str]
) -> None:
    place(session, BENT)
    session.set_certainty("k3", "unsure")
    original = session.annotation_path
    assert original is not None
    assert session.unsaved
    session.deriving.derive()
    assert messages == [], "it is said of the document that it is about, once that is open"
    wait_for_method(qtbot, session, "boxes")
    document = session.document
    assert document is not None
    assert session.annotation_path == original.with_name("v001.npy.boxes.json")
    assert session.volume is not None
    assert session.volume.path == volume_path
    assert document.derived_from is not None
    assert (document.derived_from.path, document.derived_from.method) == (original.name, "keypoints")
    assert document.derived_from.roll_deg is None
    assert {part.source for part in document.parts} == {"derived"}
    assert document.part("link1").certainty == "unsure"
    for link, box in link_boxes(BENT, FORCEPS).items():
        np.testing.assert_allclose(document.placed_boxes[link].axes, box.axes, atol=1e-9)
    assert not session.unsaved
    assert any("follows from v001.npy.keypoints.json, which stays" in text for text in messages)
    saved, _ = load_annotation(original)
    assert saved.positions_um == keypoints_um(BENT, FORCEPS)


def test_keypoints_follow_from_boxes(qtbot: QtBot, boxes_session: Session) -> None:
    session = boxes_session
    session.set_mode("pose")
    session.pose_tool(BENT)
    session.deriving.derive()
    wait_for_method(qtbot, session, "keypoints")
    assert session.document is not None
    assert dict(session.document.positions_um) == {
        name: pytest.approx(position_um) for name, position_um in keypoints_um(BENT, FORCEPS).items()
    }
    assert session.document.derived_from is not None
    assert session.document.derived_from.method == "boxes"


def test_a_file_that_is_there_is_neither_overwritten_nor_opened(qtbot: QtBot, session: Session) -> None:
    place(session, BENT)
    assert session.annotation_path is not None
    there = session.annotation_path.with_name("v001.npy.boxes.json")
    there.parent.mkdir(parents=True, exist_ok=True)
    there.write_text("somebody's")
    with qtbot.waitSignal(session.error_raised) as raised:
        session.deriving.derive()
    assert isinstance(raised.args[0], DocumentError)
    assert "annotation by boxes already" in str(raised.args[0])
    assert there.read_text() == "somebody's"
    assert session.method == "keypoints"


def test_the_sense_of_the_hinge_is_asked_for(qtbot: QtBot, session: Session) -> None:
    place(session, SENSELESS)
    with qtbot.waitSignal(session.deriving.roll_requested) as asked:
        session.deriving.derive()
    unknown: RollUnknown = asked.args[0]
    assert unknown.link == "link0"
    assert len(unknown.candidates_deg) == 2
    assert session.annotation_path is not None
    assert not session.annotation_path.with_name("v001.npy.boxes.json").exists()
    assert session.document is not None
    one, other = roll_meanings(session.document, FORCEPS, unknown)
    assert sorted((one.angles_deg["theta1"], other.angles_deg["theta1"])) == pytest.approx([-40.0, 40.0])
    np.testing.assert_allclose(one.hinge_axis, np.negative(other.hinge_axis), atol=1e-9)
    chosen = one if one.angles_deg["theta1"] > 0 else other
    assert chosen.roll_deg == pytest.approx(30.0)
    session.deriving.derive(chosen.roll_deg)
    wait_for_method(qtbot, session, "boxes")
    assert session.document.derived_from is not None
    assert session.document.derived_from.roll_deg == chosen.roll_deg
    np.testing.assert_allclose(
        session.document.placed_boxes["link0"].axes, link_boxes(SENSELESS, FORCEPS)["link0"].axes, atol=1e-9
    )


def test_of_a_straight_tool_nothing_is_suggested(qtbot: QtBot, session: Session) -> None:
    place(session, STRAIGHT)
    with qtbot.waitSignal(session.deriving.roll_requested) as asked:
        session.deriving.derive()
    assert asked.args[0].candidates_deg == ()
    assert session.document is not None
    assert roll_meanings(session.document, FORCEPS, asked.args[0]) == ()


def test_nothing_shows_the_roll_of_a_needle(qtbot: QtBot, session: Session) -> None:
    with qtbot.waitSignal(session.volume_changed):
        session.choose_tool("needle")
    session.place((100.0, 200.0, 300.0))
    session.place((1500.0, 200.0, 300.0))
    with qtbot.waitSignal(session.deriving.roll_requested) as asked:
        session.deriving.derive()
    assert (asked.args[0].link, asked.args[0].candidates_deg) == ("needle", ())
    session.deriving.derive(45.0)
    wait_for_method(qtbot, session, "boxes")
    assert session.document is not None
    # From the shaft to the tip it looks along −x.
    assert session.document.placed_boxes["needle"].tip_um == pytest.approx((100.0, 200.0, 300.0))
    assert session.document.placed_boxes["needle"].size_um == pytest.approx((1400.0, 500.0, 500.0))


def test_keypoints_that_end_no_box_are_named(qtbot: QtBot, session: Session, messages: list[str]) -> None:
    place(session, BENT, "k0 k1 k2 k3 k5")
    session.deriving.derive(30.0)
    wait_for_method(qtbot, session, "boxes")
    assert any("without k5" in text for text in messages)
    assert session.document is not None
    assert session.document.part("link2").state == "unplaced"


@pytest.mark.parametrize("names", ["", "k0 k3"])
def test_nothing_is_written_where_nothing_follows(qtbot: QtBot, session: Session, names: str) -> None:
    place(session, BENT, names)
    with qtbot.waitSignal(session.error_raised) as raised:
        session.deriving.derive()
    assert "no boxes follow" in str(raised.args[0])
    assert session.annotation_path is not None
    assert not session.annotation_path.with_name("v001.npy.boxes.json").exists()


def test_what_cannot_be_saved_is_not_derived_from(
    qtbot: QtBot, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    place(session, BENT)

    def fail(*_: object, **__: object) -> None:
        raise SaveError("the disk is full")

    monkeypatch.setattr("annotator.session.documents.document_file.save_annotation", fail)
    with qtbot.waitSignal(session.error_raised):
        session.deriving.derive()
    assert session.method == "keypoints"
    assert session.unsaved
    assert session.annotation_path is not None
    assert not session.annotation_path.exists()


def test_a_derived_document_that_cannot_be_written_leaves_all_as_it_was(
    qtbot: QtBot, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    place(session, BENT)
    assert session.save()

    def fail(*_: object, **__: object) -> None:
        raise SaveError("the disk is full")

    monkeypatch.setattr("annotator.session.files.deriving.save_annotation", fail)
    with qtbot.waitSignal(session.error_raised) as raised:
        session.deriving.derive()
    assert "disk is full" in str(raised.args[0])
    assert session.method == "keypoints"
    assert session.document is not None
    assert len(session.document.positions_um) == 6


@pytest.fixture
def study_session(qtbot: QtBot, options: SessionOptions, volume_path: Path) -> Iterator[Session]:
    """A session in a study that is annotated by keypoints alone."""
    volume = StudyVolume(id="v001", path="v001.npy")
    save_study(Study(title="Pilot", tool="magnetic-forceps", volumes=(volume,)), volume_path.parent)
    session = Session(replace(options, method="boxes"))
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path.parent)
    yield session
    session.shut_down()


def test_a_study_of_one_method_has_no_other(qtbot: QtBot, study_session: Session) -> None:
    assert study_session.method == "keypoints", "the study decides, not the person's last choice"
    place(study_session, BENT)
    with qtbot.waitSignal(study_session.message_posted) as said:
        study_session.deriving.derive()
    assert "annotated by keypoints alone" in said.args[0]
    with qtbot.waitSignal(study_session.message_posted) as said:
        study_session.set_method("boxes")
    assert said.args[0] == "This study is annotated by keypoints"
    assert study_session.method == "keypoints"


def test_the_written_file_is_named_after_the_original(session: Session, tmp_path: Path) -> None:
    place(session, BENT)
    assert session.document is not None
    derived = write_derived(session.document, FORCEPS, tmp_path / "mine.json", "boxes", None)
    assert derived.path == tmp_path / "mine.boxes.json"
    assert derived.left_out == ()
    assert load_annotation(derived.path)[0].method == "boxes"


def test_nothing_is_written_where_the_original_was_moved_from(session: Session, tmp_path: Path) -> None:
    place(session, BENT)
    assert session.document is not None
    with pytest.raises(DocumentError, match="not there any more"):
        write_derived(session.document, FORCEPS, tmp_path / "moved" / "mine.json", "boxes", None)
    assert not (tmp_path / "moved").exists()


def test_nothing_open_derives_nothing(empty_session: Session) -> None:
    empty_session.deriving.derive()
    assert empty_session.document is None
