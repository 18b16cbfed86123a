"""What checkpoints are worth, as the session computes it, follows it and walks through it."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.files import DocumentFile
from annotations.documents.record import changed
from annotations.documents.study import ViewingRules
from annotations.errors import UserError
from annotations.prediction.verdicts.verdict_file import verdict_path
from annotator.session import Session
from annotator.session.jobs import WHEN_SHOWN_MS
from annotator.session.options import SessionOptions
from tests.annotator.conftest import open_and_wait
from tests.annotator.reviewed_study import (
    FAR,
    FIRST,
    IDS,
    LACKING,
    NEAR,
    PEOPLE,
    SECOND,
    annotation_of,
    compute,
    predict,
    review,
    write_reviewed,
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The study that was predicted."""
    return write_reviewed(tmp_path / "study")


def opened(qtbot: QtBot, session: Session, volume: str) -> None:
    qtbot.waitUntil(lambda: session.reviewing.open_volume == volume and not session.jobs.running)


def test_without_a_study_or_a_checkpoint_it_says_what_is_missing(
    qtbot: QtBot, session: Session, rita: Session
) -> None:
    assert session.reviewing.refusal.startswith("Open a study")
    assert not rita.reviewing.refusal
    with qtbot.waitSignal(rita.message_posted) as said:
        rita.reviewing.compute()
    assert said.args == ["Load a checkpoint first"]
    assert rita.reviewing.table is None


def test_every_checkpoint_that_is_loaded_is_reviewed(qtbot: QtBot, rita: Session) -> None:
    review(qtbot, rita, FIRST, SECOND)

    found = rita.reviewing.review
    assert found is not None
    assert [table.checkpoint.name for table in found.material.tables if table.checkpoint] == [
        "first",
        "second",
    ]
    assert rita.reviewing.table is found.material.tables[1]
    rita.predicting.choose(FIRST.sha256)
    assert rita.reviewing.table is found.material.tables[0]
    assert found.is_paired


def test_it_begins_when_the_window_has_shown_it(
    qtbot: QtBot, rita: Session, delays_ms: dict[str, int]
) -> None:
    review(qtbot, rita, FIRST)
    assert delays_ms["Computing the errors"] == WHEN_SHOWN_MS


def test_two_checkpoints_of_one_name_stand_side_by_side_and_keep_their_verdicts(
    qtbot: QtBot, rita: Session, folder: Path
) -> None:
    later = replace(SECOND, description=FIRST.description)
    for each in IDS:
        predict(folder, later, each, share=0.5)

    review(qtbot, rita, later, FIRST)

    found = rita.reviewing.review
    assert found is not None
    assert found.is_paired
    assert [len(table.rows) for table in found.material.tables] == [3, 3]
    assert len(set(found.material.names)) == 2
    volume = rita.reviewing.open_volume
    assert volume is not None
    for each, verdict in ((FIRST, "model_wrong"), (later, "annotation_wrong")):
        rita.predicting.choose(each.sha256)
        rita.judging.judge(verdict)
    compute(qtbot, rita)
    for each, words in ((FIRST, "model"), (later, "annotation")):
        rita.predicting.choose(each.sha256)
        assert rita.judging.judgement(volume).words == words


def test_whoever_may_see_the_errors_exports_them(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path
) -> None:
    anna = Session(replace(options, annotator_name="anna"))
    folder = write_reviewed(tmp_path / "own", viewing=ViewingRules(reviewers=("rita",)))
    open_and_wait(qtbot, anna, folder)
    review(qtbot, anna)

    assert "reviewers" in anna.agreeing.export_refusal
    assert anna.reporting.refusal == ""
    with qtbot.waitSignal(anna.reporting.exported, timeout=60_000):
        anna.reporting.export(tmp_path / "report", {"json"})
    anna.shut_down()


