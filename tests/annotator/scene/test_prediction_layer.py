"""A prediction in the scene: over the kept picture of the volume, told apart by form, never met."""

from itertools import combinations

import numpy as np
import pytest
from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QFont, QImage, QPainter

from annotations.prediction.heatmap_cloud import heatmap_cloud
from annotator.looks.label_places import label_areas
from annotator.looks.prediction_marks import (
    REVIEW_LOOKS,
    distance_text,
    legend_place,
    paint_legend,
    paint_prediction,
    paint_truth,
)
from annotator.scene.colors import rgb
from annotator.scene.heatmap_layer import surface
from annotator.scene.prediction_layer import mark_picture
from annotator.session.predictions.predicted import ShownPrediction
from annotator.session.viewing.view import Layer
from tests.annotator.scene.conftest import POSE, Scene, pixels
from tests.annotator.shown_prediction import show_prediction

GREEN_RED, BLUE_ORANGE = REVIEW_LOOKS["green_red"], REVIEW_LOOKS["blue_orange"]
ENTRIES = [
    ("truth", "truth (ben)"),
    ("prediction", "prediction (" + 40 * "forceps" + ")"),
    ("cloud", "heatmap"),
]


@pytest.fixture
def predicted(monkeypatch: pytest.MonkeyPatch, roomy: Scene) -> ShownPrediction:
    shown = show_prediction(monkeypatch, roomy.session, POSE)
    roomy.session.look(layers=roomy.session.view.layers - {"heatmaps"}, active_part=None)
    roomy.settle()
    return shown


def count(found: np.ndarray, color: object) -> int:
    """Count the pixels of a colour."""
    return int((np.abs(found - rgb(color)).sum(axis=-1) < 30).sum())  # type: ignore[arg-type]


def test_truth_and_prediction_are_there_in_their_colors(roomy: Scene, predicted: ShownPrediction) -> None:
    seen = roomy.pixels()

    assert count(seen, GREEN_RED.truth) > 50
    assert count(seen, GREEN_RED.prediction) > 50
    roomy.session.look(review_colors="blue_orange")
    seen = roomy.pixels()
    assert count(seen, GREEN_RED.truth) == 0
    assert count(seen, BLUE_ORANGE.truth) > 50
    assert count(seen, BLUE_ORANGE.prediction) > 50


def test_marks_are_where_the_keypoints_are(roomy: Scene, predicted: ShownPrediction) -> None:
    roomy.session.look(layers=frozenset({"prediction", "truth"}))
    seen = roomy.pixels()
    for pair in predicted.pairs:
        assert pair.true_um is not None
        assert pair.predicted_um is not None
        for place_um, color in ((pair.predicted_um, GREEN_RED.prediction), (pair.true_um, GREEN_RED.truth)):
            at = roomy.place_of(place_um)
            around = seen[at.y() - 3 : at.y() + 4, at.x() - 3 : at.x() + 4]
            assert count(around, color) > 0, (pair.name, color.name())


@pytest.mark.parametrize("layer", ["truth", "errors", "distances", "predicted_tool", "names"])
def test_a_layer_hides_its_own_and_the_volume_is_not_drawn_again(
    roomy: Scene, predicted: ShownPrediction, layer: Layer
) -> None:
    everything, draws = roomy.pixels(), roomy.view.volume_draws
    roomy.session.toggle_layer(layer)
    without = roomy.pixels()
    roomy.session.toggle_layer(layer)

    assert not np.array_equal(everything, without)
    assert np.array_equal(roomy.pixels(), everything)
    assert roomy.view.volume_draws == draws


def test_without_its_layer_nothing_is_left(
    monkeypatch: pytest.MonkeyPatch, roomy: Scene, predicted: ShownPrediction
) -> None:
    roomy.session.toggle_layer("prediction")

    seen = roomy.pixels()
    assert count(seen, GREEN_RED.prediction) == count(seen, GREEN_RED.truth) == 0


