"""A prediction on a slice: its marks fade with distance, its heatmaps tint what the plane cuts of them."""

import numpy as np
import pytest
from PySide6.QtCore import QObject, QRectF
from PySide6.QtGui import QColor, QImage
from pytestqt.qtbot import QtBot

from annotations.prediction.heatmap_cloud import HeatmapCloud, heatmap_cloud
from annotator.looks.prediction_marks import REVIEW_LOOKS
from annotator.looks.redrawing import Redrawing, owes_drawing
from annotator.session import Session
from annotator.session.predictions.drawn_prediction import DrawnPrediction, PairLabel
from annotator.session.predictions.predicted import ShownPrediction
from annotator.slices.prediction_painting import PredictionPainter, review_marks, tint
from annotator.slices.projection import Plane
from annotator.slices.slice_view import SliceView
from annotator.slices.viewport import Area, Viewport
from tests.annotator.redrawn import redrawn
from tests.annotator.shown_prediction import show_prediction
from tests.annotator.slices.conftest import POSE
from tests.annotator.slices.test_others_painting import count, painted, pixels

PLANE = Plane.across(0, (400, 200, 200), (10.0, 10.0, 10.0), 2)
VIEWPORT = Viewport.fitted(PLANE, Area(0, 0, 300, 300))
PLACE_UM, OFF_UM = (1000.0, 600.0, 1000.0), (1000.0, 1400.0, 1000.0)
GREEN_RED, BLUE_ORANGE = REVIEW_LOOKS["green_red"], REVIEW_LOOKS["blue_orange"]


def drawn(**fields: object) -> DrawnPrediction:
    return DrawnPrediction("green_red", **fields)  # type: ignore[arg-type]


def above(prediction: DrawnPrediction, index: int = 100, named: tuple[QRectF, ...] = ()) -> QImage:
    painter = PredictionPainter(prediction, VIEWPORT, index)
    return painted(lambda onto: painter.paint_above(onto, named))


def beneath(prediction: DrawnPrediction, index: int = 100) -> QImage:
    return painted(PredictionPainter(prediction, VIEWPORT, index).paint_beneath)


def lit(image: QImage) -> np.ndarray:
    """Return which pixels are bright."""
    return pixels(image).sum(axis=-1) > 300


def brightest(image: QImage) -> int:
    return int(pixels(image).max())


def cloud() -> HeatmapCloud:
    """A ball around `PLACE_UM`, with half of all within 300 µm."""
    axes = np.meshgrid(*(np.arange(41) * 50.0 for _ in range(3)), indexing="ij")
    likelihood = np.exp(-((np.stack(axes, axis=-1) - PLACE_UM) ** 2).sum(axis=-1) / (2 * 200.0**2))
    return HeatmapCloud(likelihood.astype(np.float32), (0.0, 0.0, 0.0), (50.0, 50.0, 50.0), 0.3, 0.02)


def test_marks_are_where_keypoints_are_and_fade_with_distance() -> None:
    on_plane, near, far = (review_marks([PLACE_UM], VIEWPORT, index)[0] for index in (100, 120, 300))

    assert (on_plane.x, on_plane.y) == VIEWPORT.pixel(PLACE_UM)
    assert on_plane.nearness == 1
    assert on_plane.opacity > near.opacity > far.opacity > 0


def test_truth_lies_beneath_and_the_prediction_over_ones_own(qapp: object) -> None:
    prediction = drawn(true_um=(PLACE_UM,), predicted_um=(OFF_UM,))

    assert count(beneath(prediction), GREEN_RED.truth) > 20
    assert count(beneath(prediction), GREEN_RED.prediction) == 0
    assert count(above(prediction), GREEN_RED.prediction) > 20
    assert count(above(prediction), GREEN_RED.truth) == 0


def test_what_is_far_from_the_plane_is_faint_and_thin(qapp: object) -> None:
    prediction = drawn(true_um=(PLACE_UM,), predicted_um=(PLACE_UM,), lines_um=((PLACE_UM, OFF_UM),))

    for paint in (above, beneath):
        assert brightest(paint(prediction, 100)) > brightest(paint(prediction, 300)) > 0


def test_a_line_connects_a_pair(qapp: object) -> None:
    found = above(drawn(lines_um=((PLACE_UM, OFF_UM),)))

    x, y = VIEWPORT.pixel((1000.0, 1000.0, 1000.0))
    assert QColor(found.pixel(round(x), round(y))).red() > 200
    assert count(found, GREEN_RED.prediction) > 100


def test_a_distance_stands_beside_its_mark_and_clear_of_names(qapp: object) -> None:
    label = PairLabel("", 1500.0, (PLACE_UM,))
    free = lit(above(drawn(labels=(label,))))
    rows, columns = np.nonzero(free)
    assert len(rows) > 20
    where = QRectF(columns.min() - 4.0, rows.min() - 4.0, np.ptp(columns) + 8.0, np.ptp(rows) + 8.0)
    moved = lit(above(drawn(labels=(label,)), named=(where,)))

    assert moved.sum() > 20
    assert not (moved & free).any()