def test_where_volumes_have_neutral_numbers_a_reviewer_exports_the_errors(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path
) -> None:
    anna = Session(replace(options, annotator_name="anna"))
    open_and_wait(qtbot, anna, write_reviewed(tmp_path / "own", blind=True))
    review(qtbot, anna)

    assert anna.reviewing.table is not None
    assert "a reviewer of the study" in anna.reporting.refusal
    anna.shut_down()


def test_the_walk_goes_from_the_worst_to_the_best(qtbot: QtBot, rita: Session) -> None:
    review(qtbot, rita)
    assert rita.reviewing.order == (FAR, LACKING, NEAR)
    assert rita.reviewing.open_volume == "v001"
    messages: list[str] = []
    rita.message_posted.connect(messages.append)

    rita.reviewing.step(1)
    opened(qtbot, rita, NEAR)
    assert "prediction" in rita.view.layers
    rita.reviewing.step(1)
    assert messages[-1] == "This is the last volume of the list of errors"
    rita.reviewing.step(-1)
    # The second press goes on from where the first one leads.
    rita.reviewing.step(-1)
    opened(qtbot, rita, FAR)
    rita.reviewing.step(-1)
    assert messages[-1] == "This is the first volume of the list of errors"


def test_a_list_that_is_shown_says_in_which_order(qtbot: QtBot, rita: Session) -> None:
    review(qtbot, rita)
    rita.reviewing.set_order((NEAR, FAR))

    rita.reviewing.step(1)

    opened(qtbot, rita, NEAR)
    rita.reviewing.set_order(())
    with qtbot.waitSignal(rita.message_posted) as said:
        rita.reviewing.step(1)
    assert said.args[0].startswith("There are no errors to walk through")


def test_the_slices_go_to_the_keypoint_furthest_off_where_that_is_wanted(qtbot: QtBot, rita: Session) -> None:
    review(qtbot, rita)
    middle_um = rita.view.crosshair_um
    rita.reviewing.open("v001")
    assert rita.view.crosshair_um == middle_um

    rita.reviewing.go_to_worst(True)
    current = rita.reviewing.current
    assert current is not None
    assert rita.view.crosshair_um == pytest.approx(current.predictions["v001"].positions_um["k5"])
    rita.reviewing.open(FAR)
    opened(qtbot, rita, FAR)
    qtbot.waitUntil(
        lambda: rita.view.crosshair_um == pytest.approx(current.predictions[FAR].positions_um["k5"])
    )


def test_a_prediction_that_was_written_makes_it_old_until_it_is_computed_again(
    qtbot: QtBot, rita: Session, folder: Path
) -> None:
    review(qtbot, rita)
    predict(folder, FIRST, NEAR, share=40.0)

    rita.predicting.predicted.emit()
    assert rita.reviewing.is_stale
    assert rita.reviewing.order == (FAR, LACKING, NEAR)
    compute(qtbot, rita)

    assert not rita.reviewing.is_stale
    assert rita.reviewing.order == (NEAR, FAR, LACKING)


def test_whoever_looks_sees_it_follow(qtbot: QtBot, rita: Session, folder: Path) -> None:
    review(qtbot, rita)
    before = rita.reviewing.review
    predict(folder, FIRST, NEAR, share=40.0)
    rita.predicting.predicted.emit()
    qtbot.wait(1000)
    assert rita.reviewing.review is before

    with qtbot.waitSignal(rita.reviewing.computed, timeout=60_000):
        rita.reviewing.follow(True)

    assert rita.reviewing.order == (NEAR, FAR, LACKING)


def test_what_others_change_is_noticed_by_a_look(qtbot: QtBot, rita: Session, folder: Path) -> None:
    review(qtbot, rita)
    rita.reviewing.follow(True)
    with qtbot.waitSignal(rita.jobs.job_changed):
        rita.reviewing.look_for_changes()
    qtbot.waitUntil(lambda: not rita.jobs.running)
    assert not rita.reviewing.is_stale
    predict(folder, FIRST, NEAR, share=40.0)

    with qtbot.waitSignal(rita.reviewing.computed, timeout=60_000):
        rita.reviewing.look_for_changes()

    assert rita.reviewing.order == (NEAR, FAR, LACKING)


