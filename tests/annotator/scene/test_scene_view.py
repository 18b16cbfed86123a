"""The scene in the hands of a person: clicks place, drags look, and neither does the other's work."""

import gc
import subprocess
import sys
import weakref
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication, QMainWindow
from pytestqt.qtbot import QtBot

from annotator.scene.scene_view import SceneView
from annotator.session import Session

SHAPE, SPACING_UM = (40, 60, 50), (15.9, 13.5, 9.4)
SLAB_TOP_UM = (19.5 * 15.9, 29.5 * 13.5, 20 * 9.4)
AWAY = QPoint(8, 100)
LEFT, MIDDLE, RIGHT = Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton, Qt.MouseButton.RightButton
SHIFT, CTRL = Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier


def test_a_click_proposes_the_surface_and_return_keeps_it(scene) -> None:
    scene.session.set_mode("place")
    scene.session.activate("k0")
    scene.view.look_from("+z")
    scene.click(scene.place_of(SLAB_TOP_UM))
    preview = scene.session.view.preview
    assert preview is not None
    assert preview.keypoint == "k0"
    assert np.abs(np.subtract(preview.position_um, SLAB_TOP_UM) / SPACING_UM).max() <= 1
    assert scene.session.view.crosshair_um == preview.position_um
    assert scene.document_positions == {}
    scene.session.keep_preview()
    assert np.abs(np.subtract(scene.document_positions["k0"], SLAB_TOP_UM) / SPACING_UM).max() <= 1


def test_a_second_click_from_another_angle_settles_the_depth(scene) -> None:
    inside_um = (19 * 15.9, 29 * 13.5, 27 * 9.4)
    scene.session.set_mode("place")
    scene.session.activate("k1")
    scene.view.look_from("+z")
    scene.click(scene.place_of(inside_um))
    assert scene.session.view.preview is not None
    scene.drag(QPoint(100, 100), QPoint(-90, 60))
    assert scene.session.view.preview is not None
    scene.click(scene.place_of(inside_um))
    assert scene.session.view.preview is None
    # A pixel of this picture is some voxels wide.
    assert np.linalg.norm(np.subtract(scene.document_positions["k1"], inside_um)) < 10


def test_a_double_click_while_placing_is_one_click(scene) -> None:
    scene.session.set_mode("place")
    scene.session.activate("k0")
    scene.view.look_from("+z")
    messages: list[str] = []
    scene.session.message_posted.connect(messages.append)
    scene.double_click(scene.place_of(SLAB_TOP_UM))
    assert scene.session.view.preview is not None
    assert messages == []


def test_escape_drops_the_proposal(scene) -> None:
    scene.session.set_mode("place")
    scene.session.activate("k0")
    scene.view.look_from("+z")
    scene.click(scene.place_of(SLAB_TOP_UM))
    assert scene.session.view.preview is not None
    scene.qtbot.keyClick(scene.canvas, Qt.Key.Key_Escape)
    assert scene.session.view.preview is None
    assert scene.document_positions == {}


def test_clicking_a_sphere_while_navigating_activates_it_and_edits_nothing(scene) -> None:
    positions_um = {"k0": (100.0, 150.0, 60.0), "k1": (500.0, 650.0, 380.0)}
    for name, position_um in positions_um.items():
        scene.session.place(position_um, keypoint=name)
    scene.session.set_mode("navigate")
    before = scene.session.document
    for name, position_um in positions_um.items():
        scene.click(scene.place_of(position_um))
        assert scene.session.view.active_part == name
        assert scene.session.view.crosshair_um == position_um
    scene.click(AWAY)
    scene.click(scene.place_of(SLAB_TOP_UM))
    assert scene.session.document is before
    assert scene.session.view.preview is None


def test_a_double_click_while_navigating_brings_the_crosshair(scene) -> None:
    scene.view.look_from("+z")
    before = scene.session.document
    crosshair_um = scene.session.view.crosshair_um
    scene.click(scene.place_of(SLAB_TOP_UM))
    assert scene.session.view.crosshair_um == crosshair_um
    scene.double_click(scene.place_of(SLAB_TOP_UM))
    assert np.abs(np.subtract(scene.session.view.crosshair_um, SLAB_TOP_UM) / SPACING_UM).max() <= 1
    assert scene.session.document is before


