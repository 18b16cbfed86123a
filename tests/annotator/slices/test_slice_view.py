"""What slice views show: the right voxel at the right pixel, planes, zoom, and what the cursor meets."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QObject, QPoint, QRect, Qt
from PySide6.QtGui import QColor, QImage, QPaintEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from annotator.looks.redrawing import owes_drawing
from annotator.session import Session
from annotator.slices.annotation_layer import AnnotationLayer
from annotator.slices.fetching import SliceFetcher
from annotator.slices.slice_view import CANVAS, SliceView
from annotator.slices.viewport import fitting_scale
from tests.annotator.conftest import write_volume
from tests.annotator.redrawn import redrawn

Views = tuple[SliceView, SliceView, SliceView]


def open_sharp(qtbot: QtBot, session: Session, views: Views, path: Path) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(path)
    qtbot.waitUntil(lambda: not session.jobs.running and all(view.is_sharp for view in views))


def image_of(view: SliceView) -> QImage:
    return redrawn(view).grab().toImage()


def color_at(view: SliceView, position_um: tuple[float, float, float]) -> QColor:
    assert view.viewport is not None
    x, y = view.viewport.pixel(position_um)
    return image_of(view).pixelColor(int(x), int(y))


@pytest.mark.parametrize("axis", range(3))
def test_a_bright_voxel_is_drawn_where_it_lies_and_nowhere_else(
    qtbot: QtBot, empty_session: Session, empty_views: Views, bright_voxel_path: Path, axis: int
) -> None:
    open_sharp(qtbot, empty_session, empty_views, bright_voxel_path)
    voxel, spacing_um = np.array([7, 41, 12]), np.array([30.0, 13.5, 9.4])
    view = empty_views[axis]
    empty_session.look(crosshair_um=tuple(voxel * spacing_um), window=(0.0, 255.0), overlays_hidden=True)
    qtbot.waitUntil(lambda: view.is_sharp)
    view.set_scale(1.1)

    assert color_at(view, tuple(voxel * spacing_um)).lightness() > 200
    for other in range(3):
        for way in (-1, 1):
            if other != axis:
                beside = voxel.copy()
                beside[other] += way * 2
                assert color_at(view, tuple(beside * spacing_um)).lightness() < 20
    # The voxel is as large as it is: its inner edge is bright, just beyond it is dark.
    for other in view.in_plane_axes:
        inner, outer = voxel.astype(float), voxel.astype(float)
        inner[other] += 0.35
        outer[other] += 0.65
        assert color_at(view, tuple(inner * spacing_um)).lightness() > 200
        assert color_at(view, tuple(outer * spacing_um)).lightness() < 20


@pytest.mark.parametrize("axis", range(3))
def test_the_neighbouring_planes_do_not_show_the_voxel(
    qtbot: QtBot, empty_session: Session, empty_views: Views, bright_voxel_path: Path, axis: int
) -> None:
    open_sharp(qtbot, empty_session, empty_views, bright_voxel_path)
    index = np.array([7, 41, 12])
    index[axis] += 1
    position_um = tuple(index * np.array([30.0, 13.5, 9.4]))
    empty_session.look(crosshair_um=position_um, window=(0.0, 255.0), overlays_hidden=True)
    qtbot.waitUntil(lambda: empty_views[axis].is_sharp)

    assert color_at(empty_views[axis], position_um).lightness() < 20


def test_shapes_are_physical(views: Views, session: Session) -> None:
    """The slab of 20 × 30 × 15 voxels is 318 × 405 × 141 µm, on the screen as in the sample."""
    session.look(overlays_hidden=True, window=(0.0, 255.0))
    corners = {0: (10, 30), 1: (15, 45), 2: (20, 35)}
    for view in views:
        across, down = view.in_plane_axes
        assert view.viewport is not None
        gray = image_of(view).convertToFormat(QImage.Format.Format_Grayscale8)
        pixels = np.frombuffer(gray.constBits(), np.uint8).reshape(gray.height(), gray.bytesPerLine())
        bright = pixels[:, : gray.width()] > 120
        columns, rows = bright.any(axis=0).sum(), bright.any(axis=1).sum()
        spacing_um = (15.9, 13.5, 9.4)
        for seen, axis in ((columns, across), (rows, down)):
            first, last = corners[axis]
            assert seen == pytest.approx((last - first) * spacing_um[axis] * view.viewport.scale, abs=2)


def test_views_say_who_they_are(views: Views) -> None:
    assert [view.objectName() for view in views] == ["slice_view_0", "slice_view_1", "slice_view_2"]
    assert [view.accessibleName() for view in views] == [
        "Slice across x",
        "Slice across y",
        "Slice across z",
    ]
    assert all(view.focusPolicy() == Qt.FocusPolicy.StrongFocus for view in views)


def test_nothing_open_is_an_empty_canvas(empty_views: Views) -> None:
    for view in empty_views:
        assert view.is_sharp
        assert view.viewport is None
        assert image_of(view).pixelColor(200, 150) == CANVAS


def test_closing_the_volume_empties_the_views(views: Views, session: Session) -> None:
    session.close_volume()

    assert all(view.viewport is None for view in views)
    assert image_of(views[0]).pixelColor(200, 150) == CANVAS


def test_the_crosshair_names_the_planes(views: Views, session: Session) -> None:
    session.look(crosshair_um=(12 * 15.9, 20 * 13.5, 45 * 9.4))

    assert [view.index for view in views] == [12, 20, 45]
    header = views[0]._header(views[0].viewport)  # type: ignore[arg-type]
    assert header.plane == ("y–z plane · x = 0.191 mm (12/39)", "x 12/39 · 0.191 mm", "x 12/39")
    assert views[0].accessibleDescription() == header.plane[0]


def test_the_header_says_what_a_click_places(views: Views, session: Session) -> None:
    def placing() -> str:
        return views[0]._header(views[0].viewport).placing  # type: ignore[arg-type]

    assert placing() == ""
    session.set_mode("place")
    assert placing() == "place k0"
    session.place((200.0, 300.0, 200.0))
    session.activate("k0")
    session.set_locked("k0", True)
    assert placing() == "k0 is locked"


def test_wheel_scrolls_one_plane_and_ten_with_shift(views: Views, session: Session, hand: Any) -> None:
    hand.wheel(views[0], -120)
    assert views[0].index == 21
    hand.wheel(views[0], 240)
    assert views[0].index == 19
    hand.wheel(views[0], -120, modifiers=Qt.KeyboardModifier.ShiftModifier)
    assert views[0].index == 29
    hand.wheel(views[0], -1200, modifiers=Qt.KeyboardModifier.ShiftModifier)
    assert views[0].index == 39, "it stops at the last plane"
    assert [view.index for view in views[1:]] == [30, 25], "the others stay"
    assert session.view.crosshair_um[0] == pytest.approx(39 * 15.9)


def test_small_turns_of_a_fine_wheel_add_up(views: Views, hand: Any) -> None:
    for _ in range(3):
        hand.wheel(views[2], -30)
    assert views[2].index == 25
    hand.wheel(views[2], -30)
    assert views[2].index == 26
    hand.wheel(views[2], -90)
    hand.wheel(views[2], 60)
    hand.wheel(views[2], 60)
    assert views[2].index == 25, "turning back starts anew"


def test_zooming_at_the_cursor_keeps_what_is_there_and_zooms_the_others(views: Views, hand: Any) -> None:
    at = QPoint(250, 120)
    before = hand.position_um(views[0], at)
    assert views[0].viewport is not None
    scale = views[0].viewport.scale

    for _ in range(4):
        hand.wheel(views[0], 120, at, Qt.KeyboardModifier.ControlModifier)

    assert views[0].viewport.scale == pytest.approx(scale * 1.2**4)
    assert hand.position_um(views[0], at) == pytest.approx(before, abs=1e-6)
    assert views[0].index == 20, "zooming does not scroll"
    for view in views[1:]:
        assert view.viewport is not None
        assert view.viewport.scale == pytest.approx(
            max(views[0].viewport.scale, fitting_scale(view.viewport.plane, view.viewport.area))
        )


def test_fitting_shows_the_whole_plane_again(views: Views, hand: Any) -> None:
    hand.wheel(views[1], 360, None, Qt.KeyboardModifier.ControlModifier)
    assert views[1].viewport is not None
    assert not views[1].viewport.is_fitted

    views[1].fit()

    assert views[1].viewport.is_fitted


@pytest.mark.parametrize(
    ("button", "modifiers"),
    [
        (Qt.MouseButton.MiddleButton, Qt.KeyboardModifier.NoModifier),
        (Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ShiftModifier),
    ],
)
def test_panning_moves_the_image_with_the_hand_and_nothing_else(
    views: Views, session: Session, hand: Any, button: Qt.MouseButton, modifiers: Qt.KeyboardModifier
) -> None:
    hand.wheel(views[0], 360, None, Qt.KeyboardModifier.ControlModifier)
    start, end = QPoint(200, 150), QPoint(230, 140)
    under, view_before = hand.position_um(views[0], start), session.view

    hand.drag(views[0], start, QPoint(210, 145), end, button=button, modifiers=modifiers)

    assert hand.position_um(views[0], end) == pytest.approx(under, abs=1e-6)
    assert session.view == view_before


def test_a_jump_brings_the_crosshair_back_in_sight(views: Views, session: Session, hand: Any) -> None:
    for _ in range(12):
        hand.wheel(views[2], 120, None, Qt.KeyboardModifier.ControlModifier)
    assert views[2].viewport is not None
    far = (39 * 15.9, 2 * 13.5, 25 * 9.4)
    assert not views[2].viewport.shows(far)

    session.look(crosshair_um=far)

    assert views[2].viewport.shows(far)


def test_the_cursor_reads_out_the_file(qtbot: QtBot, views: Views, session: Session, hand: Any) -> None:
    assert session.volume is not None
    array = np.load(session.volume.path)
    at = hand.pixel(views[1], (10 * 15.9, 0.0, 40 * 9.4))

    with qtbot.waitSignal(views[1].cursor_moved, check_params_cb=lambda _, text: bool(text)) as blocker:
        hand.move(views[1], at)

    position_um, intensity = blocker.args
    index = tuple(round(value / step) for value, step in zip(position_um, (15.9, 13.5, 9.4), strict=True))
    assert index == (10, 30, 40)
    assert intensity == str(array[index])


def test_the_cursor_reads_out_anew_when_the_plane_changes_under_it(
    views: Views, session: Session, hand: Any
) -> None:
    told: list[tuple[object, str]] = []
    hand.move(views[2], QPoint(200, 150))
    views[2].cursor_moved.connect(lambda position, text: told.append((position, text)))

    hand.wheel(views[2], -120, QPoint(200, 150))

    assert told
    assert told[-1][0][2] == pytest.approx(26 * 9.4)  # type: ignore[index]


def test_edits_and_looking_at_the_plane_do_not_draw_the_image_again(views: Views, session: Session) -> None:
    def drawn() -> list[int]:
        return [image_of(view) and view.times_drawn for view in views]

    before = drawn()
    session.activate("k2")
    session.place(session.view.crosshair_um)
    session.set_certainty("k2", "unsure")
    session.set_mode("place")
    session.look(overlays_hidden=True)

    assert drawn() == before

    session.look(window=(3.0, 77.0))
    assert drawn() == [count + 1 for count in before]


def test_where_the_plane_stays_only_the_crosshair_is_drawn_again(
    qtbot: QtBot, views: Views, session: Session
) -> None:
    session.place(session.view.crosshair_um, keypoint="k2")
    window = views[2].window()
    qtbot.waitUntil(lambda: all(view.is_sharp for view in views) and not owes_drawing(window))
    QApplication.processEvents()
    noted = Noted()
    views[2].installEventFilter(noted)
    x_um, y_um, z_um = session.view.crosshair_um

    for step in range(1, 4):
        session.look(crosshair_um=(x_um + 40.0 * step, y_um - 30.0 * step, z_um))
        QApplication.processEvents()

    everything = views[2].width() * views[2].height()
    assert noted.pixels
    assert max(noted.pixels) < everything / 10
    on_screen = views[2].screen().grabWindow(views[2].window().winId()).toImage()
    shown = on_screen.copy(QRect(views[2].mapTo(views[2].window(), QPoint()), views[2].size()))
    assert shown.convertToFormat(QImage.Format.Format_RGB32) == image_of(views[2]).convertToFormat(
        QImage.Format.Format_RGB32
    )

    session.look(crosshair_um=(x_um, y_um, z_um + 9.4))
    QApplication.processEvents()
    assert noted.pixels[-1] == everything


class Noted(QObject):
    """Notes how many pixels each painting of a widget is asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.pixels: list[int] = []

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QPaintEvent):
            self.pixels.append(sum(rect.width() * rect.height() for rect in event.region()))
        return False


