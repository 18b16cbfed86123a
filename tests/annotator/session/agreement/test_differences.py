import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from annotator.session.agreement.differences import Difference, differences

coordinates = st.floats(-1e5, 1e5)
vectors = st.tuples(coordinates, coordinates, coordinates)


def test_beside_one_other_the_line_leads_to_ones_own() -> None:
    lines = differences(0, {"k0": (0.0, 0.0, 0.0)}, {1: {"k0": (3.0, 4.0, 0.0)}})

    assert lines == (Difference(1, "k0", (3.0, 4.0, 0.0), (0.0, 0.0, 0.0)),)


def test_among_several_each_line_leads_to_the_mean_of_all_with_ones_own() -> None:
    lines = differences(2, {"k0": (0.0, 0.0, 6.0)}, {0: {"k0": (3.0, 0.0, 0.0)}, 1: {"k0": (0.0, 3.0, 0.0)}})

    assert {line.number for line in lines} == {0, 1, 2}
    assert {line.reference_um for line in lines} == {(1.0, 1.0, 2.0)}


def test_without_a_place_of_ones_own_the_others_are_compared_among_each_other() -> None:
    lines = differences(5, {}, {0: {"k0": (0.0, 0.0, 0.0)}, 1: {"k0": (2.0, 0.0, 0.0)}})

    assert [line.number for line in lines] == [0, 1]
    assert lines[0].reference_um == (1.0, 0.0, 0.0)


def test_one_alone_differs_from_nobody() -> None:
    assert differences(0, {}, {1: {"k0": (1.0, 2.0, 3.0)}}) == ()
    assert differences(None, {"k0": (0.0, 0.0, 0.0)}, {1: {"k0": (1.0, 2.0, 3.0)}}) == ()


@given(st.lists(vectors, min_size=3, max_size=20))
def test_the_lines_to_a_mean_add_up_to_nothing(places: list[tuple[float, float, float]]) -> None:
    lines = differences(0, {}, {number: {"k0": place} for number, place in enumerate(places)})

    total = np.sum([np.subtract(line.position_um, line.reference_um) for line in lines], axis=0)
    assert math.hypot(*total) < 1e-4 * len(places)