@pytest.mark.parametrize("mode", ["navigate", "place"])
@pytest.mark.parametrize(
    ("button", "modifier", "moved"),
    [
        (LEFT, Qt.KeyboardModifier.NoModifier, {"forward", "up"}),
        (LEFT, SHIFT, {"focal_um"}),
        (MIDDLE, Qt.KeyboardModifier.NoModifier, {"focal_um"}),
        (RIGHT, Qt.KeyboardModifier.NoModifier, {"height_um", "focal_um"}),
        (LEFT, CTRL, set()),
    ],
)
def test_drags_look_and_never_edit(scene, mode: str, button, modifier, moved: set[str]) -> None:
    scene.session.place((300.0, 400.0, 188.0), keypoint="k0")
    scene.session.set_mode(mode)
    before, camera, window = scene.session.document, scene.view.camera, scene.session.view.window
    scene.drag(scene.place_of((300.0, 400.0, 188.0)), QPoint(60, 40), button, modifier)
    after = scene.view.camera
    assert scene.session.document is before
    assert scene.session.view.preview is None
    names = ("focal_um", "forward", "up", "height_um", "scope_um", "parallel")
    assert {name for name in names if getattr(camera, name) != getattr(after, name)} == moved
    assert (scene.session.view.window != window) == (modifier == CTRL)


def test_an_unsteady_click_is_a_click(scene) -> None:
    scene.session.set_mode("place")
    scene.session.activate("k0")
    camera = scene.view.camera
    scene.drag(scene.place_of(SLAB_TOP_UM), QPoint(2, 1))
    assert scene.session.view.preview is not None
    assert scene.view.camera == camera


def test_dragging_shifts_the_volume_with_the_mouse(scene) -> None:
    before = scene.place_of(SLAB_TOP_UM)
    scene.drag(QPoint(200, 150), QPoint(40, -30), MIDDLE)
    moved = scene.place_of(SLAB_TOP_UM) - before
    assert abs(moved.x() - 40) <= 1
    assert abs(moved.y() + 30) <= 1