def test_overlays_hide_together_and_layers_one_by_one(views: Views, session: Session) -> None:
    session.place((20 * 15.9, 5 * 13.5, 5 * 9.4), keypoint="k0")
    session.place((20 * 15.9, 50 * 13.5, 45 * 9.4), keypoint="k1")
    session.look(crosshair_um=(20 * 15.9, 30 * 13.5, 25 * 9.4))
    everything = image_of(views[0])
    session.look(overlays_hidden=True)
    bare = image_of(views[0])
    assert bare != everything
    session.look(overlays_hidden=False)
    for layer in ("crosshair", "names", "links", "axes", "scale_bar"):
        session.toggle_layer(layer)  # type: ignore[arg-type]
        assert image_of(views[0]) != everything, layer
        session.toggle_layer(layer)  # type: ignore[arg-type]
    assert image_of(views[0]) == everything


def test_crosshair_lines_have_the_colours_of_the_axes_and_a_gap(views: Views, session: Session) -> None:
    session.look(layers=frozenset({"crosshair"}), window=(1000.0, 2000.0))
    view = views[0]
    assert view.viewport is not None
    x, y = (int(value) for value in view.viewport.pixel(session.view.crosshair_um))
    image = image_of(view)

    vertical = max((image.pixelColor(x + d, y - 60) for d in (-1, 0, 1)), key=lambda c: c.lightness())
    horizontal = max((image.pixelColor(x - 60, y + d) for d in (-1, 0, 1)), key=lambda c: c.lightness())
    assert vertical.green() > max(vertical.red(), vertical.blue()), "the cut across y is green"
    assert horizontal.blue() > max(horizontal.red(), horizontal.green()), "the cut across z is blue"
    assert image.pixelColor(x, y) == QColor("black")


