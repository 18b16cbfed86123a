import math
from collections.abc import Callable
from functools import partial
from typing import get_args

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from annotations.documents.annotation import Annotation, Certainty, KeypointAnnotation, Source, State
from annotations.documents.edits import (
    EditRefused,
    clear,
    lock,
    place_box,
    place_keypoint,
    relabel,
    set_certainty,
    set_state,
    set_status,
)
from annotations.documents.files import annotation_bytes
from annotations.documents.record import Status, changed
from annotations.geometry.boxes import Box
from annotations.geometry.rotations import quaternion

Edit = Callable[[Annotation], Annotation]

HERE_UM = (100.0, 200.0, 300.0)
THERE_UM = (-5.0, 0.0, 1e7)

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
        "lock": st.builds(lambda locked: partial(lock, name=name, locked=locked), st.booleans()),
        "status": st.builds(
            lambda status: partial(set_status, status=status), st.sampled_from(get_args(Status))
        ),
    }[kind]


KINDS = ["place", "box", "state", "certainty", "clear", "lock", "status"]


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
    # Nothing else has changed: an edit of a part is about that part, one of the status about none.
    assert [part.name for part in after.parts] == [part.name for part in before.parts]
    different = [one.name for one, other in zip(before.parts, after.parts, strict=True) if one != other]
    assert len(different) <= (0 if kind == "status" else 1)
    restored = changed(after, **{before.method: before.parts, "status": before.status})
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
