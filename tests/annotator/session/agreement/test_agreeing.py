"""The comparison of annotators in the session: who may see it, and what of it is shown."""

import threading
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotations.agreement.comparison import agreement_of
from annotations.documents.files import load_annotation
from annotations.documents.record import changed
from annotations.documents.study import StudyError, ViewingRules, annotation_path, load_study, save_study
from annotations.errors import Cancelled
from annotator.session import Session
from annotator.session.agreement import agreeing as agreeing_module
from annotator.session.jobs import WHEN_SHOWN_MS
from annotator.session.options import SessionOptions
from tests.annotator.compared_study import IDS, WORST, write_compared
from tests.annotator.conftest import open_and_wait


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study that anna, ben and chloe have done."""
    return write_compared(tmp_path / "study")


def compute(qtbot: QtBot, session: Session) -> None:
    with qtbot.waitSignal(session.agreeing.computed, timeout=60_000):
        session.agreeing.compute()


def test_it_is_the_librarys_comparison(qtbot: QtBot, rita: Session, folder: Path) -> None:
    compute(qtbot, rita)

    assert rita.agreeing.result is not None
    assert rita.agreeing.result.methods == agreement_of(folder).methods
    assert rita.agreeing.folder == folder
    assert not rita.agreeing.is_computing
    assert rita.agreeing.computed_at is not None


def test_volumes_lead_to_their_places_in_the_list(qtbot: QtBot, rita: Session) -> None:
    compute(qtbot, rita)

    assert rita.agreeing.result is not None
    worst = max(rita.agreeing.result.methods["keypoints"].volumes, key=lambda volume: volume.ratio_to_median)
    assert worst.volume == WORST
    assert rita.agreeing.index_of(WORST) == IDS.index(WORST)
    assert rita.agreeing.open_volume == IDS[0]
    assert rita.agreeing.volume_label(WORST) == WORST
    assert rita.agreeing.index_of("elsewhere") is None


def test_an_edit_makes_it_stale_and_so_does_its_undo_but_opening_does_not(
    qtbot: QtBot, rita: Session
) -> None:
    compute(qtbot, rita)
    rita.open_item(1)
    qtbot.waitUntil(lambda: rita.current_index == 1 and not rita.jobs.running)
    assert not rita.agreeing.is_stale

    with qtbot.waitSignal(rita.agreeing.changed):
        rita.place((100.0, 110.0, 120.0), keypoint="k0")
    assert rita.agreeing.is_stale
    compute(qtbot, rita)
    assert not rita.agreeing.is_stale
    rita.undo()
    assert rita.agreeing.is_stale


def test_what_is_open_is_saved_before_it_is_compared(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    open_and_wait(qtbot, empty_session, folder)
    empty_session.place((100.0, 110.0, 120.0), keypoint="k0")
    compute(qtbot, empty_session)

    assert not empty_session.unsaved
    assert empty_session.agreeing.result is not None
    path = annotation_path(folder, "anna", IDS[0], "keypoints")
    identities = {each.path: each.sha256 for each in empty_session.agreeing.result.inputs}
    assert identities[path.relative_to(folder).as_posix()] == load_annotation(path)[1]


def test_another_folder_forgets_it(qtbot: QtBot, rita: Session, volume_path: Path) -> None:
    compute(qtbot, rita)
    open_and_wait(qtbot, rita, volume_path)

    assert rita.agreeing.result is None
    assert rita.agreeing.refusal == ""


def test_cancelled_it_leaves_the_last_one(
    qtbot: QtBot, rita: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    compute(qtbot, rita)
    before, begun = rita.agreeing.result, threading.Event()

    def endless(*arguments: object) -> None:
        begun.set()
        cancelled = arguments[-1]
        assert callable(cancelled)
        while not cancelled():
            pass
        raise Cancelled

    monkeypatch.setattr(agreeing_module, "_compared", endless)
    rita.agreeing.compute()
    assert rita.agreeing.is_computing
    qtbot.waitUntil(begun.is_set)
    rita.agreeing.cancel()
    qtbot.waitUntil(lambda: not rita.agreeing.is_computing)

    assert rita.agreeing.result is before


def test_it_begins_when_the_window_has_shown_it(
    qtbot: QtBot, rita: Session, delays_ms: dict[str, int]
) -> None:
    compute(qtbot, rita)
    assert delays_ms["Comparing the annotators"] == WHEN_SHOWN_MS


def test_an_edit_while_it_computes_makes_it_stale(qtbot: QtBot, rita: Session) -> None:
    with qtbot.waitSignal(rita.agreeing.computed, timeout=60_000):
        rita.agreeing.compute()
        rita.place((100.0, 110.0, 120.0), keypoint="k0")

    assert rita.agreeing.is_stale


def test_what_goes_wrong_is_said_and_it_can_be_tried_again(qtbot: QtBot, rita: Session, folder: Path) -> None:
    text = (folder / "study.toml").read_text()
    (folder / "study.toml").write_text("[")
    with qtbot.waitSignal(rita.error_raised) as raised:
        rita.agreeing.compute()
    assert isinstance(raised.args[0], StudyError)
    assert not rita.agreeing.is_computing
    assert rita.agreeing.result is None

    (folder / "study.toml").write_text(text)
    compute(qtbot, rita)
    assert rita.agreeing.result is not None


# Who may see it


def test_an_annotator_with_work_to_do_is_told_so_and_nothing_is_computed(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    annotation_path(folder, "anna", IDS[1], "keypoints").unlink()
    open_and_wait(qtbot, empty_session, folder)
    with qtbot.waitSignal(empty_session.message_posted) as said:
        empty_session.agreeing.compute()

    assert "1 to do by keypoints" in empty_session.agreeing.refusal
    assert said.args == [empty_session.agreeing.refusal]
    assert not empty_session.agreeing.is_computing


def test_an_annotator_whose_work_is_done_sees_it_and_does_not_export_it(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    save_study(changed(load_study(folder), viewing=ViewingRules(reviewers=("rita",))), folder)
    open_and_wait(qtbot, empty_session, folder)
    compute(qtbot, empty_session)

    assert "reviewers" in empty_session.agreeing.export_refusal
    empty_session.agreement_reporting.export(folder / "report", {"json"})
    assert not empty_session.agreement_reporting.is_exporting
    assert not (folder / "report").exists()


def test_by_the_other_method_there_may_be_work_left(
    qtbot: QtBot, empty_session: Session, tmp_path: Path
) -> None:
    folder = write_compared(tmp_path / "both", methods=("keypoints", "boxes"))
    annotation_path(folder, "anna", IDS[2], "boxes").unlink()
    open_and_wait(qtbot, empty_session, folder)
    assert empty_session.agreeing.refusal == ""
    with qtbot.waitSignal(empty_session.error_raised, timeout=60_000) as raised:
        empty_session.agreeing.compute()

    assert "not done by you" in str(raised.args[0])
    assert empty_session.agreeing.result is None


def test_reopening_ones_own_work_puts_the_numbers_away(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    open_and_wait(qtbot, empty_session, folder)
    compute(qtbot, empty_session)
    empty_session.set_status("in_progress")

    assert empty_session.agreeing.result is None
    assert "to do" in empty_session.agreeing.refusal


def test_where_annotators_see_no_others_they_are_not_told_to_finish_first(
    qtbot: QtBot, empty_session: Session, folder: Path
) -> None:
    save_study(changed(load_study(folder), viewing=ViewingRules(others="never")), folder)
    open_and_wait(qtbot, empty_session, folder)
    empty_session.set_status("in_progress")

    assert "its reviewers do" in empty_session.agreeing.refusal


@pytest.mark.parametrize(
    ("person", "rules", "sees"),
    [
        ("anna", ViewingRules(others="never"), False),
        ("anna", ViewingRules(others="never", reviewers=("anna",)), True),
        ("rita", ViewingRules(reviewers=("rita",)), True),
        ("guest", ViewingRules(reviewers=("rita",)), False),
        ("guest", ViewingRules(), True),
    ],
)
def test_the_studys_rules_hold(
    qtbot: QtBot, options: SessionOptions, folder: Path, person: str, rules: ViewingRules, sees: bool
) -> None:
    save_study(changed(load_study(folder), viewing=rules), folder)
    session = Session(replace(options, annotator_name=person))
    open_and_wait(qtbot, session, folder)

    assert (session.agreeing.refusal == "") == sees
    session.shut_down()


def test_with_nothing_open_there_is_nothing_to_compare(empty_session: Session) -> None:
    assert "Open a study" in empty_session.agreeing.refusal


def test_blind_annotators_read_neutral_numbers(qtbot: QtBot, empty_session: Session, tmp_path: Path) -> None:
    folder = write_compared(tmp_path / "blind", blind=True)
    open_and_wait(qtbot, empty_session, folder)
    compute(qtbot, empty_session)

    labels = [empty_session.agreeing.volume_label(each) for each in (*IDS, "elsewhere")]
    assert labels == ["Volume 1", "Volume 2", "Volume 3", "A volume of this study"]


def test_changed_files_of_others_are_noticed_and_ones_own_are_known_otherwise(
    qtbot: QtBot, rita: Session, folder: Path
) -> None:
    compute(qtbot, rita)
    looked: list[bool] = []
    rita.agreeing.look_for_changes(lambda: looked.append(rita.agreeing.has_changed_files))
    qtbot.waitUntil(lambda: looked == [False])
    path = next((folder / "annotations" / "ben").glob("*.json"))
    path.write_bytes(path.read_bytes() + b"\n")
    rita.agreeing.look_for_changes(lambda: looked.append(rita.agreeing.has_changed_files))
    qtbot.waitUntil(lambda: looked == [False, True])
    compute(qtbot, rita)
    assert not rita.agreeing.has_changed_files


def test_beside_loose_volumes_a_volume_leads_to_the_file_of_its_name(
    qtbot: QtBot, options: SessionOptions, folder: Path
) -> None:
    for volume in (folder / "volumes").iterdir():
        volume.rename(folder / volume.name)
    (folder / "study.toml").unlink()
    session = Session(replace(options, annotator_name="rita"))
    open_and_wait(qtbot, session, folder)
    compute(qtbot, session)
    assert session.agreeing.result is not None
    found = [each.volume for each in session.agreeing.result.methods["keypoints"].volumes]
    places = [session.agreeing.index_of(each) for each in found]
    assert None not in places
    names = [session.items[place].volume_path.name for place in places if place is not None]
    assert sorted(names) == [f"{each}.npy" for each in IDS]
    session.others.want()
    qtbot.waitUntil(lambda: len(session.others.shown) == 3)
    session.shut_down()
