"""Edits are written down in few bytes, and what they changed is given back exactly."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.documents import edits
from annotations.documents.annotation import Annotation
from annotations.documents.edit_log import EditLog, packed_edit
from annotations.documents.provenance import Contribution
from annotations.documents.record import changed


@pytest.fixture
def steps(document: Annotation) -> list[Annotation]:
    """A document after no edit, after one of each kind, and after one that changed nothing but its status."""
    placed = edits.place_keypoint(document, "k0", (0.1 + 0.2, -1e-300, 1e17 / 3), "clicked")
    swapped = edits.relabel(placed, {"k0": "k5", "k5": "k0"})
    flagged = edits.set_flag(swapped, "unsure about the tip — µm?")
    made = changed(flagged, consensus_of=(Contribution(path="a.json", annotator="anna", sha256="0" * 64),))
    return [document, placed, swapped, flagged, made, edits.set_status(made, "done")]


@pytest.fixture
def log(steps: list[Annotation]) -> EditLog:
    log = EditLog()
    for number, (before, after) in enumerate(pairwise(steps)):
        log.append(packed_edit(f"step {number}", before, after))
    return log


def test_every_edit_can_be_taken_back_and_made_again(log: EditLog, steps: list[Annotation]) -> None:
    assert len(log) == 5
    document = steps[-1]
    for index in reversed(range(5)):
        document = log.undone(index, document)
        assert document == steps[index]
    for index in range(5):
        document = log.redone(index, document)
        assert document == steps[index + 1]
    assert [log.text(index) for index in range(5)] == [f"step {index}" for index in range(5)]


def test_what_an_edit_did_not_change_stays_as_it_is_now(log: EditLog, steps: list[Annotation]) -> None:
    now = changed(edits.place_keypoint(steps[1], "k3", (1.0, 2.0, 3.0), "typed"), active_seconds=8.5)
    before = log.undone(0, now)
    assert before.keypoint("k0") == steps[0].keypoint("k0")
    assert before.keypoint("k3") is now.keypoint("k3")
    assert before.active_seconds == 8.5


def test_edits_that_were_cut_are_forgotten(log: EditLog, steps: list[Annotation]) -> None:
    log.cut(9)
    assert len(log) == 5
    log.cut(2)
    assert len(log) == 2
    log.append(packed_edit("another", steps[2], steps[0]))
    assert (len(log), log.text(1), log.text(2)) == (3, "step 1", "another")
    assert log.redone(2, steps[2]) == steps[0]
    log.cut(0)
    assert len(log) == 0


@pytest.mark.parametrize("index", [-1, 5])
def test_there_are_no_other_edits(log: EditLog, steps: list[Annotation], index: int) -> None:
    with pytest.raises(IndexError, match=f"5 edits, none of the index {index}"):
        log.undone(index, steps[0])


@given(st.from_type(Annotation), st.from_type(Annotation))
def test_whatever_two_documents_differ_in_is_given_back(before: Annotation, after: Annotation) -> None:
    log = EditLog()
    log.append(packed_edit("all", before, after))
    assert log.undone(0, after) == before
    assert log.redone(0, before) == after
