"""The check in the panel: what is likely wrong, where it is, and putting it right."""

import threading
from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QLabel, QPushButton, QToolButton, QWidget
from pytestqt.qtbot import QtBot

from annotations.fitting.mistakes import Mistake
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotator.panels.annotation.pose_panel import PosePanel
from annotator.session import Session
from annotator.session.editing import mistake_search
from annotator.session.editing.box_handles import rolled

LEFT = Qt.MouseButton.LeftButton
POSE = ToolPose(
    (3000.0, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 30.0), {"theta1": 40.0, "theta2": 25.0}
)


def panel_of(qtbot: QtBot, session: Session) -> PosePanel:
    panel = PosePanel(session)
    qtbot.addWidget(panel)
    panel.resize(360, 900)
    panel.show()
    return panel


@pytest.fixture
def panel(qtbot: QtBot, session: Session) -> PosePanel:
    return panel_of(qtbot, session)


def place_all(qtbot: QtBot, session: Session) -> None:
    assert session.tool is not None
    for name, position_um in keypoints_um(POSE, session.tool).items():
        session.place(position_um, "clicked", name)
    settle(qtbot, session)


def settle(qtbot: QtBot, session: Session) -> None:
    qtbot.waitUntil(lambda: not session.is_searching_mistakes)


def found(panel: PosePanel, kind: type[Any], name: str) -> Any:
    widget = panel.findChild(kind, name)
    assert isinstance(widget, kind)
    return widget


