"""Several checkpoints on the same volumes."""

import math
from collections.abc import Mapping, Sequence
from statistics import mean, stdev
from typing import Any

import numpy as np
import pytest
from scipy.stats import wilcoxon

from annotations.agreement.intervals import mean_ci95
from annotations.documents.record import changed, now
from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable, UnjudgedVolume
from annotations.prediction.errors.paired_errors import PairedFigure, paired_errors
from annotations.prediction.prediction import CheckpointReference

TARGETS = ("position_mm", "orientation_deg", "theta1_deg")
KEYPOINTS = ("k0", "k1", "k2")


def row(volume: str, random: np.random.Generator, scale: float) -> ErrorsOfVolume:
    def errors(names: Sequence[str]) -> Mapping[str, float]:
        return {name: float(value) for name, value in zip(names, scale * random.gamma(2, 1, 9), strict=False)}

    return ErrorsOfVolume(
        volume=volume,
        whose="anna",
        presence=1.0,
        targets=errors(TARGETS),
        targets_by_fit=errors(TARGETS),
        keypoints_um=errors(KEYPOINTS),
        keypoints_by_fit_um=errors(KEYPOINTS),
        annotation_sha256=f"{volume:0>64}".replace("v", "0"),
    )


def table(name: str, rows: Sequence[ErrorsOfVolume], **fields: Any) -> ErrorTable:
    checkpoint = CheckpointReference(name=name, sha256=f"{len(name):064x}")
    return ErrorTable(
        title="any", tool="any", checkpoint=checkpoint, rows=tuple(rows), created=now(), **fields
    )


def without(of_volume: ErrorsOfVolume, kind: str, name: str) -> ErrorsOfVolume:
    kept = {each: value for each, value in getattr(of_volume, kind).items() if each != name}
    return changed(of_volume, **{kind: kept})


@pytest.fixture
def tables() -> list[ErrorTable]:
    """Three checkpoints on twelve volumes; some targets are missing here and there."""
    random = np.random.default_rng(3)
    names = [f"v{number}" for number in range(12)]
    found = [
        table(name, [row(volume, random, scale) for volume in names])
        for name, scale in (("Lean", 1.0), ("Wide net", 1.4), ("Best of all", 0.5))
    ]
    first, second, third = (list(each.rows) for each in found)
    second[3] = without(second[3], "targets", "theta1_deg")
    third[5] = without(without(third[5], "targets", "theta1_deg"), "keypoints_um", "k2")
    first[7] = without(first[7], "targets_by_fit", "position_mm")
    return [changed(each, rows=tuple(rows)) for each, rows in zip(found, (first, second, third), strict=True)]


def assert_figure(figure: PairedFigure, of_each: list[list[float | None]]) -> None:
    """Check a figure against plain loops over errors, one list a checkpoint, None for none."""
    chosen = [
        place for place in range(len(of_each[0])) if all(errors[place] is not None for errors in of_each)
    ]
    values = [[errors[place] or 0.0 for place in chosen] for errors in of_each]
    for found, expected in zip(figure.errors, values, strict=True):
        assert found.n == len(chosen)
        assert found.mean == pytest.approx(mean(expected))
        assert found.sd == pytest.approx(stdev(expected))
    for found_test, expected in zip(figure.differences, values[1:], strict=True):
        differences = [other - one for one, other in zip(values[0], expected, strict=True)]
        assert found_test.difference.mean == pytest.approx(mean(differences))
        assert found_test.difference.sd == pytest.approx(stdev(differences))
        assert found_test.difference.ci95 == pytest.approx(mean_ci95(np.array(differences)))
        assert found_test.p_value == pytest.approx(wilcoxon(differences).pvalue)
    any_has = [any(errors[place] is not None for errors in of_each) for place in range(len(of_each[0]))]
    assert list(figure.absent) == [
        sum(errors[place] is None and any_has[place] for place in range(len(errors))) for errors in of_each
    ]


