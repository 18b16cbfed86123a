"""What is only read is drawn after what is looked at: once, and always."""

import pytest
from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QPaintEvent
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from annotator.looks.redrawing import HeldPainting, PaintingApart, Redrawing, owes_drawing


class Looked(QWidget):
    """Notes when it is painted."""

    def __init__(self, log: list[str]) -> None:
        super().__init__()
        self._log = log

    def paintEvent(self, _event: QPaintEvent) -> None:
        self._log.append("painted")


@pytest.fixture
def log() -> list[str]:
    """What was painted and drawn."""
    return []


@pytest.fixture
def looked(qtbot: QtBot, log: list[str]) -> Looked:
    """A widget that is shown and painted, with nothing in the log yet."""
    looked = Looked(log)
    qtbot.addWidget(looked)
    with qtbot.waitExposed(looked):
        looked.show()
    qtbot.waitUntil(lambda: bool(log))
    log.clear()
    return looked


def test_any_number_of_wishes_is_one_drawing_in_the_turn_after_the_painting(
    qtbot: QtBot, looked: Looked, log: list[str]
) -> None:
    parent = QObject()
    redrawing = Redrawing(lambda: log.append("drawn"), parent)
    for _ in range(20):
        redrawing.ask()
        looked.update()
    assert log == []
    QApplication.processEvents()
    assert log == ["painted"]
    # The timer that ends the turn; what other timers of that moment ask for comes before it, too.
    QApplication.processEvents()
    assert log == ["painted"]
    qtbot.waitUntil(lambda: len(log) > 1)
    QApplication.processEvents()
    assert log == ["painted", "drawn"]


def test_a_drag_without_end_does_not_starve_it(looked: Looked, log: list[str]) -> None:
    parent = QObject()
    redrawing = Redrawing(lambda: log.append("drawn"), parent)
    for _ in range(30):
        # At every turn of the event loop the next moves are there already.
        for _ in range(3):
            redrawing.ask()
            looked.update()
        QApplication.processEvents()
    assert log.count("painted") >= 30
    assert 8 <= log.count("drawn") <= 30


def test_what_was_drawn_meanwhile_is_not_drawn_again(qtbot: QtBot) -> None:
    drawn: list[str] = []
    parent = QObject()
    redrawing = Redrawing(lambda: drawn.append("drawn"), parent)
    redrawing.draw_now()
    assert drawn == []
    redrawing.ask()
    redrawing.draw_now()
    redrawing.ask()
    redrawing.drop()
    for _ in range(5):
        QApplication.processEvents()
    assert drawn == ["drawn"]
    redrawing.ask()
    qtbot.waitUntil(lambda: len(drawn) == 2)


def test_what_does_not_hurry_has_a_turn_and_its_painting_to_itself(
    qtbot: QtBot, looked: Looked, log: list[str]
) -> None:
    parent = QObject()

    def drawing(name: str) -> Redrawing:
        def draw() -> None:
            log.append(name)
            looked.update()

        return Redrawing(draw, parent)

    first, second, third = (drawing(name) for name in ("first", "second", "third"))
    looked.update()
    for redrawing in (first, second, first, third):
        redrawing.ask_apart()
    assert owes_drawing(parent)
    qtbot.waitUntil(lambda: not owes_drawing(parent) and log[-1] == "painted")
    assert log == ["painted", "first", "painted", "second", "painted", "third", "painted"]


def test_what_is_asked_for_as_usual_does_not_wait_for_its_turn(qtbot: QtBot) -> None:
    drawn: list[str] = []
    parent = QObject()
    many = [Redrawing(lambda: drawn.append("one of many"), parent) for _ in range(20)]
    last = Redrawing(lambda: drawn.append("hurried"), parent)
    for redrawing in (*many, last):
        redrawing.ask_apart()
    last.ask()
    qtbot.waitUntil(lambda: not owes_drawing(parent))
    assert drawn.count("hurried") == 1
    assert drawn.index("hurried") < 5
    assert len(drawn) == 21


def test_what_goes_first_overtakes_what_waits(qtbot: QtBot) -> None:
    drawn: list[str] = []
    parent = QObject()
    for name in ("one", "other"):
        Redrawing(lambda name=name: drawn.append(name), parent).ask_apart()  # type: ignore[misc]
    for name in ("first", "second"):
        Redrawing(lambda name=name: drawn.append(name), parent).ask_apart(first=True)  # type: ignore[misc]
    qtbot.waitUntil(lambda: not owes_drawing(parent))
    assert drawn == ["first", "second", "one", "other"]


