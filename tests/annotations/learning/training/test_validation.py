"""Errors on volumes that the network did not learn from."""

from dataclasses import replace

import numpy as np
import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.geometry.targets import target_arrays  # noqa: E402
from annotations.learning.losses.objective import Found, HeatmapObjective  # noqa: E402
from annotations.learning.settings.loss_settings import LossSettings  # noqa: E402
from annotations.learning.training.validation import ValidationErrors, compare, validate  # noqa: E402
from annotations.prediction.errors.prediction_errors import error_figures, prediction_errors, summarise  # noqa: E402
from annotations.prediction.heatmaps import encode  # noqa: E402
from tests.annotations.learning.tiny_training import TOOL, examples, tiny_settings  # noqa: E402

SETTINGS = tiny_settings()
TRUE_UM = np.stack([one.keypoints_um for one in examples(3)])


def found(keypoints_um: np.ndarray) -> Found:
    return Found(target_arrays(keypoints_um, TOOL), keypoints_um)


def test_a_tool_that_is_moved_is_off_by_that_much_and_not_turned() -> None:
    errors = compare(found(TRUE_UM + np.array([3000.0, 0.0, 4000.0])), TRUE_UM, TOOL)
    assert errors.keypoints_mm == pytest.approx(5.0)
    assert errors.targets["position_mm"] == pytest.approx(5.0)
    for name in ("orientation_deg", "theta1_deg", "theta2_deg"):
        assert errors.targets[name] == pytest.approx(0.0, abs=1e-5)
    figures = errors.figures()
    assert figures["share_over_2_mm"] == 1.0
    assert figures["position_mm_mean"] == pytest.approx(5.0)
    assert errors.summary()["position_mm"] == pytest.approx((5.0, 0.0))


def test_without_keypoints_a_degree_counts_as_in_the_loss() -> None:
    targets = {"position_mm": np.array([0.2, 0.4]), "theta1_deg": np.array([3.0, 5.0])}
    errors = ValidationErrors(targets, None)
    assert errors.score == pytest.approx(0.3 + 4.0 * LossSettings().mm_per_degree)
    assert errors.far_share is None


def test_a_keypoint_that_is_not_found_counts_as_far_off() -> None:
    seen = TRUE_UM.copy()
    seen[0, 0] = np.nan
    errors = compare(found(seen), TRUE_UM, TOOL)
    assert errors.score == pytest.approx(10 / 18)
    assert errors.figures()["share_over_2_mm"] == errors.far_share == pytest.approx(1 / 18)
    overview = summarise(prediction_errors(seen, TRUE_UM, TOOL), TOOL)
    assert overview.far_share == pytest.approx(errors.far_share)
    assert np.isnan(errors.targets["position_mm"]).tolist() == [True, False, False]


def test_a_keypoint_beyond_the_range_is_rightly_not_found_and_wrongly_found() -> None:
    seen = TRUE_UM + np.array([0.0, 0.0, 3000.0])
    seen[0, 0] = np.nan
    is_in_range = np.ones(seen.shape[:2], dtype=bool)
    is_in_range[0, :2] = False
    errors = compare(Found(target_arrays(seen, TOOL), seen, is_in_range), TRUE_UM, TOOL)
    assert errors.keypoints_mm is not None
    assert np.isnan(errors.keypoints_mm[0, 0])
    assert errors.keypoints_mm[0, 1] == pytest.approx(3.0)
    assert errors.score == pytest.approx(3.0)


def test_a_network_is_not_asked_for_what_lies_beyond_its_input() -> None:
    (one,) = examples(1)
    moved = replace(one, keypoints_um=one.keypoints_um + np.array([30_000.0, 0.0, 0.0]))
    objective = HeatmapObjective(SETTINGS, TOOL, torch.device("cpu"))
    shape = SETTINGS.heatmaps.heatmap_shape(SETTINGS.sampling.padded_shape)
    nothing = torch.full((2, len(TOOL.keypoint_names), *shape), -30.0)

    errors = validate(lambda _inputs: nothing, objective, TOOL, [one, moved], batch=2)  # type: ignore[arg-type]

    assert errors.score == 10.0
    assert errors.keypoints_mm is not None
    assert np.isinf(errors.keypoints_mm[0]).all()
    assert np.isnan(errors.keypoints_mm[1]).all()


def test_a_keypoint_of_which_nothing_is_known_does_not_count() -> None:
    true = TRUE_UM.copy()
    true[1, 2] = np.nan
    errors = compare(found(TRUE_UM + np.array([0.0, 0.0, 1000.0])), true, TOOL)
    assert errors.score == pytest.approx(1.0)
    assert np.isnan(errors.targets["theta1_deg"]).tolist() == [False, True, False]


def test_where_nothing_is_found_there_are_no_means() -> None:
    errors = compare(found(np.full_like(TRUE_UM, np.nan)), TRUE_UM, TOOL)
    assert np.isnan(errors.figures()["position_mm_mean"])
    assert errors.summary() == {}
    assert errors.score == 10.0


def test_the_deviation_is_that_of_the_tables_of_errors() -> None:
    seen = TRUE_UM[:2].copy()
    seen[1] += np.array([0.0, 0.0, 2000.0])
    errors = compare(found(seen), TRUE_UM[:2], TOOL)
    values = errors.targets["position_mm"]
    figures = error_figures(values, np.isnan(values))
    assert errors.summary()["position_mm"] == pytest.approx((figures.mean, figures.sd))


def test_a_network_that_knows_the_keypoints_has_no_error() -> None:
    some = examples(3)
    objective = HeatmapObjective(SETTINGS, TOOL, torch.device("cpu"))
    sampling, convention = SETTINGS.sampling, SETTINGS.heatmaps
    shape = convention.heatmap_shape(sampling.padded_shape)
    heatmaps = [
        encode(
            convention.to_heatmap(sampling.to_index(one.keypoints_um, one.spacing_um), sampling.padded_shape),
            shape,
            convention,
        )
        for one in some
    ]
    outputs = iter(torch.tensor(np.stack(heatmaps[first : first + 2])) for first in (0, 2))

    errors = validate(lambda _inputs: next(outputs), objective, TOOL, some, batch=2)  # type: ignore[arg-type]

    assert errors.volumes == 3
    assert errors.score < 0.02
