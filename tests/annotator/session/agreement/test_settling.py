"""The consensus of a study: proposed, settled, undone; the annotators' own files stay as they are."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import Annotation
from annotations.documents.files import load_annotation
from annotations.documents.recovery import find_recoveries
from annotations.documents.study import CONSENSUS, ViewingRules, annotation_path
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.conftest import open_and_wait
from tests.annotator.settled_study import (
    IDS,
    LATE_IMPORTS_MS,
    PEOPLE,
    contents,
    move,
    position_um,
    write_annotation,
    write_settled_study,
)

Open = Callable[..., Session]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_settled_study(tmp_path / "study")


@pytest.fixture
def opened(qtbot: QtBot, options: SessionOptions) -> Iterator[Open]:
    """Open a study as somebody, by keypoints or boxes."""
    sessions: list[Session] = []

    def open_as(folder: Path, person: str = "rita", **changes: object) -> Session:
        session = Session(replace(options, annotator_name=person, **changes))  # type: ignore[arg-type]
        sessions.append(session)
        open_and_wait(qtbot, session, folder)
        return session

    yield open_as
    for session in sessions:
        session.shut_down()


def settle(qtbot: QtBot, session: Session, volume_id: str = "v001") -> Annotation:
    session.settling.settle(volume_id)
    qtbot.waitUntil(lambda: session.settling.is_settling and session.settling.consensus is not None)
    qtbot.waitUntil(lambda: not session.jobs.running)
    return document_of(session)


def document_of(session: Session) -> Annotation:
    assert session.document is not None
    return session.document


def volume_of(session: Session) -> str | None:
    return None if session.current_index is None else session.items[session.current_index].volume_id


def triage(qtbot: QtBot, session: Session) -> list[str]:
    session.settling.triage()
    qtbot.waitUntil(lambda: not session.settling.is_triaging, timeout=LATE_IMPORTS_MS)
    return [entry.volume for entry in session.settling.entries]


def test_a_new_consensus_is_proposed_with_what_it_is_made_from(
    qtbot: QtBot, opened: Open, folder: Path
) -> None:
    session = opened(folder)
    before = contents(folder)
    document = settle(qtbot, session)
    assert session.annotation_path == annotation_path(folder, CONSENSUS, "v001", "keypoints")
    assert (document.annotator, {part.source for part in document.parts}) == (CONSENSUS, {"consensus"})
    assert [each.annotator for each in document.consensus_of] == list(PEOPLE)
    k2 = session.settling.part("k2")
    assert k2 is not None
    assert (k2.used, k2.set_aside) == (("anna", "ben"), ("carl",))
    assert document.positions_um["k2"][1] == pytest.approx(303.0)
    assert set(session.settling.opinions_on("k2")) == set(PEOPLE)
    assert session.others.is_wanted
    assert [other.annotator for other in session.others.shown] == list(PEOPLE)
    assert session.save()
    assert load_annotation(annotation_path(folder, CONSENSUS, "v001", "keypoints"))[0].consensus_of
    assert contents(folder) == before


def test_boxes_say_whose_is_turned(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder, method="boxes")
    document = settle(qtbot, session)
    assert {part.source for part in document.boxes} == {"consensus"}
    turned = {name: session.settling.part(name) for name in ("link0", "link1")}
    assert {name: part.turned for name, part in turned.items() if part} == {"link0": (), "link1": ("ben",)}
    session.settling.adopt("link1", "anna")
    assert document_of(session).part("link1").adopted_from == "anna"
    assert session.shown_positions_um().keys() == {f"k{number}" for number in range(6)}


def test_everything_is_undone_and_done_again_exactly(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    before = contents(folder)
    settle(qtbot, session)
    stack = session.undo_stack
    session.settling.adopt("k1", "ben")
    assert document_of(session).part("k1").anchor_um == position_um(1, "ben")
    session.place((300.0, 200.0, 100.0), "dragged", "k2")
    session.settling.adopt("k3", "carl")
    session.set_status("done")
    documents = [document_of(session)]
    while stack.can_undo:
        stack.undo()
        documents.append(document_of(session))
    assert all(part.anchor_um is None for part in documents[-1].parts)
    assert not documents[-1].consensus_of
    for expected in documents[-2::-1]:
        stack.redo()
        assert document_of(session) == expected
    sources = {part.name: (part.source, part.adopted_from) for part in document_of(session).parts}
    assert (sources["k1"], sources["k2"]) == (("adopted", "ben"), ("dragged", None))
    assert session.save()
    assert contents(folder) == before


def test_to_propose_again_leaves_what_the_reviewer_decided(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    settle(qtbot, session)
    session.place((300.0, 200.0, 100.0), "dragged", "k0")
    session.settling.adopt("k1", "ben")
    assert not session.settling.is_stale
    for name in ("k0", "k1", "k5"):
        move(folder, "ben", "v001", name, (0.0, 3.0, 0.0))
    count = session.undo_stack.count
    with qtbot.waitSignal(session.document_changed):
        session.settling.propose()
    document = document_of(session)
    assert session.undo_stack.count == count + 1
    assert document.positions_um["k0"] == (300.0, 200.0, 100.0)
    assert document.positions_um["k1"] == position_um(1, "ben")
    assert document.positions_um["k5"][1] == pytest.approx((300.0 + 309.0 + 312.0) / 3, abs=0.5)


def test_an_annotation_that_changed_since_makes_the_consensus_stale(
    qtbot: QtBot, opened: Open, folder: Path
) -> None:
    session = opened(folder)
    settle(qtbot, session)
    assert session.save()
    move(folder, "ben", "v001", "k5", (0.0, 3.0, 0.0))
    settle(qtbot, session, "v002")
    proposed = settle(qtbot, session, "v001")
    assert session.settling.changed_since == ("ben",)
    # Opening says so, and changes nothing.
    assert not session.unsaved
    with qtbot.waitSignal(session.document_changed):
        session.settling.propose()
    assert not session.settling.is_stale
    assert document_of(session).consensus_of != proposed.consensus_of


def test_to_propose_what_is_there_already_is_no_edit(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    settle(qtbot, session)
    count = session.undo_stack.count
    with qtbot.waitSignal(session.message_posted, check_params_cb=lambda text: "already" in text):
        session.settling.propose()
    assert session.undo_stack.count == count


def test_walking_through_the_list_proposes_nothing_by_itself(
    qtbot: QtBot, opened: Open, folder: Path
) -> None:
    session = opened(folder)
    settle(qtbot, session)
    session.next_volume()
    qtbot.waitUntil(lambda: volume_of(session) == "v002" and session.settling.consensus is not None)
    assert not document_of(session).consensus_of
    assert not session.unsaved
    with qtbot.waitSignal(session.document_changed):
        session.settling.propose()
    assert document_of(session).consensus_of


def test_where_nobody_placed_anything_nothing_is_proposed(qtbot: QtBot, opened: Open, tmp_path: Path) -> None:
    session = opened(write_settled_study(tmp_path / "study", without=PEOPLE))
    document = settle(qtbot, session)
    assert not document.consensus_of
    assert session.settling.opinions_on("k0") == {}


def test_a_reviewer_leaves_for_the_own_list_at_the_same_volume(
    qtbot: QtBot, opened: Open, folder: Path
) -> None:
    session = opened(folder)
    settle(qtbot, session, "v002")
    assert session.title == "Pilot: consensus"
    session.settling.leave()
    qtbot.waitUntil(lambda: session.annotator_name == "rita" and session.volume is not None)
    assert (volume_of(session), session.title) == ("v002", "Pilot: for review")
    assert session.settling.consensus is None


def test_a_file_of_the_consensus_leads_a_reviewer_to_its_list(
    qtbot: QtBot, opened: Open, folder: Path
) -> None:
    session = opened(folder)
    settle(qtbot, session, "v002")
    session.set_status("done")
    other = opened(annotation_path(folder, CONSENSUS, "v002", "keypoints"))
    assert other.settling.is_settling
    assert volume_of(other) == "v002"


@pytest.mark.parametrize("person", ["anna", "nobody"])
def test_who_is_no_reviewer_settles_nothing(opened: Open, folder: Path, person: str) -> None:
    session = opened(folder, person)
    said: list[str] = []
    session.message_posted.connect(said.append)
    for wish in (session.settling.settle, session.settling.triage):
        wish()
    assert session.annotator_name == person
    assert said == ["The study's consensus is settled by its reviewers"] * 2
    assert not session.settling.is_triaging


def test_a_study_without_reviewers_is_settled_by_who_does_not_annotate(opened: Open, tmp_path: Path) -> None:
    folder = write_settled_study(tmp_path / "study", viewing=ViewingRules())
    assert opened(folder, "rita").settling.reason == ""
    assert opened(folder, "anna").settling.reason


class TestAReviewerWhoAnnotates:
    """Anna reviews, and has v001 alone done by both methods."""

    @pytest.fixture
    def annas(self, opened: Open, tmp_path: Path) -> Session:
        folder = write_settled_study(
            tmp_path / "study", viewing=ViewingRules(reviewers=("anna",)), without=("anna",)
        )
        for method in ("keypoints", "boxes"):
            write_annotation(folder, "anna", "v001", method)
        write_annotation(folder, "anna", "v002", "keypoints")
        return opened(folder, "anna")

    def test_settles_what_is_done_by_her(self, qtbot: QtBot, annas: Session) -> None:
        assert settle(qtbot, annas, "v001").consensus_of
        assert annas.others.shown

    @pytest.mark.parametrize("volume_id", ["v002", "v003"])
    def test_does_not_settle_what_is_not(self, qtbot: QtBot, annas: Session, volume_id: str) -> None:
        with qtbot.waitSignal(annas.message_posted, check_params_cb=lambda text: "not done yet" in text):
            annas.settling.settle(volume_id)
        qtbot.waitUntil(lambda: not annas.jobs.running)
        assert annas.annotator_name == "anna"

    def test_gets_there_by_no_key_either(self, qtbot: QtBot, annas: Session) -> None:
        settle(qtbot, annas, "v001")
        with qtbot.waitSignal(annas.message_posted, check_params_cb=lambda text: "not done yet" in text):
            annas.next_volume()
        qtbot.waitUntil(lambda: not annas.jobs.running)
        assert volume_of(annas) == "v001"

    def test_is_shown_no_rank_of_them(self, qtbot: QtBot, annas: Session) -> None:
        assert triage(qtbot, annas) == ["v001"]


def test_in_blind_work_a_reviewer_who_annotates_waits_for_the_own_work(
    qtbot: QtBot, opened: Open, tmp_path: Path
) -> None:
    folder = write_settled_study(
        tmp_path / "study", viewing=ViewingRules(reviewers=("anna",)), blind=True, without=("anna",)
    )
    session = opened(folder, "anna")
    assert "blind" in session.settling.reason
    for volume_id in IDS:
        write_annotation(folder, "anna", volume_id, "keypoints")
    open_and_wait(qtbot, session, folder)
    assert all(item.status == "done" for item in session.items)
    # By boxes nothing is done.
    assert "blind" in session.settling.reason
    for volume_id in IDS:
        write_annotation(folder, "anna", volume_id, "boxes")
    open_and_wait(qtbot, session, folder)
    assert not session.settling.reason
    assert settle(qtbot, session, "v001").consensus_of


def test_the_triage_ranks_and_follows_what_is_settled(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    assert triage(qtbot, session) == ["v003", "v001", "v002"]
    entries = {entry.volume: entry for entry in session.settling.entries}
    assert [flag.annotator for flag in entries["v003"].flags] == ["ben"]
    settle(qtbot, session, "v003")
    assert session.settling.next_volume_id() == "v001"
    session.set_status("done")
    settled = {entry.volume: entry.settled for entry in session.settling.entries}
    assert settled == {"v003": "done", "v001": "no", "v002": "no"}
    session.settling.settle_next()
    qtbot.waitUntil(lambda: volume_of(session) == "v001" and not session.jobs.running)
    assert document_of(session).consensus_of
    for _ in range(2):
        session.set_status("done")
        session.settling.settle_next()
        qtbot.waitUntil(lambda: not session.jobs.running)
    assert session.settling.next_volume_id() is None


def test_a_triage_of_another_method_is_forgotten(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    assert triage(qtbot, session)
    session.set_method("boxes")
    qtbot.waitUntil(lambda: session.method == "boxes")
    assert session.settling.entries == ()


def test_a_triage_can_be_given_up(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    session.settling.triage()
    assert session.settling.is_triaging
    session.settling.cancel_triage()
    qtbot.waitUntil(lambda: not session.settling.is_triaging, timeout=LATE_IMPORTS_MS)
    assert session.settling.entries == ()


def test_what_a_dead_program_left_of_a_consensus_is_recovered(
    qtbot: QtBot, opened: Open, options: SessionOptions, folder: Path
) -> None:
    session = opened(folder)
    settle(qtbot, session)
    session.settling.adopt("k1", "ben")
    lost = document_of(session)
    # What a killed program leaves: a journal, and neither file nor lock.
    journals = {path: path.read_bytes() for path in options.recovery_folder.rglob("*") if path.is_file()}
    session.abandon()
    for path in session.worklist.folder.rglob("consensus/*.json"):
        path.unlink()
    for path, content in journals.items():
        path.write_bytes(content)
    (recovery,) = find_recoveries(options.recovery_folder)
    other = opened(folder)
    other.recover(recovery)
    qtbot.waitUntil(lambda: other.settling.is_settling and other.document is not None)
    qtbot.waitUntil(lambda: not other.jobs.running)
    assert document_of(other).parts == lost.parts
    assert document_of(other).consensus_of == lost.consensus_of
    assert other.save()


def test_another_method_has_a_consensus_of_its_own(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    settle(qtbot, session, "v002")
    session.set_method("boxes")
    qtbot.waitUntil(lambda: document_of(session).method == "boxes" and session.settling.consensus is not None)
    assert session.settling.is_settling
    assert session.annotation_path == annotation_path(folder, CONSENSUS, "v002", "boxes")


def test_a_reviewer_compares_the_annotators_while_settling(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    settle(qtbot, session)
    assert (session.agreeing.refusal, session.agreeing.export_refusal) == ("", "")
    session.agreeing.compute()
    qtbot.waitUntil(lambda: session.agreeing.result is not None, timeout=LATE_IMPORTS_MS)
    session.settling.adopt("k1", "ben")
    # What the reviewer decides is nothing that is compared.
    assert not session.agreeing.is_stale


def test_the_consensus_counts_in_no_mean_of_the_annotators(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    settle(qtbot, session, "v002")
    session.set_status("done")
    annas = opened(folder, "anna")
    annas.open_item(1)
    qtbot.waitUntil(lambda: volume_of(annas) == "v002")
    annas.others.want()
    qtbot.waitUntil(lambda: len(annas.others.shown) == 3)
    consensus = next(other for other in annas.others.shown if other.annotator == CONSENSUS)
    lines = [line for line in annas.others.differences() if line.keypoint == "k0"]
    assert consensus.number not in {line.number for line in lines}
    for line in lines:
        assert line.reference_um == pytest.approx(position_um(0, "ben"))


def test_to_propose_again_what_is_settled_makes_it_in_progress_by_the_same_edit(
    qtbot: QtBot, opened: Open, folder: Path
) -> None:
    session = opened(folder)
    settle(qtbot, session)
    session.set_status("done")
    settled, count = document_of(session), session.undo_stack.count
    move(folder, "ben", "v001", "k5", (0.0, 30.0, 0.0))
    with qtbot.waitSignal(session.document_changed):
        session.settling.propose()
    assert document_of(session).status == "in_progress"
    assert session.undo_stack.count == count + 1
    assert list(session.settling.moved_um) == ["k5"]
    session.undo()
    assert document_of(session) == settled
    assert not session.settling.moved_um


def test_a_change_of_an_annotators_file_is_noticed_while_the_consensus_is_open(
    qtbot: QtBot, opened: Open, folder: Path
) -> None:
    session = opened(folder)
    settle(qtbot, session)
    session.set_status("done")
    move(folder, "ben", "v001", "k5", (0.0, 30.0, 0.0))
    session.settling.look_for_changes()
    qtbot.waitUntil(lambda: session.settling.changed_since == ("ben",))


def test_the_file_says_who_settled_it(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    settle(qtbot, session)
    session.set_status("done")
    saved = load_annotation(annotation_path(folder, CONSENSUS, "v001", "keypoints"))[0]
    assert saved.reviewer == "rita"
    assert (saved.reviewer, saved.reviewed) == session.review


def test_a_proposal_that_nobody_touched_is_not_saved_by_leaving(
    qtbot: QtBot, opened: Open, options: SessionOptions, folder: Path
) -> None:
    session = opened(folder)
    settle(qtbot, session)
    assert session.is_mere_proposal
    settle(qtbot, session, "v002")
    assert not annotation_path(folder, CONSENSUS, "v001", "keypoints").exists()
    assert {item.status for item in session.items} == {"new"}
    session.settling.adopt("k1", "ben")
    assert not session.is_mere_proposal
    session.undo()
    assert session.is_mere_proposal
    session.redo()
    settle(qtbot, session, "v003")
    assert annotation_path(folder, CONSENSUS, "v002", "keypoints").exists()
    assert session.is_mere_proposal
    assert session.close_volume()
    assert not annotation_path(folder, CONSENSUS, "v003", "keypoints").exists()
    # Nor is it offered to be recovered.
    assert find_recoveries(options.recovery_folder) == ()


def test_arriving_at_a_consensus_places_nothing_by_a_click(qtbot: QtBot, opened: Open, folder: Path) -> None:
    session = opened(folder)
    settle(qtbot, session)
    session.set_mode("place")
    settle(qtbot, session, "v002")
    assert session.view.mode == "navigate"