def test_the_figures_are_those_of_plain_loops(tables: list[ErrorTable]) -> None:
    found = paired_errors(tables)

    assert found.volumes == tuple(f"v{number}" for number in range(12))
    assert [each.name for each in found.checkpoints] == ["Lean", "Wide net", "Best of all"]
    for name in TARGETS:
        assert_figure(
            found.by_formulas.targets[name], [[each.targets.get(name) for each in one.rows] for one in tables]
        )
        assert_figure(
            found.by_fit.targets[name],
            [[each.targets_by_fit.get(name) for each in one.rows] for one in tables],
        )
    for name in KEYPOINTS:
        assert_figure(
            found.by_formulas.keypoints_um[name],
            [[each.keypoints_um.get(name) for each in one.rows] for one in tables],
        )
    assert found.by_formulas.targets["theta1_deg"].absent == (0, 1, 1)
    assert found.by_formulas.targets["theta1_deg"].errors[0].n == 10


def test_mean_distances_are_over_the_keypoints_that_all_have(tables: list[ErrorTable]) -> None:
    found = paired_errors(tables).by_formulas.mean_keypoint_um

    expected: list[list[float | None]] = []
    for one in tables:
        of_one: list[float | None] = []
        for place, each in enumerate(one.rows):
            common = [
                name for name in KEYPOINTS if all(name in other.rows[place].keypoints_um for other in tables)
            ]
            of_one.append(mean(each.keypoints_um[name] for name in common))
        expected.append(of_one)
    assert_figure(found, expected)


def test_volumes_that_one_was_not_judged_on_are_left_out_with_the_reason(tables: list[ErrorTable]) -> None:
    first, second, third = tables
    second = changed(
        second,
        rows=second.rows[2:],
        unjudged=(UnjudgedVolume(volume="v0", reason="its prediction cannot be read"),),
    )
    retold = changed(third.rows[4], annotation_sha256="f" * 64)
    third = changed(third, rows=(*third.rows[:4], retold, *third.rows[5:]))

    found = paired_errors([first, second, third])

    assert found.volumes == ("v2", "v3", *(f"v{number}" for number in range(5, 12)))
    assert {each.volume: each.reason for each in found.left_out} == {
        "v0": "Wide net is not judged on it: its prediction cannot be read",
        "v1": "Wide net is not judged on it",
        "v4": "the checkpoints were held against different annotations of it",
    }
    assert found.by_formulas.targets["position_mm"].errors[0].n == 9


def test_a_checkpoint_does_not_differ_from_itself(tables: list[ErrorTable]) -> None:
    found = paired_errors([tables[0], tables[0]])

    [difference] = found.by_formulas.targets["position_mm"].differences
    assert (difference.difference.mean, difference.difference.ci95) == (0.0, (0.0, 0.0))
    assert (difference.p_value, difference.effect) == (None, None)


def test_without_common_volumes_nothing_is_said(tables: list[ErrorTable]) -> None:
    first, second = (changed(tables[0], rows=tables[0].rows[:3]), changed(tables[1], rows=tables[1].rows[3:]))

    found = paired_errors([first, second])

    assert (found.volumes, len(found.left_out)) == ((), 12)
    assert found.by_formulas.targets == {}
    assert [each.n for each in found.by_fit.mean_keypoint_um.errors] == [0, 0]
    assert not math.isnan(sum(found.by_fit.mean_keypoint_um.absent))


def test_a_table_of_nothing_is_passed_over(tables: list[ErrorTable]) -> None:
    nothing = ErrorTable(title="any", tool="any", created=now())

    assert len(paired_errors([nothing, *tables]).checkpoints) == 3
    assert paired_errors([]).volumes == ()


def test_a_volume_whose_annotation_was_begun_from_a_prediction_is_not_compared(
    tables: list[ErrorTable],
) -> None:
    begun = tables[1].rows[5]
    rows = tuple(changed(row, begun_from=("Lean",)) if row is begun else row for row in tables[1].rows)

    paired = paired_errors([tables[0], changed(tables[1], rows=rows), tables[2]])

    assert begun.volume not in paired.volumes
    assert (begun.volume, "its annotation was begun from a prediction") in [
        (each.volume, each.reason) for each in paired.left_out
    ]