def test_the_wheel_zooms_at_the_cursor(scene) -> None:
    at = scene.place_of(SLAB_TOP_UM)
    height_um = scene.view.camera.height_um
    wheel = QWheelEvent(
        QPointF(at),
        scene.canvas.mapToGlobal(QPointF(at)),
        QPoint(),
        QPoint(0, 240),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(scene.canvas, wheel)
    assert scene.view.camera.height_um < height_um / 1.2
    moved = scene.place_of(SLAB_TOP_UM) - at
    assert moved.manhattanLength() <= 2


def test_the_cursor_shows_the_mode_and_what_can_be_clicked(scene) -> None:
    scene.session.place((100.0, 150.0, 60.0), keypoint="k0")
    scene.session.set_mode("place")
    assert scene.canvas.cursor().shape() == Qt.CursorShape.CrossCursor
    scene.session.set_mode("navigate")
    assert scene.canvas.cursor().shape() == Qt.CursorShape.ArrowCursor
    scene.hover(scene.place_of((100.0, 150.0, 60.0)))
    assert scene.canvas.cursor().shape() == Qt.CursorShape.PointingHandCursor
    scene.hover(AWAY)
    assert scene.canvas.cursor().shape() == Qt.CursorShape.ArrowCursor


def test_keys_go_on_to_the_window(scene) -> None:
    pressed: list[int] = []

    class Window(QMainWindow):
        def keyPressEvent(self, event) -> None:
            pressed.append(event.key())

    window = Window()
    scene.qtbot.addWidget(window)
    # Not reparented: the offscreen platform cannot do that to native widgets.
    view = SceneView(scene.session, window)
    window.setCentralWidget(view)
    window.show()
    view.start()
    for key in (Qt.Key.Key_E, Qt.Key.Key_3, Qt.Key.Key_Left, Qt.Key.Key_Escape):
        scene.qtbot.keyClick(view.focusProxy(), key)
    assert pressed == [Qt.Key.Key_E, Qt.Key.Key_3, Qt.Key.Key_Left, Qt.Key.Key_Escape]
    view.shut_down()


def test_presets_fit_and_close_ups(scene) -> None:
    scene.session.place((100.0, 150.0, 60.0), keypoint="k0")
    scene.view.look_from("-y")
    assert scene.view.camera.forward == pytest.approx((0, -1, 0))
    home_um = scene.view.camera.height_um
    scene.view.zoom_to_keypoint("k0")
    assert scene.view.camera.focal_um == (100.0, 150.0, 60.0)
    assert scene.view.camera.height_um < home_um
    camera = scene.view.camera
    scene.view.zoom_to_keypoint("k5")
    assert scene.view.camera == camera
    scene.view.zoom_to_fit()
    assert scene.view.camera.height_um == pytest.approx(home_um)
    scene.view.set_parallel(False)
    assert not scene.view.camera.parallel
    scene.view.look_from("home")
    assert not scene.view.camera.parallel


def test_a_fitted_volume_stays_fitted_in_another_size(scene) -> None:
    box_um = ((0.0, 0.0, 0.0), (39 * 15.9, 59 * 13.5, 49 * 9.4))

    def fits() -> bool:
        places = [scene.place_of(corner) for corner in product(*zip(*box_um, strict=True))]
        return all(scene.canvas.rect().contains(place) for place in places)

    assert fits()
    scene.view.resize(200, 320)
    assert fits()
    scene.drag(QPoint(100, 100), QPoint(40, 20))
    height_um = scene.view.camera.height_um
    scene.view.resize(120, 320)
    assert scene.view.camera.height_um == height_um


def test_the_camera_stays_from_one_volume_to_an_equal_one(scene, volume_path: Path) -> None:
    other = np.load(volume_path)[::-1].copy()
    longer = np.zeros((60, 60, 50), np.uint8)
    sidecar = volume_path.with_name("v001.npy.volume.toml").read_text()
    for name, data in (("v002", other), ("v003", longer)):
        np.save(volume_path.with_name(f"{name}.npy"), data)
        volume_path.with_name(f"{name}.npy.volume.toml").write_text(sidecar)
    scene.drag(QPoint(100, 100), QPoint(50, 20))
    camera = scene.view.camera
    scene.session.open_path(volume_path.parent)
    for index, stays in ((1, True), (2, False)):
        scene.qtbot.waitUntil(lambda: len(scene.session.items) == 3 and not scene.session.jobs.running)
        scene.session.open_item(index)
        expected = f"v00{index + 1}.npy"
        scene.qtbot.waitUntil(
            lambda name=expected: scene.session.volume is not None and scene.session.volume.path.name == name
        )
        scene.qtbot.waitUntil(lambda: not scene.session.jobs.running)
        scene.view.picture()
        assert (scene.view.camera == camera) == stays


def test_a_close_up_of_a_part_ends_with_its_volume(scene, volume_path: Path) -> None:
    other = volume_path.with_name("v002.npy")
    np.save(other, np.load(volume_path)[::-1].copy())
    sidecar = volume_path.with_name("v001.npy.volume.toml").read_text()
    other.with_name("v002.npy.volume.toml").write_text(sidecar)
    whole_um = scene.view.camera.height_um
    scene.session.place((100.0, 150.0, 60.0), keypoint="k0")
    scene.view.zoom_to_keypoint("k0")
    assert scene.view.camera.height_um < whole_um
    scene.session.open_path(other)
    scene.qtbot.waitUntil(
        lambda: scene.session.volume is not None and scene.session.volume.path.name == other.name
    )
    assert scene.view.camera.height_um == pytest.approx(whole_um)


def test_without_a_volume_there_is_only_the_ground(scene) -> None:
    assert scene.session.close_volume()
    pixels = scene.pixels()
    assert np.all(pixels == pixels[0, 0])
    scene.click(QPoint(100, 100))
    scene.drag(QPoint(100, 100), QPoint(30, 30))


def test_a_grab_shows_the_scene(scene) -> None:
    from PySide6.QtGui import QImage

    picture = scene.view.picture().convertToFormat(QImage.Format.Format_RGB32)
    grabbed = scene.view.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    if QApplication.platformName() == "offscreen":
        assert grabbed == picture
    assert not picture.isNull()


def test_views_come_and_go_without_a_trace(qtbot: QtBot, session: Session) -> None:
    gone: list[weakref.ref] = []
    for number in range(20):
        view = SceneView(session)
        view.resize(100, 80)
        view.show()
        view.start()
        assert not view.picture().isNull()
        if number % 2:
            view.close()
        view.deleteLater()
        gone.append(weakref.ref(view))
        del view
        QApplication.processEvents()
    QApplication.sendPostedEvents(None, 52)  # deferred deletions

    def is_nothing_left() -> bool:
        gc.collect()
        return all(reference() is None for reference in gone)

    # What waits for a turn of its own is passed over in it.
    qtbot.waitUntil(is_nothing_left)
    session.place((1.0, 2.0, 3.0), keypoint="k0")


def test_the_widget_alone_imports_neither_mayavi_nor_vtk() -> None:
    code = (
        "import sys; import annotator.scene.scene_view; "
        "print([name for name in ('mayavi', 'vtk', 'vtkmodules', 'tvtk', 'traits') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
