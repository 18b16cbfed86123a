from collections import Counter
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.errors import UserError
from annotations.interchange.split import SPLITS, SplitRule, split_of, split_rule

volumes = st.lists(
    st.tuples(st.integers(0, 60).map("v{}".format), st.integers(0, 40).map("f{}".format)),
    min_size=1,
    max_size=120,
)
rules = st.builds(
    lambda parts, seed: SplitRule(tuple(part / sum(parts) for part in parts), seed),
    st.tuples(*[st.integers(0, 10)] * 3).filter(any),
    st.integers(0, 5),
)


@given(volumes, rules)
def test_no_volume_and_no_fingerprint_is_in_two_splits(rows: list[tuple[str, str]], rule: SplitRule) -> None:
    split = split_of(rows, rule)

    for part in (0, 1):
        homes: dict[str, set[str]] = {}
        for row, where in zip(rows, split, strict=True):
            homes.setdefault(row[part], set()).add(where)
        assert all(len(home) == 1 for home in homes.values())


@given(volumes, rules, st.randoms())
def test_the_split_does_not_depend_on_the_order_of_the_rows(
    rows: list[tuple[str, str]], rule: SplitRule, random: Random
) -> None:
    shuffled = list(rows)
    random.shuffle(shuffled)

    assert dict(zip(rows, split_of(rows, rule), strict=True)) == dict(
        zip(shuffled, split_of(shuffled, rule), strict=True)
    )


@given(st.integers(1, 200), rules)
def test_the_shares_are_met_to_within_one_volume(count: int, rule: SplitRule) -> None:
    split = Counter(split_of([(f"v{number}", f"f{number}") for number in range(count)], rule))

    # A part with a share of less than a volume may have been given one by another.
    given = sum(0 < share * count < 1 for share in rule.shares)
    for name, share in zip(SPLITS, rule.shares, strict=True):
        assert abs(split[name] - share * count) <= 1 + given
        assert share or not split[name]


@given(volumes, rules)
def test_no_part_with_a_share_is_empty_where_there_are_enough_volumes(
    rows: list[tuple[str, str]], rule: SplitRule
) -> None:
    # As many that share neither id nor fingerprint as there are rows with a number of their own.
    rows = [
        (f"{volume_id} {number}", f"{fingerprint} {number}")
        for number, (volume_id, fingerprint) in enumerate(rows)
    ]
    wanted = [name for name, share in zip(SPLITS, rule.shares, strict=True) if share]

    split = set(split_of(rows, rule))

    assert split <= set(wanted)
    assert len(split) == min(len(wanted), len(rows))


def test_annotations_of_a_volume_weigh_as_one_volume() -> None:
    rows = [(f"v{number}", f"f{number}") for number in range(10) for _ in range(1 + 5 * (number % 2))]

    split = split_of(rows, split_rule([0.5, 0.5], 0))

    assert len({row for row, where in zip(rows, split, strict=True) if where == "train"}) == 5


def test_two_volumes_fill_two_parts_and_two_of_the_same_data_cannot() -> None:
    rule = split_rule([0.9, 0.1], 0)

    assert sorted(split_of([("v1", "f1"), ("v2", "f2")], rule)) == ["train", "validation"]
    assert split_of([("v1", "f1"), ("v2", "f1")], rule) == ("train", "train")


def test_another_seed_gives_another_split() -> None:
    rows = [(f"v{number}", f"f{number}") for number in range(100)]

    splits = {split_of(rows, split_rule([0.8, 0.2], seed)) for seed in range(5)}

    assert len(splits) == 5


def test_the_split_of_a_seed_never_changes() -> None:
    # Files written last year and today are to agree.
    rows = [(f"v{number}", f"f{number}") for number in range(10)]

    split = split_of(rows, split_rule([0.6, 0.2, 0.2], 1))

    assert [where[:2] for where in split] == ["tr", "tr", "tr", "tr", "te", "tr", "te", "va", "va", "tr"]


@pytest.mark.parametrize(
    "shares", [[1.0], [0.8, 0.3], [0.8, 0.2, 0.1], [1.2, -0.2], [float("nan"), 1.0], [0.25] * 4]
)
def test_shares_that_are_no_split_are_refused(shares: list[float]) -> None:
    with pytest.raises(UserError):
        split_rule(shares, 0)