def test_saving_an_edit_of_ones_own_is_followed(qtbot: QtBot, options: SessionOptions, folder: Path) -> None:
    anna = Session(options)
    open_and_wait(qtbot, anna, folder)
    review(qtbot, anna)
    anna.reviewing.follow(True)
    before = anna.reviewing.row_of("v001")
    assert before is not None
    position_um = anna.shown_anchor_um("k0")
    assert position_um is not None
    anna.type_position("k0", (position_um[0] + 500.0, *position_um[1:]))
    assert not anna.reviewing.is_stale

    with qtbot.waitSignal(anna.reviewing.computed, timeout=60_000):
        anna.save()

    after = anna.reviewing.row_of("v001")
    assert after is not None
    assert after.keypoints_um["k0"] > before.keypoints_um["k0"] + 100.0
    anna.shut_down()


class Reads(list[Path]):
    """Which documents are read while it is watched."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        super().__init__()
        read = DocumentFile.read

        def noted(file: DocumentFile[Any], path: Path) -> bytes:
            self.append(path)
            return read(file, path)

        monkeypatch.setattr(DocumentFile, "read", noted)

    def of(self, kind: str) -> Counter[Path]:
        """Return how often each was read of the volumes that are not open: that one is drawn besides."""
        return Counter(path for path in self if kind in path.parts and "v001" not in path.name)


def test_annotations_are_read_as_often_for_several_checkpoints_as_for_one(
    qtbot: QtBot, rita: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    reads = Reads(monkeypatch)
    review(qtbot, rita)
    once = reads.of("annotations")
    rita.predicting.load(SECOND)
    reads.clear()

    compute(qtbot, rita)

    assert len(once) == len(IDS[1:]) * len(PEOPLE)
    assert reads.of("annotations") == once
    assert set(reads.of("predictions").values()) == {1}


def test_after_an_edit_of_ones_own_no_other_volume_is_read_again(
    qtbot: QtBot, options: SessionOptions, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    anna = Session(options)
    open_and_wait(qtbot, anna, folder)
    review(qtbot, anna, FIRST, SECOND)
    anna.reviewing.follow(True)
    before = {volume: anna.reviewing.row_of(volume) for volume in IDS}
    position_um = anna.shown_anchor_um("k0")
    assert position_um is not None
    anna.type_position("k0", (position_um[0] + 500.0, *position_um[1:]))
    reads = Reads(monkeypatch)

    with qtbot.waitSignal(anna.reviewing.computed, timeout=60_000):
        anna.save()

    assert not {path for path in reads if "v001" not in path.name and "verdicts" not in path.parts}
    assert anna.reviewing.row_of("v001") != before["v001"]
    assert [anna.reviewing.row_of(volume) for volume in IDS[1:]] == [before[volume] for volume in IDS[1:]]
    computed = anna.reviewing.review
    compute(qtbot, anna)
    assert anna.reviewing.review is not computed
    assert computed is not None
    assert anna.reviewing.table is not None
    assert anna.reviewing.table.rows == computed.material.tables[1].rows
    anna.reviewing.look_for_changes()
    qtbot.waitUntil(lambda: not anna.jobs.running)
    assert not anna.reviewing.is_stale
    anna.shut_down()


def test_a_volume_of_which_all_was_computed_before_is_not_followed_alone(
    qtbot: QtBot, rita: Session, folder: Path
) -> None:
    review(qtbot, rita)
    found, path = rita.reviewing.review, annotation_of(folder, "v001")
    assert found is not None
    spoken = found.read.truths.by_volume["v001"].annotation
    keypoints = tuple(changed(each, source="synthesized") for each in spoken.keypoints)
    truths = found.read.truths.with_annotation("v001", changed(spoken, keypoints=keypoints))

    assert found.is_spoken_by("v001", spoken, path)
    # Once a person has placed something, what was synthesised speaks for no other volume of the study.
    assert not replace(found, read=replace(found.read, truths=truths)).is_spoken_by("v001", spoken, path)


def test_verdicts_that_cannot_be_read_keep_no_errors_from_being_shown(
    qtbot: QtBot, rita: Session, folder: Path
) -> None:
    errors: list[UserError] = []
    rita.error_raised.connect(errors.append)
    path = verdict_path(folder, "first", FIRST.sha256, "rita")
    path.parent.mkdir(parents=True)
    path.write_bytes(b"half a fi")

    review(qtbot, rita)

    assert rita.reviewing.table is not None
    assert rita.reviewing.review is not None
    [remark] = rita.reviewing.review.material.remarks
    assert str(path) in remark
    assert "move it away" in remark
    assert not errors
    rita.judging.judge("model_wrong")
    assert path.read_bytes() == b"half a fi"
    assert "not written over" in errors[0].problem


def test_computing_can_be_cancelled(qtbot: QtBot, rita: Session) -> None:
    review(qtbot, rita)
    before = rita.reviewing.review
    rita.reviewing.compute()
    assert rita.reviewing.is_computing

    rita.reviewing.cancel()

    qtbot.waitUntil(lambda: not rita.reviewing.is_computing)
    assert rita.reviewing.review is before
    assert rita.reviewing.is_stale


def test_who_is_not_done_may_not_see_what_others_found(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path
) -> None:
    folder = write_reviewed(tmp_path / "own")
    (folder / "annotations" / "anna" / "v002.keypoints.json").unlink()
    anna = Session(options)
    open_and_wait(qtbot, anna, folder)
    anna.predicting.load(FIRST)

    assert "once your own work in this study is done" in anna.reviewing.refusal
    anna.reviewing.follow(True)
    with qtbot.waitSignal(anna.message_posted):
        anna.reviewing.compute()
    assert not anna.reviewing.is_computing
    assert anna.reviewing.table is None
    anna.shut_down()


def test_where_annotators_see_nobodys_work_they_see_no_errors(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path
) -> None:
    rules = ViewingRules(others="never", reviewers=("rita",))
    anna = Session(options)
    open_and_wait(qtbot, anna, write_reviewed(tmp_path / "own", viewing=rules))

    assert "its reviewers do" in anna.reviewing.refusal
    anna.shut_down()


def test_in_blind_work_volumes_go_by_their_numbers(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path
) -> None:
    anna = Session(options)
    open_and_wait(qtbot, anna, write_reviewed(tmp_path / "own", blind=True))
    review(qtbot, anna)

    labels = {anna.reviewing.volume_label(volume) for volume in anna.reviewing.order}

    assert labels == {f"Volume {number}" for number in range(1, len(IDS) + 1)}
    anna.shut_down()


def test_another_study_puts_the_errors_away(qtbot: QtBot, rita: Session, tmp_path: Path) -> None:
    review(qtbot, rita)

    open_and_wait(qtbot, rita, write_reviewed(tmp_path / "other"))

    assert rita.reviewing.review is None
    assert rita.judging.lists == {}


def test_where_nobody_works_blind_predictions_and_errors_are_shown_at_once(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path
) -> None:
    folder = write_reviewed(tmp_path / "own", viewing=ViewingRules(others="always"))
    annotation_of(folder, "v001").unlink()
    anna = Session(options)
    open_and_wait(qtbot, anna, folder)
    assert anna.current_index == 0

    review(qtbot, anna, whose="ben")
    anna.look(layers=anna.view.layers | {"prediction"})
    qtbot.waitUntil(lambda: anna.predicting.shown is not None)

    assert len(anna.reviewing.order) == len(IDS)
    # It is written down, as any other look is: the report on agreement leaves such work out.
    assert ("predictions", "in_progress") in {(each.shown, each.status) for each in anna.viewings}
    anna.shut_down()
