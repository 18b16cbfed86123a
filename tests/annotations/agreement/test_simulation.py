"""Simulated annotators are as far apart as their noise says: see `tests.trial.agreement_simulation`."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from annotations.agreement.compared import Material
from annotations.agreement.comparison import compare
from annotations.agreement.deviation import deviations
from annotations.agreement.figures import measured_keypoint
from annotations.agreement.intervals import estimate
from annotations.agreement.measured import Measured, measured_targets
from annotations.documents.record import Method
from tests.trial.agreement_simulation import (
    VOLUMES,
    closed_forms,
    distances_from_truth,
    forceps,
    simulated,
)

STUDIES = 200
# Over 200 × 30 volumes chance alone moves a mean by 0.4 % (positions) to 0.7 % (angles), one standard error.
SEED = 5


def of_each_volume(method: Method, measured: dict[str, Measured]) -> Iterator[tuple[str, np.ndarray, float]]:
    """Yield each statistic of each target: its name, its value in each volume, and its closed form."""
    for name, target in measured.items():
        found = deviations(target)
        for statistic, expected in closed_forms(distances_from_truth(method)[name]).items():
            yield f"{name} {statistic}", getattr(found, statistic), expected


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_over_200_studies_the_means_are_within_1_percent_and_the_intervals_cover(method: Method) -> None:
    compared = simulated(method, STUDIES * VOLUMES, SEED)

    for name, values, expected in of_each_volume(method, dict(measured_targets(compared, forceps()))):
        assert values.mean() == pytest.approx(expected, rel=0.01), name
        intervals = [estimate(study, resamples=500).ci95 for study in values.reshape(STUDIES, VOLUMES)]
        covered = np.mean([low <= expected <= high for low, high in filter(None, intervals)])
        assert 0.90 <= covered <= 0.98, name


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_over_2000_studies_means_of_keypoints_and_their_parts_are_within_1_percent_too(
    method: Method,
) -> None:
    # One standard error is now at most 0.22 %, so that whatever the seed, 1 % is out of the reach of chance.
    compared = simulated(method, 2000 * VOLUMES, SEED + 1)
    measured = dict(measured_targets(compared, forceps()))
    for keypoint in forceps().keypoint_names:
        parts = measured_keypoint(compared, forceps(), keypoint)
        measured |= {f"{keypoint} {part}": values for part, values in parts.items()}

    for name, values, expected in of_each_volume(method, measured):
        assert values.mean() == pytest.approx(expected, rel=0.01), name


def test_the_statistics_follow_from_the_number_of_annotators() -> None:
    compared = simulated("keypoints", 20_000, SEED, annotators=7)
    expected = closed_forms(distances_from_truth("keypoints")["position_um"], annotators=7)
    found = deviations(measured_targets(compared, forceps())["position_um"])

    for statistic, value in expected.items():
        assert getattr(found, statistic).mean() == pytest.approx(value, rel=0.01), statistic


def test_a_whole_study_of_both_methods_is_compared(tmp_path: Path) -> None:
    passes = {
        method: (simulated(method, VOLUMES, SEED + number),)
        for number, method in enumerate(("keypoints", "boxes"))
    }
    material = Material("simulated", tmp_path, forceps(), passes, (), ())

    agreement = compare(material, resamples=200)

    assert set(agreement.methods) == {"keypoints", "boxes"}
    for method, result in agreement.methods.items():
        for name, statistics in result.targets.items():
            expected = closed_forms(distances_from_truth(method)[name])
            assert statistics.published.n == VOLUMES
            # Four standard errors of the mean over one study.
            assert statistics.published.mean == pytest.approx(expected["published"], rel=0.4)
        assert len(result.pairs) == 3
        assert result.reliability["position_x_um"].icc > 0.99
    # Boxes are nearer: the simulated noise of the position is 40 µm by boxes, 54 µm by keypoints.
    assert agreement.method_comparison["position_um"].effect > 0
    assert type(agreement).model_validate_json(agreement.model_dump_json()) == agreement
