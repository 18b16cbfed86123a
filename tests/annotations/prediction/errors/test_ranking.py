"""Where a reviewer should look first."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from annotations.documents.record import changed, now
from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable, HumanFloor
from annotations.prediction.errors.prediction_errors import ErrorFigures
from annotations.prediction.errors.ranking import rank

TARGETS = ("position_mm", "orientation_deg", "theta1_deg")
ROOT_HALF = math.sqrt(0.5)


def row(volume: str, whose: str = "consensus", **fields: Any) -> ErrorsOfVolume:
    return ErrorsOfVolume(volume=volume, whose=whose, presence=1.0, **fields)


def table(rows: Sequence[ErrorsOfVolume], human: HumanFloor | None = None) -> ErrorTable:
    return ErrorTable(title="any", tool="any", rows=tuple(rows), human=human, created=now())


def people(
    leave_one_out: Mapping[str, Mapping[str, float]],
    pairwise: Mapping[str, Mapping[str, float]] | None = None,
) -> HumanFloor:
    published = {
        volume: {name: each / 2 for name, each in of.items()} for volume, of in leave_one_out.items()
    }
    return HumanFloor(
        method="keypoints",
        targets={name: ErrorFigures(mean=1.0, n=1) for name in TARGETS},
        volumes=published,
        leave_one_out=leave_one_out,
        pairwise=pairwise or leave_one_out,
        annotators=("anna", "ben"),
    )


def order(ranked_of: ErrorTable) -> list[str]:
    return [each.volume for each in rank(ranked_of)]


def test_the_ratio_is_the_largest_of_the_targets_and_names_it() -> None:
    human = people({"a": {"position_mm": 0.1, "theta1_deg": 1.0}})

    [ranked] = rank(table([row("a", targets={"position_mm": 0.3, "theta1_deg": 5.0})], human))

    assert ranked.ratios == pytest.approx({"position_mm": 3.0, "theta1_deg": 5.0})
    assert ranked.ratio == pytest.approx(5.0)
    assert ranked.target == "theta1_deg"
    assert ranked.floors == pytest.approx({"position_mm": 0.1, "theta1_deg": 1.0})


def test_one_persons_truth_is_held_against_the_distance_of_two_people() -> None:
    human = people({"a": {"position_mm": 0.1}, "b": {"position_mm": 0.1}}, {"a": {"position_mm": 0.2}})
    targets = {"position_mm": 1.0}

    found = {each.volume: each.ratio for each in rank(table([row("a", "anna", targets=targets)], human))}
    settled = {each.volume: each.ratio for each in rank(table([row("a", targets=targets)], human))}
    simulated = {each.volume: each.ratio for each in rank(table([row("a", "truth", targets=targets)], human))}

    assert found["a"] == pytest.approx(5.0)
    assert settled["a"] == simulated["a"] == pytest.approx(10.0)


def test_a_volume_on_which_people_agree_by_chance_has_no_tiny_floor() -> None:
    human = people({"a": {"position_mm": 0.0}, "b": {"position_mm": 0.2}})
    targets = {"position_mm": 1.0}

    found = {each.volume: each for each in rank(table([row(name, targets=targets) for name in "abc"], human))}

    assert found["a"].floors["position_mm"] == pytest.approx(0.1 * ROOT_HALF)
    assert found["b"].floors["position_mm"] == pytest.approx(math.sqrt((0.2**2 + 0.1**2) / 2))
    # Nobody but one annotated it: the study's figure.
    assert found["c"].floors["position_mm"] == pytest.approx(0.1)


def test_without_people_volumes_are_ranked_by_the_medians() -> None:
    rows = [
        row("usual", targets={"position_mm": 0.2, "theta1_deg": 2.0}),
        row("bent", targets={"position_mm": 0.1, "theta1_deg": 9.0}),
        row("far", targets={"position_mm": 0.8, "theta1_deg": 1.0}),
    ]

    ranked = rank(table(rows))

    assert [each.volume for each in ranked] == ["bent", "far", "usual"]
    assert [each.ratio for each in ranked] == [None] * 3
    assert [each.ratio_to_median for each in ranked] == pytest.approx([4.5, 4.0, 1.0])
    assert [each.target for each in ranked][:2] == ["theta1_deg", "position_mm"]


def test_keypoints_that_were_not_found_come_first_and_volumes_without_figures_last() -> None:
    human = people({"a": {"position_mm": 0.1}})
    rows = [
        row("nothing"),
        row("elsewhere", targets={"theta1_deg": 50.0}),
        row("near", targets={"position_mm": 0.01}),
        row("one missing", missing=("k1",)),
        row("two missing", missing=("k1", "k2"), targets={"position_mm": 0.0}),
        row("far", targets={"position_mm": 9.0}),
    ]

    assert order(table(rows, human)) == [
        "two missing", "one missing", "far", "near", "elsewhere", "nothing"
    ]  # fmt: skip


def test_what_rounding_left_is_no_floor() -> None:
    human = people({"a": {"position_mm": 1e-13}})

    [ranked] = rank(table([row("a", targets={"position_mm": 0.1})], human))

    assert (ranked.ratio, dict(ranked.floors)) == (None, {})
    assert ranked.ratio_to_median == 1.0


numbers = st.floats(0.01, 100.0)
by_target = st.dictionaries(st.sampled_from(TARGETS), numbers, min_size=1)
tables = st.lists(by_target, min_size=1, max_size=8).map(
    lambda errors: [row(f"v{place}", targets=targets) for place, targets in enumerate(errors)]
)
floors = st.dictionaries(st.sampled_from([f"v{place}" for place in range(8)]), by_target)


@given(tables, floors)
def test_every_volume_is_ranked_once_by_a_ratio_that_follows_from_error_and_floor(
    rows: list[ErrorsOfVolume], apart: dict[str, dict[str, float]]
) -> None:
    ranked = rank(table(rows, people(apart)))

    assert sorted(each.volume for each in ranked) == sorted(each.volume for each in rows)
    errors = {each.volume: each.targets for each in rows}
    for each in ranked:
        for name, floor in each.floors.items():
            of_study = np.mean([targets[name] for targets in apart.values() if name in targets])
            assert floor >= 0.999 * ROOT_HALF * of_study
        for name, ratio in each.ratios.items():
            assert ratio == pytest.approx(errors[each.volume][name] / each.floors[name])
        assert (each.ratio is None) == (not set(errors[each.volume]) & set(each.floors))
    known = [each.ratio for each in ranked if each.ratio is not None]
    assert known == sorted(known, reverse=True)
    assert all(each.ratio is None for each in ranked[len(known) :])


@given(tables, floors, st.integers(0, 7), numbers)
def test_a_larger_error_never_ranks_a_volume_lower(
    rows: list[ErrorsOfVolume], apart: dict[str, dict[str, float]], place: int, more: float
) -> None:
    place %= len(rows)
    human = people(apart)
    before = order(table(rows, human)).index(f"v{place}")
    targets = {name: error + more for name, error in rows[place].targets.items()}
    worse = [changed(each, targets=targets) if at == place else each for at, each in enumerate(rows)]

    if rank(table(rows, human))[before].ratio is not None:
        assert order(table(worse, human)).index(f"v{place}") <= before


@given(tables, floors, st.sampled_from([0.001, 1000.0]))
def test_the_order_does_not_depend_on_the_unit(
    rows: list[ErrorsOfVolume], apart: dict[str, dict[str, float]], factor: float
) -> None:
    def scaled(targets: Mapping[str, float]) -> dict[str, float]:
        return {name: value * (factor if name == "position_mm" else 1.0) for name, value in targets.items()}

    before = rank(table(rows, people(apart)))
    after = rank(
        table(
            [changed(each, targets=scaled(each.targets)) for each in rows],
            people({volume: scaled(targets) for volume, targets in apart.items()}),
        )
    )

    known = {each.volume: each.ratio for each in before}
    for each in after:
        assert (each.ratio is None) == (known[each.volume] is None)
        assert each.ratio is None or each.ratio == pytest.approx(known[each.volume])


def test_volumes_that_are_alike_stay_in_their_order() -> None:
    names = ["b", "c", "a"]
    assert order(table([row(name, targets={"position_mm": 1.0}) for name in names])) == names
    assert order(table([row(name) for name in names])) == names
