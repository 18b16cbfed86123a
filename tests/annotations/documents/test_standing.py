from typing import Any

import pytest

from annotations.documents.annotation import KeypointAnnotation
from annotations.documents.standing import is_doubtful, standing


def placed(**fields: Any) -> KeypointAnnotation:
    return KeypointAnnotation(
        **{"name": "k0", "state": "placed", "position_um": (1, 2, 3), "source": "clicked"} | fields
    )


@pytest.mark.parametrize("source", ["clicked", "typed", "dragged", "snapped", "refined", "consensus"])
def test_what_a_person_placed_counts(source: Any) -> None:
    assert standing(placed(source=source)) == "counted"


@pytest.mark.parametrize("source", ["fitted", "predicted", "derived", "synthesized"])
def test_what_a_program_placed_and_nobody_moved_does_not(source: Any) -> None:
    part = placed(source=source, certainty="unsure")
    assert standing(part) == source
    assert not is_doubtful(part)


def test_what_has_no_position_does_not_count() -> None:
    assert standing(KeypointAnnotation(name="k0")) == "no_position"


def test_a_person_in_doubt_counts_and_is_told() -> None:
    assert [
        is_doubtful(placed(**fields)) for fields in ({}, {"state": "occluded"}, {"certainty": "unsure"})
    ] == [
        False,
        True,
        True,
    ]
