import math
from collections.abc import Callable
from functools import partial
from typing import get_args

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from annotations.documents.annotation import (
    Annotation,
    Certainty,
    KeypointAnnotation,
    Part,
    Source,
    State,
)
from annotations.documents.edits import (
    EditRefused,
    adopt,
    clear,
    fill_in,
    lock,
    place_box,
    place_keypoint,
    propose_consensus,
    relabel,
    set_certainty,
    set_flag,
    set_state,
    set_status,
)
from annotations.documents.files import annotation_bytes
from annotations.documents.provenance import Contribution
from annotations.documents.record import Status, changed
from annotations.geometry.boxes import Box
from annotations.geometry.rotations import quaternion

Edit = Callable[[Annotation], Annotation]

HERE_UM = (100.0, 200.0, 300.0)
THERE_UM = (-5.0, 0.0, 1e7)
SOURCE = Contribution(path="../ben/v001.keypoints.json", annotator="ben", sha256="0" * 64)

positions = st.tuples(*[st.floats(-1e6, 1e6)] * 3)


boxes = st.builds(
    Box,
    positions,
    st.tuples(*[st.floats(1.0, 1e5)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 4).filter(any).map(quaternion),
)


def edits_of(kind: str, name: str) -> st.SearchStrategy[Edit]:
    """Draw edits of one kind, of the keypoint or box of that name where they are about one."""
    return {
        "place": st.builds(
            lambda position_um, source: partial(
                place_keypoint, name=name, position_um=position_um, source=source
            ),
            positions,
            st.sampled_from(get_args(Source)),
        ),
        "box": st.builds(
            lambda box, source: partial(place_box, link=name, box=box, source=source),
            boxes,
            st.sampled_from(get_args(Source)),
        ),
        "state": st.builds(
            lambda state: partial(set_state, name=name, state=state), st.sampled_from(get_args(State))
        ),
        "certainty": st.builds(
            lambda certainty: partial(set_certainty, name=name, certainty=certainty),
            st.sampled_from(get_args(Certainty)),
        ),
        "clear": st.just(partial(clear, name=name)),
        "flag": st.builds(lambda flag: partial(set_flag, flag=flag), st.none() | st.text(max_size=20)),
        "lock": st.builds(lambda locked: partial(lock, name=name, locked=locked), st.booleans()),
        "status": st.builds(
            lambda status: partial(set_status, status=status), st.sampled_from(get_args(Status))
        ),
    }[kind]


KINDS = ["place", "box", "state", "certainty", "clear", "lock", "status", "flag"]


@pytest.mark.parametrize("kind", KINDS)
@given(document=..., data=st.data())
def test_undo_restores_the_document_exactly(kind: str, document: Annotation, data: st.DataObject) -> None:
    names = [part.name for part in document.parts] or ["k0"]
    edit = data.draw(edits_of(kind, data.draw(st.sampled_from(names))))
    content, stack = annotation_bytes(document), [document]
    try:
        stack.append(edit(document))
    except EditRefused:
        assert annotation_bytes(document) == content
        return
    before, after = stack
    # Undo goes back to `before`, which the edit has left alone; redo gives `after` again.
    assert annotation_bytes(before) == content
    assert edit(before) == after
    assert (after is before) == (annotation_bytes(after) == content)
    # Nothing else has changed: an edit of a part is about that part, one of the whole about none.
    assert [part.name for part in after.parts] == [part.name for part in before.parts]
    different = [one.name for one, other in zip(before.parts, after.parts, strict=True) if one != other]
    assert len(different) <= (0 if kind in ("status", "flag") else 1)
    restored = changed(after, **{before.method: before.parts, "status": before.status, "flag": before.flag})
    assert annotation_bytes(restored) == content


@given(document=..., data=st.data())
def test_many_edits_are_undone_one_by_one(document: Annotation, data: st.DataObject) -> None:
    names = [part.name for part in document.parts] or ["k0"]
    stack, contents, made = [document], [annotation_bytes(document)], []
    for kind in data.draw(st.lists(st.sampled_from(KINDS), max_size=12)):
        edit = data.draw(edits_of(kind, data.draw(st.sampled_from(names))))
        try:
            stack.append(edit(stack[-1]))
        except EditRefused:
            continue
        made.append(edit)
        contents.append(annotation_bytes(stack[-1]))
    assert [annotation_bytes(each) for each in reversed(stack)] == contents[::-1]
    redone = stack[0]
    for edit in made:
        redone = edit(redone)
    assert redone == stack[-1]


def test_placing_makes_an_unplaced_keypoint_placed(document: Annotation) -> None:
    placed = place_keypoint(document, "k2", HERE_UM, "clicked")
    assert placed.keypoint("k2") == KeypointAnnotation(
        name="k2", state="placed", position_um=HERE_UM, source="clicked"
    )
    assert document.keypoint("k2").state == "unplaced"


@pytest.mark.parametrize("state", ["occluded", "out_of_view"])
def test_moving_keeps_what_was_said_about_a_keypoint(document: Annotation, state: State) -> None:
    placed = place_keypoint(document, "k2", HERE_UM, "clicked")
    said = set_certainty(set_state(placed, "k2", state), "k2", "unsure")
    moved = place_keypoint(said, "k2", THERE_UM, "dragged").keypoint("k2")
    assert (moved.state, moved.certainty, moved.position_um, moved.source) == (
        state,
        "unsure",
        THERE_UM,
        "dragged",
    )


def test_clearing_leaves_a_fresh_keypoint(document: Annotation) -> None:
    placed = set_certainty(place_keypoint(document, "k2", HERE_UM, "clicked"), "k2", "unsure")
    assert clear(placed, "k2") == document
    assert set_state(placed, "k2", "unplaced") == document


@pytest.mark.parametrize("state", ["placed", "occluded", "out_of_view"])
def test_without_a_position_a_keypoint_is_unplaced(document: Annotation, state: State) -> None:
    with pytest.raises(EditRefused, match="has no position yet"):
        set_state(document, "k2", state)


def test_an_edit_that_changes_nothing_is_none(document: Annotation) -> None:
    placed = place_keypoint(document, "k2", HERE_UM, "clicked")
    for edit in (
        partial(place_keypoint, name="k2", position_um=HERE_UM, source="clicked"),
        partial(set_state, name="k2", state="placed"),
        partial(set_certainty, name="k2", certainty="sure"),
        partial(clear, name="k3"),
        partial(set_state, name="k3", state="unplaced"),
        partial(lock, name="k2", locked=False),
        partial(set_status, status="in_progress"),
    ):
        assert edit(placed) is placed, edit


@pytest.mark.parametrize(
    "edit",
    [
        partial(place_keypoint, name="k2", position_um=THERE_UM, source="clicked"),
        partial(place_keypoint, name="k2", position_um=HERE_UM, source="clicked"),
        partial(set_state, name="k2", state="occluded"),
        partial(set_state, name="k2", state="unplaced"),
        partial(set_certainty, name="k2", certainty="unsure"),
        partial(clear, name="k2"),
    ],
)
def test_a_locked_keypoint_refuses_every_change(document: Annotation, edit: Edit) -> None:
    locked = lock(place_keypoint(document, "k2", HERE_UM, "clicked"), "k2", True)
    with pytest.raises(EditRefused, match=r"Keypoint k2 is locked\. Unlock it to change it"):
        edit(locked)
    edit(lock(locked, "k2", False))


def test_a_lock_is_for_its_keypoint_alone(document: Annotation) -> None:
    locked = lock(document, "k2", True)
    assert place_keypoint(locked, "k3", HERE_UM, "clicked").keypoint("k3").position_um == HERE_UM
    assert set_status(locked, "done").status == "done"


def test_relabelling_takes_along_all_that_was_said_of_a_keypoint(document: Annotation) -> None:
    said = set_state(place_keypoint(document, "k2", HERE_UM, "clicked"), "k2", "occluded")
    said = place_keypoint(set_certainty(said, "k2", "unsure"), "k4", THERE_UM, "typed")
    round_about = relabel(said, {"k2": "k4", "k4": "k1", "k1": "k2"})
    assert round_about.keypoint("k4") == changed(said.keypoint("k2"), name="k4")
    assert round_about.keypoint("k1") == changed(said.keypoint("k4"), name="k1")
    assert round_about.keypoint("k2") == KeypointAnnotation(name="k2")
    assert [part.name for part in round_about.parts] == [part.name for part in said.parts]
    swap = {"k2": "k4", "k4": "k2"}
    assert relabel(relabel(said, swap), swap) == said


def test_a_relabelling_that_is_none_is_refused(document: Annotation) -> None:
    placed = place_keypoint(document, "k2", HERE_UM, "clicked")
    with pytest.raises(EditRefused, match="k2 cannot change places"):
        relabel(placed, {"k2": "k4"})
    with pytest.raises(EditRefused, match=r"Keypoint k2 is locked\. Unlock it to change it"):
        relabel(lock(placed, "k2", True), {"k2": "k4", "k4": "k2"})


def test_boxes_change_places_and_keep_the_cross_section_of_their_link(by_boxes: Annotation) -> None:
    swapped = relabel(by_boxes, {"link1": "link2", "link2": "link1"})
    before, after = by_boxes.placed_boxes, swapped.placed_boxes
    assert after["link1"].center_um == before["link2"].center_um
    assert after["link2"].rotation_wxyz == before["link1"].rotation_wxyz
    assert after["link2"].size_um == (before["link1"].size_um[0], *before["link2"].size_um[1:])
    assert after["link0"] == before["link0"]
    assert relabel(swapped, {"link1": "link2", "link2": "link1"}) == by_boxes
    alone = relabel(clear(by_boxes, "link2"), {"link1": "link2", "link2": "link1"})
    assert alone.placed_boxes == {"link0": before["link0"], "link2": before["link1"]}


def test_an_unknown_keypoint_is_refused(document: Annotation) -> None:
    for edit in (
        partial(place_keypoint, name="k9", position_um=HERE_UM, source="clicked"),
        partial(set_state, name="k9", state="unplaced"),
        partial(set_certainty, name="k9", certainty="unsure"),
        partial(clear, name="k9"),
        partial(lock, name="k9", locked=True),
        partial(relabel, right_names={"k9": "k1", "k1": "k9"}),
    ):
        with pytest.raises(EditRefused, match="no keypoint 'k9'; the document has k0, k1, k2, k3, k4, k5"):
            edit(document)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_position_is_finite(document: Annotation, wrong: float) -> None:
    with pytest.raises(EditRefused, match=r"Keypoint k2: position_um\.1: Input should be a finite number"):
        place_keypoint(document, "k2", (0.0, wrong, 0.0), "clicked")


def test_positions_from_numpy_become_plain_floats(document: Annotation) -> None:
    first, second, third = np.array([1.0, 2.0, 3.0])
    position_um = place_keypoint(document, "k2", (first, second, third), "clicked").positions_um["k2"]
    assert [type(value) for value in position_um] == [float, float, float]


def test_editing_is_no_stamp(document: Annotation) -> None:
    placed = place_keypoint(document, "k2", HERE_UM, "clicked")
    assert placed.modified == document.modified
    assert placed.active_seconds == document.active_seconds


def proposed(document: Annotation, position_um: tuple[float, float, float]) -> dict[str, Part]:
    """Return a proposal for every keypoint of a document, at one place."""
    return {
        part.name: KeypointAnnotation(
            name=part.name, state="placed", position_um=position_um, source="consensus"
        )
        for part in document.parts
    }


def test_a_proposal_goes_where_nobody_has_decided_alone(document: Annotation) -> None:
    decided = place_keypoint(document, "k2", HERE_UM, "clicked")
    locked = lock(decided, "k3", locked=True)
    after = propose_consensus(locked, proposed(locked, (1.0, 2.0, 3.0)), (SOURCE,))
    assert after.consensus_of == (SOURCE,)
    assert after.part("k2") == locked.part("k2")
    assert after.part("k3") == locked.part("k3")
    assert after.positions_um["k4"] == (1.0, 2.0, 3.0)
    again = propose_consensus(after, proposed(after, (4.0, 5.0, 6.0)), (SOURCE,))
    assert again.positions_um["k4"] == (4.0, 5.0, 6.0)
    assert again.part("k2") == locked.part("k2")
    assert propose_consensus(again, proposed(again, (4.0, 5.0, 6.0)), (SOURCE,)) is again


def test_what_a_reviewer_places_by_hand_is_no_proposal_any_more(document: Annotation) -> None:
    after = propose_consensus(document, proposed(document, (1.0, 2.0, 3.0)), (SOURCE,))
    moved = place_keypoint(after, "k1", HERE_UM, "dragged")
    assert moved.part("k1").source == "dragged"
    again = propose_consensus(moved, proposed(moved, (4.0, 5.0, 6.0)), (SOURCE,))
    assert again.positions_um["k1"] == HERE_UM


def test_a_fit_fills_in_neither_what_was_proposed_nor_what_was_taken(document: Annotation) -> None:
    after = propose_consensus(document, proposed(document, (1.0, 2.0, 3.0)), (SOURCE,))
    theirs = place_keypoint(document, "k1", THERE_UM, "clicked").part("k1")
    taken = adopt(after, theirs, "ben")
    assert fill_in(taken, dict.fromkeys(taken.positions_um, (7.0, 8.0, 9.0))) is taken


def test_what_is_taken_is_all_that_its_annotator_said(document: Annotation) -> None:
    theirs = place_keypoint(document, "k1", HERE_UM, "snapped")
    theirs = set_certainty(set_state(theirs, "k1", "occluded"), "k1", "unsure")
    taken = adopt(document, theirs.part("k1"), "ben").keypoint("k1")
    assert (taken.position_um, taken.state, taken.certainty) == (HERE_UM, "occluded", "unsure")
    assert (taken.source, taken.adopted_from) == ("adopted", "ben")
    assert adopt(adopt(document, theirs.part("k1"), "ben"), theirs.part("k1"), "ben").keypoint("k1") == taken


def test_nothing_is_taken_for_a_locked_keypoint_or_from_who_has_not_placed_it(document: Annotation) -> None:
    theirs = place_keypoint(document, "k1", HERE_UM, "clicked")
    with pytest.raises(EditRefused, match="is locked"):
        adopt(lock(document, "k1", locked=True), theirs.part("k1"), "ben")
    with pytest.raises(EditRefused, match="ben has not placed k4"):
        adopt(document, clear(theirs, "k4").part("k4"), "ben")


def test_what_was_taken_keeps_its_origin_through_new_names_and_loses_it_when_cleared(
    document: Annotation,
) -> None:
    theirs = place_keypoint(document, "k1", HERE_UM, "clicked")
    taken = adopt(place_keypoint(document, "k2", THERE_UM, "clicked"), theirs.part("k1"), "ben")
    renamed = relabel(taken, {"k1": "k2", "k2": "k1"})
    assert (renamed.part("k2").adopted_from, renamed.part("k1").adopted_from) == ("ben", None)
    assert clear(renamed, "k2").part("k2").adopted_from is None


def test_a_flag_is_said_in_words_and_taken_back_by_none(document: Annotation) -> None:
    flagged = set_flag(document, "  Is that the tip?  ")
    assert flagged.flag == "Is that the tip?"
    assert set_flag(flagged, "Is that the tip?") is flagged
    assert set_flag(flagged, "   ").flag is None
    with pytest.raises(EditRefused, match="fewer words"):
        set_flag(document, "x" * 501)
