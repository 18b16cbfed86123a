"""What is on the picture: never a stale volume, never more work than an edit needs."""

from dataclasses import replace
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QColor, QWheelEvent
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from annotations.volumes import write_sidecar
from annotator.looks.theme import apply_theme
from annotator.scene.renderers import is_software
from annotator.scene.scene_view import SceneView
from annotator.session import Session

EXTENT_UM = (40 * 15.9, 60 * 13.5, 50 * 9.4)


def fresh(scene) -> np.ndarray:
    """Return the picture with the volume drawn again, whatever was kept."""
    scene.view._stage.renderers._kept_key = None
    return scene.pixels()


def change_theme(_: object) -> None:
    apply_theme("light")
    QApplication.processEvents()


CHANGES = {
    "camera": lambda scene: scene.view.look_from("-x"),
    "zoom": lambda scene: scene.view.zoom_to_keypoint("k0"),
    "perspective": lambda scene: scene.view.set_parallel(False),
    "window": lambda scene: scene.session.look(window=(0.0, 500.0)),
    "threshold": lambda scene: scene.session.look(opacity_threshold=30.0),
    "colors": lambda scene: scene.session.look(colormap="inferno"),
    "rendering": lambda scene: scene.session.look(rendering="mip"),
    "cropping": lambda scene: scene.session.look(cropping_um=((100.0,) * 3, (300.0,) * 3)),
    "no volume": lambda scene: scene.session.toggle_layer("volume"),
    "theme": change_theme,
    "size": lambda scene: scene.view.resize(300, 260),
}


@pytest.fixture
def dark_theme(qtbot: QtBot):
    apply_theme("dark")
    yield
    apply_theme("dark")


@pytest.mark.parametrize("name", CHANGES)
def test_the_kept_picture_is_never_stale(dark_theme, scene, name: str) -> None:
    scene.session.place((300.0, 400.0, 188.0), keypoint="k0")
    before = scene.pixels()
    CHANGES[name](scene)
    QApplication.processEvents()
    changed = scene.pixels()
    kept = scene.pixels()
    assert changed.shape != before.shape or not np.array_equal(changed, before)
    assert np.array_equal(changed, kept)
    assert np.array_equal(fresh(scene), kept)


def test_another_level_is_drawn(scene) -> None:
    before = scene.pixels()
    with scene.qtbot.waitSignal(scene.session.levels_changed):
        scene.session.look(detail=True)
    scene.qtbot.waitUntil(lambda: scene.session.level.kind == "detail")
    scene.session.look(crosshair_um=scene.session.view.crosshair_um)
    draws = scene.view.volume_draws
    scene.pixels()
    assert scene.view.volume_draws == draws + 1
    scene.session.look(detail=False)
    assert np.array_equal(scene.pixels(), before)


EDITS = {
    "place": lambda session: session.place((300.0, 400.0, 188.0), keypoint="k1"),
    "move": lambda session: session.place((200.0, 300.0, 188.0), keypoint="k0"),
    "undo": lambda session: session.undo_stack.undo(),
    "state": lambda session: session.set_state("k0", "occluded"),
    "unsure": lambda session: session.set_certainty("k0", "unsure"),
    "clear": lambda session: session.clear("k0"),
    "activate": lambda session: session.activate("k0"),
    "crosshair": lambda session: session.look(crosshair_um=(50.0, 60.0, 70.0)),
    "drag": lambda session: session.begin_preview("k0", (400.0, 500.0, 100.0), "dragged"),
    "names": lambda session: session.toggle_layer("names"),
    "axes": lambda session: session.toggle_layer("axes"),
    "scale bar": lambda session: session.toggle_layer("scale_bar"),
    "planes": lambda session: session.toggle_layer("planes"),
    "crosshair off": lambda session: session.toggle_layer("crosshair"),
    "overlays off": lambda session: session.look(overlays_hidden=True),
}


@pytest.mark.parametrize("name", EDITS)
def test_an_edit_shows_over_the_kept_volume(scene, name: str) -> None:
    scene.session.place((100.0, 150.0, 60.0), keypoint="k0")
    before = scene.pixels()
    draws = scene.view.volume_draws
    EDITS[name](scene.session)
    scene.qtbot.wait(0)
    QApplication.processEvents()
    after = scene.pixels()
    assert scene.view.volume_draws == draws
    assert not np.array_equal(after, before)
    assert np.array_equal(fresh(scene), after)


