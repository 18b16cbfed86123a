from hypothesis import given
from hypothesis import strategies as st

from annotations.documents.study import CONSENSUS
from annotator.session.agreement.annotator_names import in_order, initials

names = st.lists(st.text("abcxyz0123 ", min_size=1, max_size=8), min_size=1, max_size=20, unique=True)


def test_whoever_is_listed_comes_first_and_the_consensus_last() -> None:
    found = ["zoe", "Ben", "anna", CONSENSUS, "carl"]

    assert in_order(found, ["zoe", "nobody"]) == ("zoe", "anna", "Ben", "carl", CONSENSUS)


def test_initials_are_the_same_once_there_is_a_consensus() -> None:
    people = ["anna", "carla"]

    before, after = initials(people), initials([*people, CONSENSUS])
    assert {name: after[name] for name in people} == before
    assert after[CONSENSUS] not in before.values()


def test_one_letter_is_enough_where_it_tells() -> None:
    assert initials(["anna", "ben", "chloe"]) == {"anna": "A", "ben": "B", "chloe": "C"}


def test_those_who_begin_alike_are_told_apart_by_where_they_differ() -> None:
    assert initials(["rater01", "rater02", "zoe"]) == {"rater01": "R1", "rater02": "R2", "zoe": "Z"}
    assert initials(["anna", "alex"]) == {"anna": "AN", "alex": "AL"}


@given(names)
def test_initials_are_short_and_different(annotators: list[str]) -> None:
    made = initials(annotators)

    assert list(made) == annotators
    assert len(set(made.values())) == len(annotators)
    assert all(1 <= len(short) <= 3 for short in made.values())