def test_a_heatmap_tints_the_plane_where_it_is_likely(qapp: object) -> None:
    made = tint(cloud(), VIEWPORT, 100, GREEN_RED.prediction)
    assert made is not None
    image, area = made
    shown = painted(lambda painter: painter.drawImage(area, image))

    x, y = VIEWPORT.pixel(PLACE_UM)
    at_peak = QColor(shown.pixel(round(x), round(y))).red()
    x, y = VIEWPORT.pixel((1000.0, 600.0, 1350.0))
    beside = QColor(shown.pixel(round(x), round(y))).red()
    assert at_peak > beside > 20
    x, y = VIEWPORT.pixel(OFF_UM)
    assert QColor(shown.pixel(round(x), round(y))).red() == 0


@pytest.mark.parametrize("index", [0, 160, 399])
def test_a_plane_that_does_not_cut_a_heatmap_has_no_tint(qapp: object, index: int) -> None:
    assert tint(cloud(), VIEWPORT, index, GREEN_RED.prediction) is None


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_tint_lies_around_its_keypoint_on_every_plane(
    roomy_views: tuple[SliceView, ...], empty_session: Session, monkeypatch: pytest.MonkeyPatch, axis: int
) -> None:
    shown = show_prediction(monkeypatch, empty_session, POSE)
    place_um = shown.position_um("k2")
    assert place_um is not None
    assert shown.heatmaps is not None
    found = heatmap_cloud(shown.heatmaps, "k2")
    viewport = roomy_views[axis].viewport
    assert found is not None
    assert viewport is not None
    made = tint(found, viewport, viewport.plane.index(place_um), GREEN_RED.prediction)
    assert made is not None
    image, area = made

    opacity = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4)[..., 3]
    row, column = np.argwhere(opacity > 0).mean(axis=0) + 0.5
    x = area.left() + column / image.width() * area.width()
    y = area.top() + row / image.height() * area.height()
    assert (x, y) == pytest.approx(viewport.pixel(place_um), abs=300 * viewport.scale)


def test_a_slice_shows_it_and_hides_it(
    qtbot: QtBot,
    roomy_views: tuple[SliceView, ...],
    empty_session: Session,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    view, session = roomy_views[2], empty_session
    shown: ShownPrediction = show_prediction(monkeypatch, session, POSE)
    place_um = shown.position_um("k1")
    assert place_um is not None
    session.look(crosshair_um=place_um, active_part=None)
    qtbot.waitUntil(lambda: view.is_sharp)

    def grabbed() -> QImage:
        return redrawn(view).grab().toImage().convertToFormat(QImage.Format.Format_RGB32)

    everything = grabbed()
    assert count(everything, GREEN_RED.truth) > 50
    assert count(everything, GREEN_RED.prediction) > 50
    session.look(review_colors="blue_orange")
    assert count(grabbed(), BLUE_ORANGE.prediction) > 50
    session.look(overlays_hidden=True)
    assert count(grabbed(), BLUE_ORANGE.prediction) == 0
    session.look(overlays_hidden=False, review_colors="green_red")
    assert grabbed() == everything
    session.look(maximized="slice2")
    assert grabbed() != everything  # with a legend
    session.toggle_layer("prediction")
    assert count(grabbed(), GREEN_RED.prediction) == 0


def test_where_a_panel_takes_its_room_what_is_predicted_is_drawn_a_turn_later(
    qtbot: QtBot,
    roomy_views: tuple[SliceView, ...],
    empty_session: Session,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    view = roomy_views[2]
    place_um = show_prediction(monkeypatch, empty_session, POSE).position_um("k1")
    assert place_um is not None
    empty_session.look(crosshair_um=place_um, active_part=None)
    qtbot.waitUntil(lambda: view.is_sharp)

    def truth_px() -> int:
        return count(
            redrawn(view).grab().toImage().convertToFormat(QImage.Format.Format_RGB32), GREEN_RED.truth
        )

    assert truth_px() > 50
    view.draw_annotation_apart()
    assert truth_px() > 50  # of the size that it had
    view.setFixedHeight(view.height() - 40)
    assert truth_px() > 50  # by a hand that drags its edge
    view.draw_annotation_apart()
    view.setFixedHeight(view.height() - 40)
    assert truth_px() == 0
    qtbot.waitUntil(lambda: truth_px() > 50)


def test_what_waits_for_a_turn_of_its_own_keeps_it_where_a_panel_takes_its_room(
    qtbot: QtBot, roomy_views: tuple[SliceView, ...], empty_session: Session
) -> None:
    view = roomy_views[2]
    qtbot.waitUntil(lambda: not owes_drawing(view))
    empty_session.volume_changed.emit()
    view.draw_annotation_apart()
    view.setFixedHeight(view.height() - 40)
    assert view.grab()
    turns: list[bool] = []
    others = QObject()
    Redrawing(lambda: turns.append(owes_drawing(view)), others).ask()
    qtbot.waitUntil(lambda: bool(turns))
    assert turns == [True]
    qtbot.waitUntil(lambda: not owes_drawing(view))


def test_a_pair_is_labelled_as_long_as_one_of_its_ends_is_in_sight(qapp: object) -> None:
    gone_um = (PLACE_UM[0], 90_000.0, PLACE_UM[2])

    assert lit(above(drawn(labels=(PairLabel("k5", 1500.0, (gone_um, PLACE_UM)),)))).any()
    assert not lit(above(drawn(labels=(PairLabel("k5", 1500.0, (gone_um, gone_um)),)))).any()