def test_without_opengls_memory_the_volume_is_drawn_anew(scene) -> None:
    before = scene.pixels()
    draws = scene.view.volume_draws
    renderers = scene.view._stage.renderers
    renderers._kept.ReleaseGraphicsResources(renderers._window)

    after = scene.pixels()

    assert scene.view.volume_draws == draws + 1
    assert np.array_equal(after, before)


def test_the_scene_follows_a_moving_crosshair_after_the_slices(scene) -> None:
    scene.settle()
    drawn: list[bool] = []
    draw = scene.view._stage.renderers.draw
    scene.view._stage.renderers.draw = lambda *given, **named: (drawn.append(True), draw(*given, **named))
    for step in range(5):
        scene.session.look(crosshair_um=(10.0 * step, 200.0, 188.0))
        QApplication.processEvents()
    scene.qtbot.waitUntil(lambda: scene.view.is_at_rest)

    # Fewer than there were moves, and the last of them shows.
    assert 1 <= len(drawn) < 5
    scene.view._stage.renderers.draw = draw
    kept = scene.pixels()
    assert np.array_equal(fresh(scene), kept)


def test_an_edit_alone_asks_for_a_frame(scene) -> None:
    scene.pixels()
    before = scene.view.grab().toImage()
    draws = scene.view.volume_draws
    painted: list[bool] = []
    draw = scene.view._stage.renderers.draw
    scene.view._stage.renderers.draw = lambda *given, **named: (painted.append(True), draw(*given, **named))
    scene.session.place((300.0, 400.0, 188.0), keypoint="k0")
    scene.qtbot.waitUntil(lambda: painted != [])
    assert scene.view.volume_draws == draws
    if QApplication.platformName() == "offscreen":
        assert scene.view.grab().toImage() != before


def test_while_the_camera_moves_rays_are_few_and_at_rest_they_are_all(scene) -> None:
    scene.pixels()
    draws = scene.view.volume_draws
    scene.drag(QPoint(100, 100), QPoint(50, 20))
    assert not scene.view.is_at_rest
    scene.settle()
    # Whatever was drawn on the way, the last is what a fresh picture shows.
    assert scene.view.volume_draws >= draws + 2
    at_rest = scene.view.volume_draws
    resting = scene.pixels()
    assert scene.view.volume_draws == at_rest
    assert np.array_equal(fresh(scene), resting)


class Inputs(QObject):
    """Hears what a widget is told of the mouse's wheel before it is handled."""

    def __init__(self, widget: QWidget, order: list[str]) -> None:
        super().__init__(widget)
        self._order = order
        widget.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Wheel:
            self._order.append("input")
        return False


WISHES = {
    "nothing else": lambda _scene: None,
    "an edit": lambda scene: scene.session.place((300.0, 400.0, 188.0), keypoint="k0"),
    "another window": lambda scene: scene.session.look(window=(0.0, 500.0)),
    "the rest": lambda scene: scene.view._on_rest_timeout(),
}


@pytest.mark.parametrize("wish", WISHES)
def test_what_comes_during_a_full_frame_is_handled_before_another_one(scene, wish: str) -> None:
    order: list[str] = []
    Inputs(scene.canvas, order)
    draw, at = scene.view._stage.renderers.draw, QPointF(40, 100)
    wheel = QWheelEvent(
        at,
        scene.canvas.mapToGlobal(at),
        QPoint(),
        QPoint(0, 120),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )

    def draw_noted(*given, final: bool, **named) -> None:
        before = scene.view.volume_draws
        draw(*given, final=final, **named)
        if scene.view.volume_draws > before:
            order.append("full frame" if final else "coarse frame")
        if order[-1:] == ["full frame"] and "input" not in order:
            # As if all this had come while the frame was drawn: the wish first.
            WISHES[wish](scene)
            QApplication.postEvent(scene.canvas, QWheelEvent(wheel))

    scene.view._stage.renderers.draw = draw_noted
    scene.view.look_from("+x")
    scene.qtbot.waitUntil(lambda: "input" in order)
    camera = scene.view.camera
    scene.settle()

    handled = order.index("input")
    assert order[:handled].count("full frame") == 1
    # What it asked for is drawn coarsely first, and then at its best.
    assert order[handled + 1] == "coarse frame"
    assert order[-1] == "full frame"
    assert scene.view.camera == camera