def test_with_few_positions_nothing_is_claimed(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    verdict = found(panel, QLabel, "mistakes_verdict")
    settle(qtbot, session)
    assert "From 3 positions on" in verdict.text()
    assert not found(panel, QPushButton, "mistakes_every_order").isEnabled()


def test_of_boxes_it_is_said_how_many_can_be_checked(qtbot: QtBot, boxes_session: Session) -> None:
    panel = PosePanel(boxes_session)
    qtbot.addWidget(panel)
    settle(qtbot, boxes_session)
    assert found(panel, QLabel, "mistakes_verdict").text().startswith("From 2 boxes on")


def test_a_sound_annotation_has_nothing_implausible(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    place_all(qtbot, session)
    assert found(panel, QLabel, "mistakes_verdict").text() == "Nothing implausible."
    assert panel.findChild(QWidget, "mistake_0") is None


def test_swapped_keypoints_are_named_gone_to_and_swapped_back_as_one_step(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    place_all(qtbot, session)
    sound = session.document
    session.relabel({"k2": "k4", "k4": "k2"})
    wrong = session.document
    settle(qtbot, session)
    assert "k2 and k4 are likely swapped" in found(panel, QLabel, "mistake_text_0").text()
    assert not found(panel, QLabel, "mistakes_verdict").isVisible()
    qtbot.mouseClick(found(panel, QToolButton, "mistake_0_k4"), LEFT)
    assert session.view.active_part == "k4"
    assert session.view.crosshair_um != (0.0, 0.0, 0.0)
    steps = session.undo_stack.count
    qtbot.mouseClick(found(panel, QPushButton, "mistake_correct_0"), LEFT)
    assert session.document == sound
    assert session.undo_stack.count == steps + 1
    settle(qtbot, session)
    assert found(panel, QLabel, "mistakes_verdict").text() == "Nothing implausible."
    session.undo_stack.undo()
    assert session.document == wrong


def test_clicks_on_a_line_go_through_its_parts(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    place_all(qtbot, session)
    session.relabel({"k2": "k4", "k4": "k2"})
    settle(qtbot, session)
    text = found(panel, QLabel, "mistake_text_0")
    visited = []
    for _ in range(3):
        qtbot.mouseClick(text, LEFT, pos=QPoint(5, 5))
        visited.append(session.view.active_part)
    assert visited == ["k2", "k4", "k2"]


def test_a_reversed_link_is_turned_round(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    place_all(qtbot, session)
    sound = session.document
    session.relabel({"k0": "k1", "k1": "k0"})
    settle(qtbot, session)
    assert found(panel, QPushButton, "mistake_correct_0").text() == "Swap the ends"
    qtbot.mouseClick(found(panel, QPushButton, "mistake_correct_0"), LEFT)
    assert session.document == sound


def test_a_second_click_does_not_undo_the_first_one(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    place_all(qtbot, session)
    sound = session.document
    session.relabel({"k1": "k4", "k4": "k1"})
    settle(qtbot, session)
    correct = found(panel, QPushButton, "mistake_correct_0")
    qtbot.mouseClick(correct, LEFT)
    qtbot.mouseClick(correct, LEFT)
    assert session.document == sound


@pytest.mark.parametrize(("spoil", "words"), [("turn_over", "Turn it over"), ("reverse", "Reverse it")])
def test_boxes_are_put_right_too(qtbot: QtBot, boxes_session: Session, spoil: str, words: str) -> None:
    session = boxes_session
    panel = panel_of(qtbot, session)
    assert session.tool is not None
    boxes = link_boxes(POSE, session.tool)
    for link, box in boxes.items():
        session.type_box(link, box)
    session.activate("link1")
    if spoil == "turn_over":
        session.turn_over()
    else:
        session.reverse("link1")
    settle(qtbot, session)
    correct = found(panel, QPushButton, "mistake_correct_0")
    assert correct.text() == words
    steps = session.undo_stack.count
    qtbot.mouseClick(correct, LEFT)
    assert session.undo_stack.count == steps + 1
    assert session.document is not None
    assert session.document.placed_boxes["link1"].axes == pytest.approx(boxes["link1"].axes)


def test_boxes_whose_roll_nobody_has_set_are_turned_to_where_their_ends_show(
    qtbot: QtBot, boxes_session: Session
) -> None:
    session = boxes_session
    panel = panel_of(qtbot, session)
    assert session.tool is not None
    boxes = link_boxes(POSE, session.tool)
    for link, box in boxes.items():
        session.type_box(link, rolled(box, 50.0))
    settle(qtbot, session)
    correct = found(panel, QPushButton, "mistake_correct_0")
    assert correct.text() == "Turn them"
    steps = session.undo_stack.count
    qtbot.mouseClick(correct, LEFT)
    assert session.undo_stack.count == steps + 1
    assert session.document is not None
    for link, box in boxes.items():
        assert session.document.placed_boxes[link].axes == pytest.approx(box.axes, abs=0.05)
        assert session.document.part(link).source == "typed"
    settle(qtbot, session)
    assert session.mistakes == ()


class Searcher:
    """Stands in for the search, and ends when the test lets it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.go_on = threading.Event()
        self.go_on.set()
        self.result: tuple[Mistake, ...] = ()
        self.thorough: list[bool] = []
        monkeypatch.setattr(mistake_search, "likely_mistakes", self._search)

    def _search(
        self, *_arguments: Any, every_relabelling: bool, cancelled: Callable[[], bool]
    ) -> tuple[Mistake, ...]:
        self.thorough.append(every_relabelling)
        self.go_on.wait(10)
        return self.result


@pytest.fixture
def searcher(monkeypatch: pytest.MonkeyPatch) -> Searcher:
    return Searcher(monkeypatch)


def test_while_it_is_looked_nothing_flickers(
    qtbot: QtBot, searcher: Searcher, session: Session, panel: PosePanel
) -> None:
    searcher.result = (Mistake("displaced", ("k3",), "k3 is off.", 0.99, 100.0, 1.0, 5),)
    place_all(qtbot, session)
    row = found(panel, QWidget, "mistake_0")
    searcher.go_on.clear()
    session.set_certainty("k3", "unsure")
    qtbot.wait(150)
    assert session.is_searching_mistakes
    assert found(panel, QWidget, "mistake_0") is row
    searcher.go_on.set()
    settle(qtbot, session)
    assert found(panel, QWidget, "mistake_0") is row, "the same mistake keeps its line"


def test_every_order_is_tried_on_demand(
    qtbot: QtBot, searcher: Searcher, session: Session, panel: PosePanel
) -> None:
    place_all(qtbot, session)
    qtbot.mouseClick(found(panel, QPushButton, "mistakes_every_order"), LEFT)
    settle(qtbot, session)
    assert searcher.thorough[-1]
    assert not any(searcher.thorough[:-1])


def test_another_volume_has_none_of_the_mistakes_of_the_last_one(
    qtbot: QtBot, searcher: Searcher, session: Session, panel: PosePanel
) -> None:
    searcher.result = (Mistake("displaced", ("k3",), "k3 is off.", 0.99, 100.0, 1.0, 5),)
    place_all(qtbot, session)
    assert found(panel, QWidget, "mistake_0")
    searcher.go_on.clear()
    session.set_method("boxes")
    qtbot.waitUntil(lambda: session.document is not None and session.document.method == "boxes")
    assert session.mistakes == ()
    assert not session.has_looked_for_mistakes
    # Qt deletes the row once nothing else is to be done.
    qtbot.waitUntil(lambda: panel.findChild(QWidget, "mistake_0") is None)
    assert "Nothing" not in found(panel, QLabel, "mistakes_verdict").text()
    searcher.go_on.set()
