"""The scene is built in turns: the window answers between them, and what fails is begun again."""

import pytest
from PySide6.QtCore import QTimer
from pytestqt.qtbot import QtBot

from annotator.scene.scene_view import SceneView
from annotator.session import Session


@pytest.fixture
def half_built(qtbot: QtBot, session: Session) -> SceneView:
    """A view of which VTK's window is there already, and the rest is not."""
    view = SceneView(session)
    qtbot.addWidget(view)
    view.resize(100, 80)
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
