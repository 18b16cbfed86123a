"""What the layers leave of a prediction."""

import numpy as np
import pytest

from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool_library import shipped_tools
from annotations.prediction.volume_heatmaps import VolumeHeatmaps
from annotator.session.editing.solids import posed_solids
from annotator.session.predictions.drawn_prediction import DrawnPrediction, drawn_prediction
from annotator.session.predictions.predicted import KeypointPair, ShownPrediction
from annotator.session.viewing.view import Layer, View

TOOL = shipped_tools()["magnetic-forceps"]
PLACE_UM, NEAR_UM = (1000.0, 2000.0, 3000.0), (1000.0, 2300.0, 3400.0)
HEATMAPS = VolumeHeatmaps(
    ("k0", "k1", "k2"), np.full((3, 2, 2, 2), 0.125, np.float32), (0.0, 0.0, 0.0), (900.0, 900.0, 900.0)
)
SHOWN = ShownPrediction(
    "forceps-3",
    "ben",
    (
        KeypointPair("k0", PLACE_UM, NEAR_UM),
        KeypointPair("k1", None, PLACE_UM),
        KeypointPair("k2", PLACE_UM, None),
    ),
    posed_solids(ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {}), TOOL, "prediction"),
    heatmaps=HEATMAPS,
)
ALL: frozenset[Layer] = View().layers | {"prediction", "heatmaps"}


def drawn(view: View, own_um: dict[str, tuple[float, float, float]] | None = None) -> DrawnPrediction:
    made = drawn_prediction(SHOWN, view, TOOL, own_um or {})
    assert made is not None
    return made


def test_all_layers_show_all() -> None:
    made = drawn(View(layers=ALL))

    assert made.true_um == (PLACE_UM, PLACE_UM)
    assert made.predicted_um == (NEAR_UM, PLACE_UM)
    assert made.lines_um == ((PLACE_UM, NEAR_UM),)
    assert [(label.name, label.distance_um) for label in made.labels] == [
        ("k0", 500.0),
        ("k1", None),
        ("k2", None),
    ]
    assert made.solids == SHOWN.solids
    assert made.clouds == HEATMAPS.names
    assert [sign for sign, _ in made.legend] == ["truth", "prediction", "cloud", "error", "tool"]


@pytest.mark.parametrize(
    ("layer", "sign", "gone"),
    [
        ("truth", "truth", "true_um"),
        ("errors", "error", "lines_um"),
        ("predicted_tool", "tool", "solids"),
        ("heatmaps", "cloud", "clouds"),
    ],
)
def test_a_layer_takes_away_its_own_and_its_line_in_the_legend(layer: Layer, sign: str, gone: str) -> None:
    everything, without = drawn(View(layers=ALL)), drawn(View(layers=ALL - {layer}))

    assert getattr(everything, gone)
    assert not getattr(without, gone)
    assert {sign for sign, _ in everything.legend} - {sign for sign, _ in without.legend} == {sign}


def test_distances_and_names_are_written_apart() -> None:
    own_um = {"k0": PLACE_UM}

    without_names = drawn(View(layers=ALL - {"names"}), own_um)
    assert [(label.name, label.distance_um) for label in without_names.labels] == [("", 500.0)]
    without_distances = drawn(View(layers=ALL - {"distances"}), own_um)
    assert [(label.name, label.distance_um) for label in without_distances.labels] == [
        ("k1", None),
        ("k2", None),
    ]
    assert without_distances.named == frozenset()


def test_a_keypoint_of_ones_own_is_named_once() -> None:
    made = drawn(View(layers=ALL), {"k0": PLACE_UM, "k1": NEAR_UM})

    assert made.named == {"k0"}
    assert [label.name for label in made.labels] == ["k0", "k2"]


def test_ones_own_keypoint_keeps_its_name_where_somebody_else_says_what_is_true() -> None:
    assert drawn(View(layers=ALL), {"k0": NEAR_UM}).named == frozenset()


@pytest.mark.parametrize(
    ("active", "clouds"), [("k1", ("k1",)), ("link0", ("k0", "k1")), ("k5", HEATMAPS.names)]
)
def test_the_heatmap_is_that_of_the_active_part_or_all_are(active: str, clouds: tuple[str, ...]) -> None:
    assert drawn(View(layers=ALL, active_part=active)).clouds == clouds


@pytest.mark.parametrize("view", [View(layers=ALL - {"prediction"}), View(layers=ALL, overlays_hidden=True)])
def test_nothing_is_left_without_the_layer_or_while_overlays_are_hidden(view: View) -> None:
    assert drawn_prediction(SHOWN, view, TOOL, {}) is None
    assert drawn_prediction(None, View(layers=ALL), TOOL, {}) is None


def test_bodies_take_one_color() -> None:
    made = drawn(View(layers=ALL)).solids_in("#123456")

    assert {solid.color for solid in made} == {"#123456"}
    assert [solid.box for solid in made] == [solid.box for solid in SHOWN.solids]


def test_where_to_look_for_a_keypoint() -> None:
    assert SHOWN.position_um("k0") == NEAR_UM
    assert SHOWN.position_um("k2") == PLACE_UM
    assert SHOWN.position_um("k9") is None
