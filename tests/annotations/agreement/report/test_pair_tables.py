from typing import Any

import pytest

from annotations.agreement.report.contents import Paragraph
from annotations.agreement.report.outline import outline
from annotations.agreement.report.pair_tables import pairs_table, reliability_table
from annotations.agreement.results import Agreement


@pytest.mark.parametrize(("people", "rows_of_each"), [(2, 1), (3, 3), (8, 3)])
def test_of_each_component_the_three_widest_pairs_are_shown(
    make: Any, people: int, rows_of_each: int
) -> None:
    agreement = make(tuple(f"person {number}" for number in range(people)), methods=("boxes",))

    table = pairs_table(agreement, "boxes")

    assert table is not None
    assert len(table.rows) == rows_of_each * len(agreement.components)
    assert ("3 of 28 pairs; pairs.csv and the JSON file have all" in table.caption) == (people == 8)
    widest = sorted(
        (pair.components["position_x_um"].sd for pair in agreement.methods["boxes"].pairs), reverse=True
    )
    assert [row[3] for row in table.rows[:rows_of_each]] == [f"{sd:.1f}" for sd in widest[:rows_of_each]]


def test_a_correlation_near_one_is_explained_at_its_table(agreement: Agreement) -> None:
    (items,) = [section.items for section in outline(agreement, {}).sections if section.anchor == "pairs"]

    place = items.index(reliability_table(agreement))

    after = items[place + 1]
    assert isinstance(after, Paragraph)
    assert "near 1 even for annotators" in after.text