def test_any_number_of_moves_is_one_frame(scene) -> None:
    draws = scene.view.volume_draws
    for _ in range(50):
        scene.view.look_from("+x")
        scene.view.look_from("+y")
    assert scene.view.volume_draws == draws
    scene.settle()
    assert scene.view.volume_draws - draws <= 3


def test_on_a_screen_another_size_is_drawn_once_and_after_what_is_around_the_scene(scene) -> None:
    canvas = scene.view._stage.canvas
    # As on a screen, where the frame does not pass through Qt.
    canvas._painted = False
    scene.view.resize(300, 260)
    draws = scene.view.volume_draws
    assert not scene.view.is_at_rest
    # The system asks for what it has uncovered.
    scene.canvas.update()
    QApplication.processEvents()
    assert scene.view.volume_draws == draws
    scene.qtbot.waitUntil(lambda: scene.view.volume_draws > draws)
    assert canvas.window.GetSize() == (300, 260)
    scene.settle()
    assert scene.view.volume_draws == draws + 2
    assert np.array_equal(fresh(scene), scene.pixels())


def test_on_a_screen_a_scene_that_was_hidden_draws_another_volume_in_a_turn_of_its_own(scene) -> None:
    scene.settle()
    canvas = scene.view._stage.canvas
    canvas._painted = False
    scene.view.hide()
    canvas.draw_apart()
    scene.qtbot.wait(20)
    scene.view.show()
    drawn = scene.view.volume_draws
    canvas.draw_apart()
    assert canvas._is_asked
    scene.session.look(window=(5.0, 60.0))
    canvas.widget.repaint()
    assert scene.view.volume_draws == drawn
    scene.qtbot.waitUntil(lambda: scene.view.volume_draws > drawn)


@pytest.mark.parametrize("news", ["volume_changed", "predicting.shown_changed"])
def test_on_a_screen_what_all_views_show_anew_is_drawn_here_in_a_turn_of_its_own(scene, news: str) -> None:
    scene.settle()
    canvas, drawings = scene.view._stage.canvas, []
    canvas._painted = False
    draw = canvas._draw
    canvas._draw = lambda: (drawings.append(None), draw())
    attrgetter(news)(scene.session).emit()
    # What is to be painted in this turn, the slices among it.
    canvas.widget.repaint()
    assert not drawings
    scene.qtbot.waitUntil(lambda: len(drawings) == 1)


def test_on_a_screen_the_scene_comes_into_sight_with_its_frame_and_goes_with_what_is_behind(scene) -> None:
    scene.settle()
    canvas = scene.view._stage.canvas
    canvas._painted = False
    for _ in range(2):
        # Asked for, but hidden before it comes to that.
        canvas.draw_apart()
        canvas._turn.draw_now()
        scene.view.hide()
        assert canvas.widget.isHidden()
        scene.view.show()
        assert canvas.widget.isHidden(), "what is behind it is painted first"
        scene.qtbot.waitUntil(canvas.widget.isVisible)
        scene.settle()
    assert np.array_equal(fresh(scene), scene.pixels())


def test_with_overlays_hidden_only_the_volume_is_seen(scene) -> None:
    scene.session.look(overlays_hidden=True)
    bare = scene.pixels()
    scene.session.place((300.0, 400.0, 188.0), keypoint="k0")
    assert np.array_equal(scene.pixels(), bare)
    scene.session.look(overlays_hidden=False)
    assert not np.array_equal(scene.pixels(), bare)


@pytest.mark.parametrize("zoom", [1.0, 0.3])
def test_spheres_keep_their_size_and_stand_where_the_keypoint_is(scene, zoom: float) -> None:
    position_um = (100.0, 150.0, 60.0)
    scene.session.look(layers=frozenset(), active_part=None)
    scene.session.place(position_um, keypoint="k2")
    scene.session.activate(None)
    camera = scene.view.camera
    scene.view.zoom_to_keypoint("k2")
    scene.view._set_camera(replace(scene.view.camera, height_um=camera.height_um * zoom))
    pixels = scene.pixels()
    # The colour of link 1 is orange; the ground has hardly any red.
    rows, columns = np.nonzero(pixels[..., 0] > pixels[..., 2] + 60)
    assert np.ptp(columns) + 1 == pytest.approx(14, abs=2)
    assert np.ptp(rows) + 1 == pytest.approx(14, abs=2)
    at = scene.place_of(position_um)
    assert (columns.mean(), rows.mean()) == pytest.approx((at.x(), at.y()), abs=1.5)