def test_a_heatmap_is_a_cloud_around_its_keypoint(roomy: Scene, predicted: ShownPrediction) -> None:
    roomy.session.look(layers=frozenset({"prediction"}))
    without, draws = roomy.pixels(), roomy.view.volume_draws
    roomy.session.look(layers=frozenset({"prediction", "heatmaps"}), active_part="k0")
    one = np.abs(roomy.pixels() - without).sum(axis=-1) > 0
    roomy.session.look(active_part=None)
    everyone = np.abs(roomy.pixels() - without).sum(axis=-1) > 0

    for pair in predicted.pairs:
        assert pair.predicted_um is not None
        at = roomy.place_of(pair.predicted_um)
        around = slice(at.y() - 9, at.y() + 10), slice(at.x() - 9, at.x() + 10)
        assert everyone[around].mean() > 0.6, (pair.name, at)
        assert pair.name != "k0" or one[around].mean() > 0.6
        assert pair.name != "k5" or one[around].mean() == 0
    assert roomy.view.volume_draws == draws


def test_a_click_on_a_prediction_activates_nothing(roomy: Scene, predicted: ShownPrediction) -> None:
    before = roomy.session.document, roomy.session.view.active_part
    place_um = predicted.position_um("k3")
    assert place_um is not None
    roomy.click(roomy.place_of(place_um))

    assert (roomy.session.document, roomy.session.view.active_part) == before


def test_the_camera_goes_to_a_keypoint_that_is_only_predicted(
    roomy: Scene, predicted: ShownPrediction
) -> None:
    roomy.view.zoom_to_keypoint("k2")

    assert roomy.view.camera is not None
    assert roomy.view.camera.focal_um == pytest.approx(predicted.position_um("k2"))


def test_nested_surfaces_are_closed_around_the_keypoint(predicted: ShownPrediction) -> None:
    assert predicted.heatmaps is not None
    cloud = heatmap_cloud(predicted.heatmaps, "k0")
    assert cloud is not None
    outer, inner = (
        np.array(surface(cloud, level).GetBounds()).reshape(3, 2) for level in (cloud.most, cloud.half)
    )

    assert (outer[:, 0] < inner[:, 0]).all()
    assert (inner[:, 1] < outer[:, 1]).all()
    assert inner.mean(axis=1) == pytest.approx(predicted.position_um("k0"), abs=100)
    assert 200 < surface(cloud, cloud.most).GetNumberOfCells() < 20_000


def test_truth_and_prediction_differ_in_form_too(qapp: object) -> None:
    one, other = (
        pixels(mark_picture(paint, GREEN_RED.truth, 1.0)).sum(axis=-1) > 0
        for paint in (paint_truth, paint_prediction)
    )

    assert (one & other).sum() < 0.5 * min(one.sum(), other.sum())


@pytest.mark.parametrize(
    ("distance_um", "text"), [(0.4, "0 µm"), (310.2, "310 µm"), (999.6, "1.00 mm"), (2345.0, "2.35 mm")]
)
def test_distances_are_written_in_the_unit_that_fits(distance_um: float, text: str) -> None:
    assert distance_text(distance_um) == text


def test_words_stand_apart_and_in_sight(qapp: object) -> None:
    picture = QRectF(0, 0, 300, 200)
    marks = [QRectF(x, 90, 18, 18) for x in (0, 20, 26, 282)]
    places = label_areas([(mark, 60.0, 14.0) for mark in marks], marks, picture)

    assert all(picture.contains(place) for place in places)
    assert not any(place.intersects(mark) for place in places for mark in marks)
    assert not any(one.intersects(other) for one, other in combinations(places, 2))


def test_a_legend_keeps_what_has_room(qapp: object) -> None:
    everything, large = legend_place(ENTRIES, QFont(), QRectF(0, 0, 800, 600))
    few, small = legend_place(ENTRIES, QFont(), QRectF(0, 0, 200, 100), at_top=False)

    assert list(everything) == ENTRIES
    assert list(few) == ENTRIES[:2]
    assert QRectF(0, 0, 800, 600).contains(large)
    assert QRectF(0, 0, 200, 100).contains(small)
    assert small.bottom() > 90 > 20 > large.top()
    image = QImage(200, 100, QImage.Format.Format_RGB32)
    image.fill(0)
    with QPainter(image) as painter:
        paint_legend(painter, small.translated(QPointF()), few, GREEN_RED, QFont())
    found = pixels(image)
    assert count(found, GREEN_RED.truth) > 5
    assert count(found, GREEN_RED.prediction) > 5
