import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from annotations.agreement.compared import Compared, Material
from annotations.agreement.comparison import agreement_of, compare, counts
from annotations.agreement.results import Agreement, Figures
from annotations.documents.record import Method
from annotations.documents.standing import STANDINGS
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool import ToolSpecification
from tests.annotations.agreement.written import document, write

RESAMPLES = 100


@pytest.fixture
def noisy(compared_of: Callable[..., Compared], forceps: ToolSpecification) -> Compared:
    """Ten volumes by three annotators, 50 µm off along each axis."""
    shape_um = np.array(
        [(0, 0, 0), (11e3, 0, 0), (11.5e3, 0, 0), (15e3, 3.5e3, 0), (15.2e3, 4e3, 0), (15e3, 1e4, 1e3)]
    )
    made = compared_of(shape_um + np.random.default_rng(1).normal(scale=50.0, size=(10, 3, 6, 3)))
    # Each array is changed by itself.
    return replace(
        made,
        is_done=made.is_done.copy(),
        is_blind=made.is_blind.copy(),
        is_from_prediction=made.is_from_prediction.copy(),
    )


@pytest.fixture
def material_of(forceps: ToolSpecification, tmp_path: Path) -> Callable[..., Material]:
    def made(*passes: Compared) -> Material:
        by_method = {passes[0].method: passes} if passes else {}
        return Material("any", tmp_path, forceps, by_method, (), ())

    return made


def published(figures: Figures, target: str = "position_um") -> float | None:
    return figures.targets[target].published.mean


