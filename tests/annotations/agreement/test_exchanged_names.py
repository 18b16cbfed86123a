import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from annotations.agreement.exchanged_names import ExchangedNames, middle_of_known
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools

BENT_UM = np.array(
    [[0.0, 0, 0], [11_000, 0, 0], [11_450, 0, 200], [15_780, 0, 2700], [15_900, 0, 3200], [15_900, 0, 9200]]
)
"""Forceps with joints at 30° and 60°, or near it."""


def seen(annotators: int, *, seed: int = 0, noise_um: float = 50.0) -> np.ndarray:
    return BENT_UM + np.random.default_rng(seed).normal(0, noise_um, (annotators, 6, 3))


def renamed(positions_um: np.ndarray, who: int, *places: int) -> np.ndarray:
    """Return positions of which one annotator's keypoints k0, k1 … lie where others have these places."""
    changed = positions_um.copy()
    changed[who] = positions_um[who, list(places)]
    return changed


@pytest.mark.parametrize("who", [0, 1, 2])
def test_swap_is_found_whoever_made_it(who: int, forceps: ToolSpecification) -> None:
    found = ExchangedNames(forceps, 250.0).find(renamed(seen(3), who, 0, 1, 3, 2, 4, 5))
    assert found.is_told
    assert [found.cycles(each) for each in range(3)] == [
        ((2, 3),) if each == who else () for each in range(3)
    ]


def test_names_that_are_right_give_positions_as_they_were(forceps: ToolSpecification) -> None:
    sound = seen(3)
    wrong = renamed(sound, 1, 2, 0, 1, 4, 3, 5)
    found = ExchangedNames(forceps, 250.0).find(wrong)
    np.testing.assert_array_equal(found.corrected(wrong), sound)


@settings(max_examples=40)
@given(st.permutations(range(6)), st.integers(0, 100))
def test_any_exchange_of_names_by_one_of_three_is_undone(places: list[int], seed: int) -> None:
    sound = seen(3, seed=seed, noise_um=10.0)
    wrong = renamed(sound, 2, *places)
    found = ExchangedNames(shipped_tools()["magnetic-forceps"], 100.0).find(wrong)
    np.testing.assert_array_equal(found.corrected(wrong), sound)


@pytest.mark.parametrize("who", [0, 1])
def test_of_two_the_lengths_of_the_tool_tell_who_is_right(who: int, forceps: ToolSpecification) -> None:
    found = ExchangedNames(forceps, 250.0).find(renamed(seen(2), who, 0, 1, 3, 2, 4, 5))
    assert found.is_told
    assert found.cycles(who) == ((2, 3),)


def test_of_two_with_a_tool_that_looks_the_same_either_way_nobody_can_tell() -> None:
    needle = shipped_tools()["needle"]
    ends_um = np.array([[0.0, 0, 0], [2000, 0, 0]])
    found = ExchangedNames(needle, 100.0).find(np.stack([ends_um, ends_um[::-1]]))
    assert not found.is_told
    assert sorted(len(found.cycles(who)) for who in (0, 1)) == [0, 1]


def test_what_the_tool_rules_out_is_wrong_though_most_say_so(forceps: ToolSpecification) -> None:
    wrong = renamed(renamed(seen(3), 0, 0, 1, 3, 2, 4, 5), 1, 0, 1, 3, 2, 4, 5)
    found = ExchangedNames(forceps, 250.0).find(wrong)
    assert found.is_told
    assert [len(found.cycles(who)) for who in range(3)] == [1, 1, 0]


def test_keypoint_that_is_merely_far_off_is_not_renamed(forceps: ToolSpecification) -> None:
    positions_um = seen(3)
    positions_um[1, 3] += (0.0, 3000.0, 0.0)
    assert ExchangedNames(forceps, 250.0).find(positions_um).cycles(1) == ()


def test_absent_keypoints_and_annotators_are_no_obstacle(forceps: ToolSpecification) -> None:
    positions_um = renamed(seen(4), 1, 0, 1, 3, 2, 4, 5)
    positions_um[0, 0] = positions_um[1, 5] = positions_um[2, 3] = positions_um[3] = np.nan
    found = ExchangedNames(forceps, 250.0).find(positions_um)
    assert [found.cycles(who) for who in range(4)] == [(), ((2, 3),), (), ()]


def test_median_is_that_of_numpy_where_something_is_known() -> None:
    values = np.random.default_rng(0).normal(size=(5, 6, 3))
    values[np.random.default_rng(1).random((5, 6, 3)) < 0.3] = np.nan
    values[0] = 1.0
    np.testing.assert_allclose(middle_of_known(values), np.nanmedian(values, axis=0))
    assert np.isnan(middle_of_known(np.full((3, 1, 3), np.nan))).all()