def test_colours_come_from_the_colour_map(views: Views, session: Session) -> None:
    session.look(overlays_hidden=True, colormap="inferno", window=(0.0, 400.0))

    middle = color_at(views[2], session.view.crosshair_um)

    assert middle.red() > middle.green() > 0
    assert middle.red() - middle.green() > 60


def test_a_view_follows_the_widget(qtbot: QtBot, session: Session, fetcher: SliceFetcher) -> None:
    view = SliceView(session, 0, fetcher)
    qtbot.addWidget(view)
    view.resize(300, 200)
    view.show()
    view.resize(700, 500)
    assert view.viewport is not None
    assert view.viewport.is_fitted
    assert (view.viewport.area.width, view.viewport.area.height) == (700, 500)


def test_the_image_of_another_volume_goes_before_what_is_annotated_in_it(
    qtbot: QtBot, session: Session, views: Views, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log: list[str] = []
    paint = AnnotationLayer.paint

    def painted(layer: AnnotationLayer, *arguments: Any) -> None:
        if layer is view._layer:
            log.append("annotation")
        paint(layer, *arguments)

    class Paintings(QObject):
        def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
            if event.type() == QEvent.Type.Paint:
                log.append("image")
            return False

    view = redrawn(views[2])
    qtbot.waitUntil(lambda: view.isVisible() and not owes_drawing(view.window()))
    monkeypatch.setattr(AnnotationLayer, "paint", painted)
    paintings = Paintings(view)
    view.installEventFilter(paintings)

    def begin() -> None:
        if session.volume is not None:
            log.clear()
            # What is painted at once, as the window does.
            view.repaint()

    session.volume_changed.connect(begin)
    # Nothing is placed in it: after the image nothing else has it painted.
    open_sharp(qtbot, session, views, write_volume(volume_path.with_name("other.npy"), seed=1))
    qtbot.waitUntil(lambda: log[-1] == "annotation")
    assert log[:2] == ["image", "image"]
    assert log[-2:] == ["image", "annotation"]
    # Also where no slice arrives that would have it painted.
    qtbot.waitUntil(lambda: view.is_sharp and not owes_drawing(view.window()))
    view._on_session_volume_changed()
    view.repaint()
    log.clear()
    qtbot.waitUntil(lambda: "annotation" in log)
