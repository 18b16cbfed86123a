"""Whatever is edited in whatever order: undo and redo give back exactly the documents that were there."""

import gc
import math
import tracemalloc
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PySide6.QtWidgets import QApplication

from annotations.documents.annotation import Annotation
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.rotations import quaternion
from annotator.session import Session

names = st.sampled_from([f"k{number}" for number in range(6)])
links = st.sampled_from(["link0", "link1", "link2"])
positions_um = st.tuples(*[st.floats(-1e5, 1e5)] * 3)
edits = st.one_of(
    st.tuples(st.just("place"), positions_um, st.just("clicked"), names),
    st.tuples(st.just("type_position"), names, positions_um),
    st.tuples(st.just("nudge"), st.integers(0, 2), st.integers(-10, 10)),
    st.tuples(
        st.just("set_state"), names, st.sampled_from(["placed", "occluded", "out_of_view", "unplaced"])
    ),
    st.tuples(st.just("set_certainty"), names, st.sampled_from(["sure", "unsure"])),
    st.tuples(st.just("set_locked"), names, st.booleans()),
    st.tuples(st.just("clear"), names),
    st.tuples(
        st.just("relabel"),
        st.permutations(["k0", "k1", "k4"]).map(
            lambda right: dict(zip(["k0", "k1", "k4"], right, strict=True))
        ),
    ),
    st.tuples(st.just("activate"), names),
    st.tuples(st.just("undo")),
    st.tuples(st.just("redo")),
)


near_um = st.tuples(*[st.floats(-2e4, 2e4)] * 3)
rotations = (
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda values: math.hypot(*values) > 1e-3).map(quaternion)
)
boxes = st.builds(Box, near_um, st.tuples(*[st.floats(20, 2e4)] * 3), rotations)
poses = st.builds(
    ToolPose,
    near_um,
    rotations,
    st.fixed_dictionaries({"theta1": st.floats(-90, 90), "theta2": st.floats(0, 90)}),
)
handles = st.sampled_from(
    ["center", "base", "tip", "swing", "roll", "+y", "-z", "move:link1", "bend:theta1", "bend:theta2"]
)
body_edits = st.one_of(
    st.tuples(st.just("set_mode"), st.sampled_from(["place", "pose", "navigate"])),
    st.tuples(st.just("place"), near_um),
    st.tuples(st.just("activate"), links),
    st.tuples(st.just("type_box"), links, boxes),
    st.tuples(st.just("free_cross_section"), links, st.booleans()),
    st.tuples(st.just("drag_handle"), handles, near_um),
    st.tuples(st.just("drag_body"), links, near_um),
    st.tuples(st.just("keep_draft")),
    st.tuples(st.just("drop_preview")),
    st.tuples(st.just("nudge"), st.integers(0, 2), st.integers(-10, 10)),
    st.tuples(st.just("turn"), st.integers(0, 2), st.floats(-180, 180)),
    st.tuples(st.just("bend"), st.integers(0, 2), st.floats(-180, 180)),
    st.tuples(st.just("turn_over")),
    st.tuples(st.just("pose_tool"), poses),
    st.tuples(st.just("set_locked"), links, st.booleans()),
    st.tuples(st.just("set_state"), links, st.sampled_from(["placed", "occluded", "unplaced"])),
    st.tuples(st.just("clear"), links),
    st.tuples(st.just("undo")),
    st.tuples(st.just("redo")),
)


@pytest.mark.timeout(120)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(st.lists(edits, max_size=30))
def test_undo_and_redo_are_exact(session: Session, steps: list[tuple[Any, ...]]) -> None:
    check_history(session, steps)


@pytest.mark.timeout(120)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(st.lists(body_edits, max_size=30))
def test_undo_and_redo_are_exact_for_boxes_and_poses(
    boxes_session: Session, steps: list[tuple[Any, ...]]
) -> None:
    boxes_session.look(free_links=frozenset(), first_end_um=None, draft=None, pose=None, mode="navigate")
    check_history(boxes_session, steps)


def check_history(session: Session, steps: list[tuple[Any, ...]]) -> None:
    """Do some steps, each one edit at most, and compare the documents on the way back and forth."""
    session.undo_stack.clear()
    start = session.document
    assert start is not None
    history: list[Annotation] = [start]
    position = 0
    for name, *arguments in steps:
        before = session.document
        assert before is not None
        if name in ("undo", "redo"):
            getattr(session.undo_stack, name)()
            position = min(max(position + (1 if name == "redo" else -1), 0), len(history) - 1)
        else:
            getattr(session, name)(*arguments)
            if session.document != before:
                position += 1
                assert session.document is not None
                history[position:] = [session.document]
        assert session.document == history[position]
        assert session.undo_stack.index == position
    while session.undo_stack.can_undo:
        session.undo_stack.undo()
    assert session.document == start


def test_edits_keep_what_they_changed_and_no_documents(session: Session) -> None:
    def kept() -> int:
        gc.collect()
        # Those of other tests do not count.
        volume = session.document.volume if session.document is not None else None
        return sum(isinstance(each, Annotation) and each.volume is volume for each in gc.get_objects())

    for step in range(5):
        session.type_position("k0", (100.0 + step / 7, 200.0, 188.0))
    before = kept()
    for step in range(100):
        session.type_position("k1", (100.0 + step / 7, 200.0, 188.0))

    assert session.undo_stack.count == 105
    assert kept() <= before + 2


def test_an_edit_takes_little_memory_and_closing_gives_it_back(session: Session) -> None:
    def edit(count: int) -> None:
        for step in range(count):
            session.type_position("k0", (100.0 + step / 7, 200.0, 188.0))

    edit(20)
    gc.collect()
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        edit(200)
        gc.collect()
        taken = tracemalloc.get_traced_memory()[0] - before
        session.save()
        session.close_volume()
        QApplication.processEvents()
        gc.collect()
        left = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()

    # All that they may is 50 MiB for 10,000: five times as much.
    assert taken / 200 < 2**10
    assert left < taken / 4
