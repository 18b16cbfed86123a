"""The tool is measured in finished annotations, and a new specification is written only when asked for."""

import shutil
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.study import Study, StudyVolume, save_study
from annotations.geometry.tool_library import load_tool
from annotator.session import Session
from annotator.session.agreement.calibrating import ToolCalibration
from annotator.session.options import SessionOptions


def annotate(session: Session, length_um: float) -> None:
    """Click link 0 with a length, and finish the annotation."""
    session.place((100.0, 200.0, 300.0), keypoint="k0")
    session.place((100.0 + length_um, 200.0, 300.0), keypoint="k1")
    session.set_status("done")


def calibration_of(qtbot: QtBot, session: Session) -> ToolCalibration:
    with qtbot.waitSignal(session.calibrating.measured) as measured:
        session.calibrating.measure()
    found = measured.args[0]
    assert isinstance(found, ToolCalibration)
    return found


@pytest.fixture
def study_session(qtbot: QtBot, empty_session: Session, volume_path: Path) -> Session:
    volume = StudyVolume(id="v001", path="v001.npy")
    save_study(Study(title="Pilot", tool="magnetic-forceps", volumes=(volume,)), volume_path.parent)
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.open_path(volume_path.parent)
    return empty_session


def test_a_study_keeps_the_new_specification_in_its_own_folder(
    qtbot: QtBot, study_session: Session, volume_path: Path
) -> None:
    annotate(study_session, 11_234.5)
    found = calibration_of(qtbot, study_session)
    assert found.is_study
    assert found.calibration.documents == 1
    assert found.suggested_name == "magnetic-forceps-calibrated"
    assert found.problem_with(found.suggested_name) == ""
    before = study_session.document
    with qtbot.waitSignal(study_session.message_posted) as said:
        assert study_session.calibrating.keep(found, "ours")
    path = volume_path.parent / "tools" / "ours.toml"
    assert str(path) in said.args[0]
    assert load_tool(path).link("link0").length_um == 11_234.5
    assert load_tool(path).link("link1") == found.tool.link("link1")
    assert study_session.document is before
    assert "ours" in study_session.tools()


def test_outside_a_study_it_goes_to_the_persons_own_tools(
    qtbot: QtBot, session: Session, options: SessionOptions
) -> None:
    annotate(session, 10_500.0)
    found = calibration_of(qtbot, session)
    assert not found.is_study
    assert session.calibrating.keep(found, "ours")
    assert (options.user_tool_folder / "ours.toml").exists()


def test_an_annotation_that_was_opened_itself_counts_with_those_beside_it(
    qtbot: QtBot, session: Session
) -> None:
    annotate(session, 10_500.0)
    assert session.annotation_path is not None
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(session.annotation_path)
    assert calibration_of(qtbot, session).calibration.documents == 1


def test_only_names_that_are_new_are_taken(qtbot: QtBot, session: Session) -> None:
    annotate(session, 10_500.0)
    found = calibration_of(qtbot, session)
    assert "already" in found.problem_with("needle")
    assert "already" in found.problem_with("magnetic-forceps")
    assert "a name holds letters" in found.problem_with("two words")
    assert session.calibrating.keep(found, found.suggested_name)
    again = calibration_of(qtbot, session)
    assert again.suggested_name == "magnetic-forceps-calibrated-2"
    with qtbot.waitSignal(session.error_raised) as raised:
        assert not session.calibrating.keep(again, "magnetic-forceps-calibrated")
    assert "not overwritten" in str(raised.args[0])


def test_without_finished_annotations_there_is_nothing_to_keep(qtbot: QtBot, session: Session) -> None:
    found = calibration_of(qtbot, session)
    assert found.calibration.documents == 0
    assert "no finished annotation" in found.problem_with("ours")
    with qtbot.waitSignal(session.error_raised):
        assert not session.calibrating.keep(found, "ours")


def test_what_cannot_be_read_is_left_out_and_named(qtbot: QtBot, session: Session) -> None:
    annotate(session, 10_500.0)
    assert session.annotation_path is not None
    session.annotation_path.with_name("broken.keypoints.json").write_text("{")
    (skipped,) = calibration_of(qtbot, session).calibration.skipped
    assert "broken.keypoints.json" in str(skipped)


def test_who_may_not_see_the_others_work_yet_measures_only_their_own(
    qtbot: QtBot, empty_session: Session, volume_path: Path
) -> None:
    folder = volume_path.parent
    volumes = tuple(StudyVolume(id=each, path="v001.npy") for each in ("first-7", "second-7"))
    study = Study(
        title="Pilot", tool="magnetic-forceps", annotators=("anna", "bob"), blind=True, volumes=volumes
    )
    save_study(study, folder)
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.open_path(folder)
    annotate(empty_session, 10_500.0)
    for annotator in ("anna", "bob"):
        (folder / "annotations" / annotator).mkdir(exist_ok=True)
        (folder / "annotations" / annotator / "second-7.keypoints.json").write_text("{", encoding="utf-8")
    shutil.copy(folder / "annotations" / "anna" / "first-7.keypoints.json", folder / "annotations" / "bob")
    found = calibration_of(qtbot, empty_session)
    assert found.is_own
    assert found.calibration.documents == 1
    (skipped,) = found.calibration.skipped
    assert "second-7" not in str(skipped)
    assert "Volume 2" in str(skipped)


def test_wrong_tool_files_are_said(qtbot: QtBot, session: Session, options: SessionOptions) -> None:
    options.user_tool_folder.mkdir()
    (options.user_tool_folder / "bad.toml").write_text("name = 1")
    with qtbot.waitSignal(session.error_raised) as raised:
        session.calibrating.measure()
    assert "bad.toml" in str(raised.args[0])


def test_the_last_wish_counts_and_nothing_open_measures_nothing(
    qtbot: QtBot, session: Session, options: SessionOptions
) -> None:
    found: list[ToolCalibration] = []
    session.calibrating.measured.connect(found.append)
    session.calibrating.measure()
    session.calibrating.measure()
    qtbot.waitUntil(lambda: not session.jobs.running)
    assert len(found) == 1
    session.close_volume()
    session.calibrating.measure()
    assert not any(job.title.startswith("Measuring") for job in session.jobs.running)