def test_the_main_figures_are_of_what_was_made_blindly(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    noisy.positions_um[3, 2] += 5000.0
    seen = replace(noisy, is_blind=noisy.is_blind.copy())
    seen.is_blind[3, 2] = False

    all_blind = compare(material_of(noisy), resamples=RESAMPLES).methods["keypoints"]
    one_seen = compare(material_of(seen), resamples=RESAMPLES).methods["keypoints"]

    assert all_blind.with_not_blind is None
    assert one_seen.with_not_blind is not None
    assert published(one_seen.with_not_blind) == published(all_blind)
    assert published(one_seen) < published(all_blind) / 2
    assert one_seen.counts.not_blind == 1
    assert one_seen.counts.keypoints_counted == 29 * 6
    assert one_seen.targets["position_um"].published.n == 10
    who = {each.volume: each.annotators for each in one_seen.volumes}
    assert (len(who["v3"]), len(who["v4"])) == (2, 3)
    assert [(each.documents, each.done, each.not_blind) for each in one_seen.annotators] == [
        (10, 10, 0),
        (10, 10, 0),
        (9, 9, 1),
    ]
    assert [each.active_seconds.n for each in one_seen.annotators] == [10, 10, 9]


def test_what_was_begun_from_a_prediction_is_in_no_main_figure(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    noisy.positions_um[3, 2] += 5000.0
    begun = replace(noisy, is_from_prediction=noisy.is_from_prediction.copy())
    begun.is_from_prediction[3, 2] = True
    # Whoever begins from a prediction has seen it.
    both = replace(begun, is_blind=begun.is_blind.copy())
    both.is_blind[3, 2] = False
    both.is_blind[4, 0] = False

    none = compare(material_of(noisy), resamples=RESAMPLES).methods["keypoints"]
    one = compare(material_of(begun), resamples=RESAMPLES).methods["keypoints"]
    two = compare(material_of(both), resamples=RESAMPLES).methods["keypoints"]

    assert none.with_from_prediction is None
    assert one.with_from_prediction is not None
    assert one.with_not_blind is None
    assert published(one.with_from_prediction) == published(none)
    assert published(one) < published(none) / 2
    assert (one.counts.from_prediction, one.counts.not_blind, one.counts.keypoints_counted) == (1, 0, 174)
    assert [each.from_prediction for each in one.annotators] == [0, 0, 1]
    assert {each.volume: len(each.annotators) for each in one.volumes}["v3"] == 2
    # Each of the two kinds is given by itself, beside what is neither.
    assert (two.counts.from_prediction, two.counts.not_blind, two.counts.keypoints_counted) == (1, 1, 168)
    assert two.with_not_blind is not None
    assert published(two.with_not_blind) == published(one)
    assert published(two.with_from_prediction) > 2 * published(two)


def test_every_figure_is_given_without_points_of_doubt_too(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    noisy.doubtful[:4, 0, 0] = True
    noisy.positions_um[:4, 0, 0] += 5000.0

    result = compare(material_of(noisy), resamples=RESAMPLES).methods["keypoints"]

    assert published(result.without_doubtful) < published(result) / 2
    assert result.counts.keypoints_doubtful == 4
    assert result.keypoints["k0"].distance_um.published.n == 10
    # Two others are left in the four volumes.
    assert result.without_doubtful.keypoints["k0"].distance_um.published.n == 10


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_the_figures_are_given_without_recognised_mistakes_too(
    noisy: Compared, material_of: Callable[..., Material], method: Method
) -> None:
    sound = replace(noisy, method=method)
    swapped = replace(sound, positions_um=sound.positions_um.copy())
    swapped.positions_um[3, 1] = swapped.positions_um[3, 1, [0, 1, 3, 2, 4, 5]]

    without_any = compare(material_of(sound), resamples=RESAMPLES).methods[method]
    result = compare(material_of(swapped), resamples=RESAMPLES).methods[method]

    assert without_any.without_mistakes is None
    assert result.volumes[0].mistaken == ("ben",)
    assert result.without_mistakes is not None
    assert published(result, "theta1_deg") > 5 * (published(without_any, "theta1_deg") or 0.0)
    documents = np.ones((10, 3), dtype=bool)
    documents[3, 1] = False
    expected = compare(material_of(sound.only(documents)), resamples=RESAMPLES).methods[method]
    assert result.without_mistakes == Figures(targets=expected.targets, keypoints=expected.keypoints)


def test_volumes_are_counted_by_their_number_of_annotators(noisy: Compared) -> None:
    noisy.positions_um[0, 1:] = np.nan
    noisy.positions_um[1:3, 2] = np.nan

    assert dict(counts(noisy).volumes_by_annotators) == {2: 2, 3: 7}


def test_what_is_left_out_is_counted(noisy: Compared) -> None:
    noisy.positions_um[0, 0, :5] = np.nan
    noisy.standing[0, 0, :5] = [
        STANDINGS.index(each) for each in ("no_position", "fitted", "predicted", "derived", "synthesized")
    ]
    noisy.is_done[:2, 1] = False
    noisy.has_document[9, 1:] = False
    noisy.positions_um[9, 1:] = np.nan

    found = counts(noisy)

    assert (found.documents, found.volumes, found.volumes_compared, found.unfinished) == (28, 10, 9, 2)
    assert found.keypoints_counted == 28 * 6 - 5
    assert (
        found.keypoints_without_position,
        found.keypoints_fitted,
        found.keypoints_predicted,
        found.keypoints_derived,
        found.keypoints_synthesized,
    ) == (1, 1, 1, 1, 1)


@pytest.mark.parametrize("annotators", [[0], [0, 1]], ids=["one", "two"])
def test_few_annotators_give_none_and_no_crash(
    noisy: Compared, material_of: Callable[..., Material], annotators: Sequence[int]
) -> None:
    few = only_people(noisy, annotators)

    agreement = compare(material_of(few), resamples=RESAMPLES)

    estimate = agreement.methods["keypoints"].targets["position_um"].published
    assert estimate.n == (10 if len(annotators) == 2 else 0)
    assert (estimate.mean is None) == (len(annotators) < 2)
    assert_reads_back(agreement)


def test_nothing_at_all_is_an_empty_comparison(material_of: Callable[..., Material]) -> None:
    agreement = compare(material_of())

    assert (agreement.methods, agreement.annotators) == ({}, ())
    assert agreement.targets == ("position_um", "orientation_deg", "theta1_deg", "theta2_deg")
    assert agreement.components[:4] == (
        "position_x_um",
        "position_y_um",
        "position_z_um",
        "orientation_1_deg",
    )
    assert_reads_back(agreement)


def test_repeats_without_a_first_pass_are_compared_with_nothing(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    agreement = compare(material_of(only_volumes(noisy, 0), noisy), resamples=RESAMPLES)

    assert agreement.methods["keypoints"].counts.documents == 0
    assert_reads_back(agreement)


def test_one_volume_has_no_spread_and_no_interval(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    result = compare(material_of(only_volumes(noisy, 1)), resamples=RESAMPLES).methods["keypoints"]

    estimate = result.targets["position_um"].published
    assert estimate.mean is not None
    assert (estimate.sd, estimate.ci95, estimate.n) == (None, None, 1)


def test_annotators_who_agree_exactly_are_at_no_distance(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    noisy.positions_um[:] = noisy.positions_um[:, :1]

    agreement = compare(material_of(noisy), resamples=RESAMPLES)

    assert published(agreement.methods["keypoints"]) == pytest.approx(0.0, abs=1e-9)
    assert_reads_back(agreement)


def test_repeats_tell_how_far_people_are_from_themselves(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    again = only_volumes(noisy, 4)
    again.positions_um[:] += (30.0, 0.0, 40.0)

    intra = compare(material_of(noisy, again), resamples=RESAMPLES).methods["keypoints"].intra

    assert [each.annotator for each in intra] == ["anna", "ben", "cleo", None]
    assert all(each.targets["position_um"].mean == pytest.approx(50.0) for each in intra)
    assert all(each.targets["position_um"].n == 4 for each in intra)


def test_twenty_annotators_are_compared_and_more_refused(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    twenty = only_people(noisy, [0, 1] * 10)
    agreement = compare(material_of(twenty), resamples=RESAMPLES)

    assert len(agreement.methods["keypoints"].pairs) == 190
    with pytest.raises(UserError, match="21 annotators"):
        compare(material_of(only_people(noisy, [0] * 21)))


def test_the_same_material_and_seed_give_the_same_numbers(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    first, second = (compare(material_of(noisy), resamples=RESAMPLES, seed=3).methods for _ in range(2))

    assert first == second


def test_a_comparison_says_how_far_it_is_and_can_be_cancelled(
    noisy: Compared, material_of: Callable[..., Material]
) -> None:
    shares: list[float] = []
    compare(material_of(noisy), resamples=RESAMPLES, progress=shares.append)

    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert all(0 <= share <= 1 for share in shares)
    with pytest.raises(Cancelled):
        compare(material_of(noisy), cancelled=lambda: True)
    noisy.positions_um[3, 2] += 5000.0
    # After the last step the worst volumes are looked into, one by one.
    answers = iter([*[False] * len(set(shares[:-1])), True])
    with pytest.raises(Cancelled):
        compare(material_of(noisy), resamples=RESAMPLES, cancelled=lambda: next(answers))


def test_a_folder_is_collected_and_compared(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no annotation file"):
        agreement_of(tmp_path)


def test_two_who_use_a_method_each_are_compared_in_nothing(tmp_path: Path) -> None:
    for volume in ("v1", "v2"):
        write(tmp_path / f"{volume}.json", document("anna", volume))
        write(tmp_path / f"also {volume}.json", document("ben", volume, "boxes"))

    agreement = agreement_of(tmp_path, resamples=RESAMPLES)

    assert agreement.annotators == ("anna", "ben")
    for method, by_whom in (("keypoints", [2, 0]), ("boxes", [0, 2])):
        result = agreement.methods[method]
        assert {statistics.published.n for statistics in result.targets.values()} == {0}
        assert [each.documents for each in result.annotators] == by_whom
        assert (result.pairs, result.volumes) == ((), ())
    assert {test.difference.n for test in agreement.method_comparison.values()} == {0}


def only_volumes(compared: Compared, number: int) -> Compared:
    """Return the first volumes alone, as arrays of their own."""
    arrays = {
        name: value[:number].copy() for name, value in vars(compared).items() if isinstance(value, np.ndarray)
    }
    return replace(compared, volumes=compared.volumes[:number], **arrays)


def only_people(compared: Compared, columns: Sequence[int]) -> Compared:
    """Return the work of some annotators, whom everybody takes for different people."""
    chosen = np.array(columns, dtype=np.intp)
    arrays = {
        name: value[:, chosen] for name, value in vars(compared).items() if isinstance(value, np.ndarray)
    }
    return replace(compared, annotators=tuple(f"p{number:02}" for number in range(len(columns))), **arrays)


def assert_reads_back(agreement: Agreement) -> None:
    """Check that no number is NaN or infinite, and that files hold everything."""
    text = agreement.model_dump_json()
    assert Agreement.model_validate_json(text) == agreement

    def check(value: object) -> None:
        if isinstance(value, dict | list | tuple):
            for each in value.values() if isinstance(value, dict) else value:
                check(each)
        assert not isinstance(value, float) or math.isfinite(value)

    check(agreement.model_dump())
