"""The scene is built in turns: the window answers between them, and what fails is begun again."""

import pytest
from PySide6.QtCore import QTimer
from PySide6.QtGui import QGuiApplication
from pytestqt.qtbot import QtBot

from annotator.scene import opengl
from annotator.scene.scene_view import SceneView
from annotator.session import Session

STEPS = 7


@pytest.fixture
def view(qtbot: QtBot, session: Session) -> SceneView:
    """A view of which nothing is built."""
    view = SceneView(session)
    qtbot.addWidget(view)
    view.resize(100, 80)
    return view


@pytest.fixture
def half_built(view: SceneView) -> SceneView:
    """A view of which VTK's window is there already, and the rest is not."""
    while view._construction.canvas is None:
        assert view._construction.go_on()
    return view


def test_the_window_answers_while_the_scene_is_built(qtbot: QtBot, half_built: SceneView) -> None:
    order: list[str] = []
    half_built.started.connect(lambda: order.append("started"))
    half_built.start_in_turns()
    QTimer.singleShot(0, half_built, lambda: order.append("answered"))
    qtbot.waitUntil(lambda: "started" in order)
    assert order == ["answered", "started"]
    half_built.show()
    qtbot.waitUntil(lambda: half_built.volume_draws > 0)


def test_nothing_is_seen_of_a_scene_that_is_not_there_yet(qtbot: QtBot, half_built: SceneView) -> None:
    assert half_built._construction.canvas is not None
    canvas = half_built._construction.canvas.widget
    with qtbot.waitExposed(half_built):
        half_built.show()
    half_built._construction._turns.drop()
    qtbot.wait(20)
    assert half_built._stage is None
    assert not canvas.isVisible()
    half_built.start()
    qtbot.waitUntil(canvas.isVisible)


def test_who_needs_the_scene_at_once_need_not_wait_for_the_rest(qtbot: QtBot, half_built: SceneView) -> None:
    pictures: list[bool] = []
    half_built.started.connect(lambda: pictures.append(half_built.picture().isNull()))
    half_built.show()
    assert not half_built.picture().isNull()
    half_built.start()
    qtbot.wait(20)
    assert pictures == [False]


def test_closed_halfway_it_is_never_built(qtbot: QtBot, half_built: SceneView) -> None:
    canvas = half_built._construction.canvas
    assert canvas is not None
    half_built.close()
    half_built.shut_down()
    assert not canvas._open
    half_built.start()
    qtbot.wait(20)
    assert half_built._stage is None
    assert half_built.picture().isNull()


def test_a_scene_that_could_not_be_built_is_tried_again(
    half_built: SceneView, monkeypatch: pytest.MonkeyPatch
) -> None:
    from annotator.scene.canvas import Canvas

    def fail(_canvas: Canvas) -> None:
        raise OSError("no such driver")

    with monkeypatch.context() as failing:
        failing.setattr(Canvas, "draw_first", fail)
        for _ in range(2):
            with pytest.raises(OSError, match="no such driver"):
                half_built.start()
    assert half_built._stage is None
    half_built.start()
    assert not half_built.picture().isNull()


def test_each_step_has_a_turn_of_its_own(
    qtbot: QtBot, view: SceneView, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    go_on = view._construction.go_on

    def note_step() -> bool:
        order.append("step")
        # Delivered before the next step only where that has a turn of its own.
        QTimer.singleShot(0, view, lambda: order.append("answered"))
        return go_on()

    monkeypatch.setattr(view._construction, "go_on", note_step)
    with qtbot.waitSignal(view.started):
        view.start_in_turns()
    qtbot.waitUntil(lambda: order.count("answered") == STEPS)
    assert order == ["step", "answered"] * STEPS


@pytest.mark.parametrize("taken", range(STEPS + 1))
def test_it_can_end_after_any_step(qtbot: QtBot, view: SceneView, taken: int) -> None:
    for _ in range(taken):
        view._construction.go_on()
    canvas = view._construction.canvas
    view.shut_down()
    assert view._construction._steps is None
    assert canvas is None or not canvas._open
    view.start_in_turns()
    qtbot.wait(20)
    assert (view._construction.stage is not None) == (taken == STEPS)
    assert view._construction.canvas is canvas


def test_it_can_end_in_the_middle_of_a_step(half_built: SceneView, monkeypatch: pytest.MonkeyPatch) -> None:
    from annotator.scene.canvas import Canvas

    monkeypatch.setattr(Canvas, "make_context", lambda _: half_built.shut_down())
    half_built.start()
    assert half_built._construction.stage is None
    assert half_built._construction.canvas is not None
    assert not half_built._construction.canvas._open


def test_who_asks_for_it_in_a_step_gets_it_after_that(
    half_built: SceneView, monkeypatch: pytest.MonkeyPatch
) -> None:
    from annotator.scene.canvas import Canvas

    asked: list[bool] = []
    make = Canvas.make_context

    def make_context(canvas: Canvas) -> None:
        half_built.start()
        asked.append(half_built._stage is None)
        make(canvas)

    monkeypatch.setattr(Canvas, "make_context", make_context)
    half_built.start()
    assert asked == [True]
    assert not half_built.picture().isNull()


def test_a_canvas_that_could_not_be_taken_in_is_built_again(
    qtbot: QtBot, view: SceneView, monkeypatch: pytest.MonkeyPatch
) -> None:
    from annotator.scene.canvas import Canvas

    closed: list[Canvas] = []
    close, show = Canvas.close, Canvas.show
    failures = [RuntimeError("no room")]

    def fail_once(canvas: Canvas) -> None:
        if failures:
            raise failures.pop()
        show(canvas)

    monkeypatch.setattr(Canvas, "close", lambda canvas: (closed.append(canvas), close(canvas)))
    monkeypatch.setattr(Canvas, "show", fail_once)
    started: list[bool] = []
    view.started.connect(lambda: started.append(True))
    with pytest.raises(RuntimeError, match="no room"):
        view.start()
    assert (len(closed), started) == (1, [])
    view.start()
    assert (len(closed), started) == (1, [True])
    assert not view.picture().isNull()


class AskedWindow:
    """Stands for VTK's window on an X display."""

    def __init__(self) -> None:
        self.times_asked = 0

    def GetDesiredDepth(self) -> int:
        self.times_asked += 1
        return 24


@pytest.mark.parametrize(
    ("platform", "kind", "asks"),
    [("xcb", "", True), ("xcb", "vtkOSOpenGLRenderWindow", False), ("cocoa", "", False)],
)
def test_opengl_is_asked_once_in_a_process_and_only_on_an_x_display(
    monkeypatch: pytest.MonkeyPatch, platform: str, kind: str, asks: bool
) -> None:
    monkeypatch.setattr(QGuiApplication, "platformName", lambda: platform)
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", kind)
    monkeypatch.setattr(opengl.vtk, "vtkXOpenGLRenderWindow", AskedWindow, raising=False)
    opengl.prepare_opengl.cache_clear()
    try:
        first = opengl.prepare_opengl()
        # Each one would be a connection that VTK never closes.
        assert opengl.prepare_opengl() is first
        assert (isinstance(first, AskedWindow) and first.times_asked == 1) == asks
    finally:
        opengl.prepare_opengl.cache_clear()