def test_the_bright_slab_is_where_the_camera_says(scene) -> None:
    scene.session.look(layers=frozenset({"volume"}), opacity_threshold=100.0)
    scene.view.look_from("+z")
    pixels = scene.pixels().sum(axis=2)
    corners = QRect(
        scene.place_of((10 * 15.9, 15 * 13.5, 200.0)), scene.place_of((29 * 15.9, 44 * 13.5, 200.0))
    )
    rows, columns = np.nonzero(pixels > pixels.max() / 2)
    found = QRect(QPoint(columns.min(), rows.max()), QPoint(columns.max(), rows.min())).normalized()
    expected = corners.normalized()
    for side in ("left", "right", "top", "bottom"):
        assert abs(getattr(found, side)() - getattr(expected, side)()) <= 3, side


def test_a_link_is_drawn_in_its_color(scene) -> None:
    scene.session.look(layers=frozenset({"links"}))
    scene.session.place((100.0, 150.0, 60.0), keypoint="k0")
    scene.session.place((500.0, 600.0, 60.0), keypoint="k1")
    color = QColor(scene.session.tool.link("link0").color)
    middle = scene.place_of((300.0, 375.0, 60.0))
    area = scene.pixels()[middle.y() - 3 : middle.y() + 4, middle.x() - 3 : middle.x() + 4].reshape(-1, 3)
    assert (area == (color.red(), color.green(), color.blue())).all(axis=1).any()


@pytest.mark.parametrize(
    "data",
    [
        np.full((12, 14, 16), 7, np.uint8),
        np.full((12, 14, 16), np.nan, np.float32),
        np.where(np.arange(2688).reshape(12, 14, 16) % 7, 1.0, np.inf).astype(np.float64),
        np.arange(2688).reshape(12, 14, 16).astype(">i2"),
        np.zeros((1, 1, 1), np.uint8),
        np.ones((1, 30, 30), np.uint16),
    ],
    ids=["constant", "nan", "infinite", "signed", "one voxel", "one plane"],
)
def test_whatever_the_volume_holds_can_be_drawn(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, data: np.ndarray
) -> None:
    path = tmp_path / "odd.npy"
    np.save(path, data)
    write_sidecar(path, (10.0, 10.0, 10.0), 2)
    empty_session.open_path(path)
    qtbot.waitUntil(lambda: empty_session.volume is not None and not empty_session.jobs.running)
    view = SceneView(empty_session)
    qtbot.addWidget(view)
    view.resize(200, 150)
    view.show()
    for rendering in ("volume", "mip"):
        empty_session.look(rendering=rendering)
        assert not view.picture().isNull()


@pytest.mark.parametrize(
    ("name", "software"),
    [
        ("llvmpipe (LLVM 15.0.6, 256 bits)", True),
        ("softpipe", True),
        ("Software Rasterizer", True),
        ("Mesa OffScreen, OSMesa", True),
        ("SWR (LLVM 9.0, 256 bits)", True),
        ("Microsoft Basic Render Driver", True),
        ("NVIDIA H200/PCIe/SSE2", False),
        ("Mesa Intel(R) UHD Graphics 620 (KBL GT2)", False),
        ("AMD Radeon RX 6700 XT (radeonsi)", False),
        ("Apple M2", False),
    ],
)
def test_software_renderers_are_known_by_their_names(name: str, software: bool) -> None:
    assert is_software(name) == software


def test_the_mapper_for_gpus_draws_the_same_slab(qtbot: QtBot, session: Session) -> None:
    session.look(layers=frozenset({"volume"}), opacity_threshold=100.0)
    bright = {}
    for renderer in ("software", "gpu"):
        view = SceneView(session, renderer=renderer)
        qtbot.addWidget(view)
        view.resize(160, 120)
        view.show()
        view.look_from("+z")
        image = view.picture()
        bright[renderer] = {
            (x, y)
            for x in range(image.width())
            for y in range(image.height())
            if image.pixelColor(x, y).lightness() > 90
        }
        view.close()
    assert len(bright["software"]) > 1000
    assert len(bright["software"] ^ bright["gpu"]) < 0.1 * len(bright["software"])