def test_a_held_painting_has_a_turn_of_its_own_before_others(
    qtbot: QtBot, looked: Looked, log: list[str]
) -> None:
    painting = HeldPainting(looked)
    other = QObject()
    Redrawing(lambda: log.append("other"), other).ask_apart()
    for _ in range(3):
        painting.ask()
        looked.update()
    QApplication.processEvents()
    assert log == []
    qtbot.waitUntil(lambda: "other" in log)
    assert log == ["painted", "other"]

    looked.update()
    qtbot.waitUntil(lambda: log == ["painted", "other", "painted"])


def test_the_turn_that_asks_is_never_the_one_in_which_it_is_painted(
    qtbot: QtBot, looked: Looked, log: list[str]
) -> None:
    painting = HeldPainting(looked)
    other = QObject()

    def hear() -> None:
        log.append("heard")
        painting.ask()
        looked.update()

    # Heard right before the turn begins that a drawing has waited for.
    timer = QTimer(singleShot=True)
    timer.timeout.connect(hear, Qt.ConnectionType.QueuedConnection)
    timer.start()
    Redrawing(lambda: log.append("other"), other).ask_apart()
    while not log:
        QApplication.processEvents()
    assert log == ["heard"]
    qtbot.waitUntil(lambda: "other" in log)
    assert log == ["heard", "painted", "other"]


@pytest.mark.parametrize("native", [False, True])
def test_what_appears_while_painting_is_held_is_painted_with_the_rest(
    qtbot: QtBot, looked: Looked, log: list[str], native: bool
) -> None:
    shown: list[str] = []
    appearing = Looked(shown)
    appearing.setParent(looked)
    # As all are that the scene's window stands in: the system tells each of them when it is there.
    appearing.setAttribute(Qt.WidgetAttribute.WA_NativeWindow, native)
    if native:
        assert appearing.winId()
    painting = HeldPainting(looked)
    order: list[str] = []
    other = QObject()
    Redrawing(lambda: order.extend((*shown, "other")), other).ask_apart()
    painting.ask()
    painting.show(appearing)
    looked.update()
    QApplication.processEvents()
    assert shown == log == []
    qtbot.waitUntil(lambda: bool(order))
    assert order[0] == "painted"
    assert log


def test_what_appears_at_any_other_time_is_painted_at_once(qtbot: QtBot, looked: Looked) -> None:
    shown: list[str] = []
    appearing = Looked(shown)
    appearing.setParent(looked)
    HeldPainting(looked).show(appearing)
    qtbot.waitUntil(lambda: bool(shown))


def test_a_hidden_window_is_not_held_back(looked: Looked) -> None:
    looked.hide()
    HeldPainting(looked).ask()
    assert not owes_drawing(looked)


def test_what_is_gone_by_its_turn_is_passed_over(qtbot: QtBot) -> None:
    drawn: list[str] = []
    gone, parent = QObject(), QObject()
    for owner, name in ((gone, "gone"), (parent, "there")):
        Redrawing(lambda name=name: drawn.append(name), owner).ask_apart()  # type: ignore[misc]
    gone.deleteLater()
    QApplication.sendPostedEvents(gone, QEvent.Type.DeferredDelete)
    qtbot.waitUntil(lambda: drawn == ["there"])


def test_a_drawing_that_fails_keeps_none_of_the_others_back(qtbot: QtBot) -> None:
    drawn: list[str] = []
    parent = QObject()
    Redrawing(lambda: drawn.remove("what is not there"), parent).ask_apart()
    Redrawing(lambda: drawn.append("next"), parent).ask_apart()
    with qtbot.captureExceptions() as raised:
        qtbot.waitUntil(lambda: drawn == ["next"])
    assert [kind for kind, _, _ in raised] == [ValueError]
    Redrawing(lambda: drawn.append("later"), parent).ask_apart()
    qtbot.waitUntil(lambda: drawn == ["next", "later"])


def test_what_has_changed_as_a_whole_is_painted_in_a_turn_of_its_own(qtbot: QtBot, log: list[str]) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    table = Looked(log)
    table.setParent(window)
    with qtbot.waitExposed(window):
        window.show()
    qtbot.waitUntil(lambda: bool(log))
    log.clear()
    painting = PaintingApart(table)

    for _ in range(3):
        painting.ask()
        table.update()
    QApplication.processEvents()
    assert log == []
    assert owes_drawing(window)

    qtbot.waitUntil(lambda: bool(log))
    assert not owes_drawing(window)
    qtbot.wait(20)
    assert log == ["painted"]
    table.update()
    qtbot.waitUntil(lambda: log == ["painted", "painted"])


def test_what_nobody_sees_is_painted_as_soon_as_it_is_seen(
    qtbot: QtBot, looked: Looked, log: list[str]
) -> None:
    looked.hide()
    PaintingApart(looked).ask()
    assert not owes_drawing(looked)
    looked.show()
    qtbot.waitUntil(lambda: bool(log))
