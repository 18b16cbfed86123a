"""The undo stack by itself: what can be undone, what is in the file, and what it says of itself when."""

from collections.abc import Callable

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents import edits
from annotations.documents.annotation import Annotation, VolumeReference, new_annotation
from annotations.geometry.tool_library import find_tools
from annotator.session.documents.undo_stack import UndoStack


class Document:
    """A document, and the stack of what was edited in it."""

    def __init__(self) -> None:
        reference = VolumeReference(
            path="v.npy", shape=(8, 8, 8), dtype="uint8", spacing_um=(1.0, 1.0, 1.0), fingerprint=""
        )
        tool = next(iter(find_tools(()).values()))
        self.present = new_annotation(reference, tool, "anna", "keypoints", ships=True)
        self.stack = UndoStack(lambda: self.present, self.show)
        self.then: Callable[[], None] = lambda: None
        self.seen: list[tuple[int, bool]] = []
        self.heard: list[str] = []
        self.stack.index_changed.connect(lambda: self.heard.append("index"))
        self.stack.clean_changed.connect(lambda: self.heard.append("clean"))

    def show(self, document: Annotation) -> None:
        self.seen.append((self.stack.index, self.stack.is_clean))
        self.present = document
        self.then()

    def place(self, position: float) -> None:
        after = edits.place_keypoint(self.present, "k0", (position, 0.0, 0.0), "typed")
        self.stack.push(f"Type {position:g}", self.present, after)

    @property
    def position(self) -> float | None:
        position_um = self.present.keypoint("k0").position_um
        return None if position_um is None else position_um[0]


@pytest.fixture
def edited(qtbot: QtBot) -> Document:
    return Document()


def test_what_can_be_undone_and_made_again_is_named(edited: Document) -> None:
    stack = edited.stack
    assert (stack.can_undo, stack.can_redo, stack.undo_text, stack.redo_text) == (False, False, "", "")
    edited.place(1)
    edited.place(2)
    assert (stack.count, stack.index, stack.undo_text, stack.redo_text) == (2, 2, "Type 2", "")
    stack.undo()
    assert (stack.count, stack.index, stack.undo_text, stack.redo_text) == (2, 1, "Type 1", "Type 2")
    assert edited.position == 1
    stack.undo()
    stack.undo()
    assert (stack.can_undo, stack.can_redo, edited.position) == (False, True, None)
    for _ in range(3):
        stack.redo()
    assert (stack.can_undo, stack.can_redo, edited.position) == (True, False, 2)


def test_another_edit_forgets_what_was_taken_back(edited: Document) -> None:
    for position in (1, 2, 3):
        edited.place(position)
    edited.stack.undo()
    edited.stack.undo()
    edited.place(4)
    assert (edited.stack.count, edited.stack.can_redo, edited.stack.undo_text) == (2, False, "Type 4")
    edited.stack.undo()
    assert edited.position == 1


def test_it_is_clean_where_it_was_saved_and_nowhere_else(edited: Document) -> None:
    stack = edited.stack
    assert stack.is_clean
    edited.place(1)
    assert not stack.is_clean
    stack.set_clean()
    assert stack.is_clean
    edited.place(2)
    stack.undo()
    assert stack.is_clean
    stack.undo()
    assert not stack.is_clean
    stack.redo()
    assert stack.is_clean


def test_what_was_saved_is_not_taken_for_another_edit_in_its_place(edited: Document) -> None:
    stack = edited.stack
    edited.place(1)
    stack.set_clean()
    stack.undo()
    edited.place(2)
    assert not stack.is_clean
    stack.undo()
    assert not stack.is_clean
    stack.redo()
    assert not stack.is_clean
    stack.set_clean()
    assert stack.is_clean


def test_all_is_forgotten_with_the_document(edited: Document) -> None:
    edited.place(1)
    edited.heard.clear()
    edited.stack.clear()
    assert (edited.stack.count, edited.stack.index, edited.stack.is_clean) == (0, 0, True)
    assert edited.heard == ["index", "clean"]
    # What is shown then is the session's to say.
    assert edited.position == 1


def test_what_changed_is_said_once_and_after_the_document(edited: Document) -> None:
    stack = edited.stack
    edited.place(1)
    edited.place(2)
    stack.undo()
    stack.undo()
    assert edited.heard == ["index", "clean", "index", "index", "index", "clean"]
    assert edited.seen == [(0, True), (1, False), (2, False), (1, False)]
    edited.heard.clear()
    stack.undo()
    stack.set_clean()
    stack.clear()
    # The edits that could have been made again went, but where the document is did not change.
    assert edited.heard == []


def test_a_document_that_changed_is_never_called_saved(edited: Document) -> None:
    def fail() -> None:
        raise RuntimeError("a view's own mistake")

    stack = edited.stack
    edited.place(1)
    stack.set_clean()
    edited.then = fail
    with pytest.raises(RuntimeError, match="own mistake"):
        edited.place(2)
    assert (edited.position, stack.index, stack.is_clean) == (2, 2, False)
    with pytest.raises(RuntimeError, match="own mistake"):
        stack.undo()
    assert (edited.position, stack.index, stack.is_clean) == (1, 1, True)
    with pytest.raises(RuntimeError, match="own mistake"):
        stack.redo()
    assert (edited.position, stack.index, stack.is_clean, stack.undo_text) == (2, 2, False, "Type 2")


@pytest.mark.parametrize("step", ["push", "undo", "redo"])
def test_an_edit_while_another_one_is_shown_leaves_no_index_without_an_edit(
    edited: Document, step: str
) -> None:
    stack = edited.stack
    for position in (1, 2, 3):
        edited.place(position)
    stack.undo()

    def edit_once() -> None:
        edited.then = lambda: None
        edited.place(9)

    edited.then = edit_once
    if step == "push":
        edited.place(4)
    else:
        getattr(stack, step)()
    assert edited.position == 9
    assert 0 <= stack.index <= stack.count
    assert not stack.is_clean
    assert all((stack.undo_text or not stack.can_undo, stack.redo_text or not stack.can_redo))
    while stack.can_undo:
        stack.undo()
    assert edited.position is None
