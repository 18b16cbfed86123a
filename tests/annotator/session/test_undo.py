"""Whatever is edited in whatever order: undo and redo give back exactly the documents that were there."""

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from annotations.documents.annotation import Annotation
from annotator.session import Session

names = st.sampled_from([f"k{number}" for number in range(6)])
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


@pytest.mark.timeout(120)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(st.lists(edits, max_size=30))
def test_undo_and_redo_are_exact(session: Session, steps: list[tuple[Any, ...]]) -> None:
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
        assert session.undo_stack.index() == position
    while session.undo_stack.canUndo():
        session.undo_stack.undo()
    assert session.document == start
