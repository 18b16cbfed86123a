from typing import Any

import pytest

from annotations.agreement.report.cautions import (
    factors_paragraph,
    from_prediction_note,
    mistakes_note,
    unequal_numbers_note,
)
from annotations.agreement.report.contents import Table
from annotations.agreement.report.outline import outline
from annotations.agreement.results import Agreement, VolumeResult
from annotations.documents.record import changed


def with_mistakes(agreement: Agreement, number: int) -> Agreement:
    volumes = tuple(
        VolumeResult(volume=f"v{place}", annotators=("anna", "ben"), mistakes=("ben: k2 and k3 are swapped",))
        for place in range(number)
    )
    methods = {method: changed(result, volumes=volumes) for method, result in agreement.methods.items()}
    return changed(agreement, methods=methods)


def with_numbers(agreement: Agreement, numbers: dict[int, int]) -> Agreement:
    return changed(
        agreement,
        methods={
            method: changed(result, counts=changed(result.counts, volumes_by_annotators=numbers))
            for method, result in agreement.methods.items()
        },
    )


@pytest.fixture(scope="module")
def plain(make: Any) -> Agreement:
    agreement: Agreement = make(("anna", "ben", "chiara"), methods=("keypoints",))
    return agreement


def test_recognised_mistakes_are_named_below_the_main_table(plain: Agreement) -> None:
    agreement = with_mistakes(plain, 1)
    note = mistakes_note(agreement)

    assert note is not None
    assert note.text == "Recognised mistakes: v0: ben: k2 and k3 are swapped."
    main, below, without, *_ = outline(agreement, {}).sections[0].items
    assert isinstance(main, Table)
    assert main.is_main
    assert below == note
    assert isinstance(without, Table)
    assert "without the annotations in which a mistake was recognised" in without.caption
    figures = agreement.methods["keypoints"].without_mistakes
    assert figures is not None
    assert without.rows[0][1].startswith(f"{figures.targets['position_um'].published.mean:.1f} [")


def test_of_many_mistakes_five_are_named_and_the_others_counted(plain: Agreement) -> None:
    note = mistakes_note(with_mistakes(plain, 8))

    assert note is not None
    assert "v4: ben" in note.text
    assert "v5" not in note.text
    assert "and 3 more, which stand in volumes.csv and among the worst volumes" in note.text


def test_where_there_are_two_methods_a_mistake_has_its_own(make: Any) -> None:
    note = mistakes_note(with_mistakes(make(("anna", "ben")), 1))

    assert note is not None
    assert "swapped (keypoints); v0: ben: k2 and k3 are swapped (bounding boxes)." in note.text


def test_without_mistakes_nothing_is_said_of_them(plain: Agreement, empty: Agreement) -> None:
    assert mistakes_note(with_mistakes(plain, 0)) is None
    assert mistakes_note(empty) is None


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({3: 12}, "and √2 of it: here 0.82, 1.22 and 1.41 with 3 annotators. Compare"),
        (
            {2: 4, 3: 8},
            "here 0.71, 1.41 and 1.41 with 2 annotators and 0.82, 1.22 and 1.41 with 3 annotators. Compare",
        ),
        (
            {2: 1, 3: 1, 4: 1, 20: 9},
            "here 0.71, 1.41 and 1.41 with 2 annotators and 0.97, 1.03 and 1.41 with 20 annotators. Compare",
        ),
        ({}, "and √2 of it. Compare"),
    ],
)
def test_each_statistic_has_its_factor(plain: Agreement, numbers: dict[int, int], words: str) -> None:
    assert words in factors_paragraph(with_numbers(plain, numbers)).text


def test_volumes_of_different_numbers_of_annotators_are_told(plain: Agreement) -> None:
    note = unequal_numbers_note(with_numbers(plain, {2: 2, 3: 6}))

    assert note is not None
    assert (
        "Keypoints: 2 volumes have 2 annotators and 6 have 3; for equal noise the deviation of 2 is 0.87 of"
        in (note.text)
    )
    assert unequal_numbers_note(with_numbers(plain, {3: 8})) is None


def test_whose_work_was_begun_from_a_prediction_is_named_and_counted(plain: Agreement) -> None:
    result = plain.methods["keypoints"]
    people = tuple(changed(each, from_prediction=2 * place) for place, each in enumerate(result.annotators))
    counts = changed(result.counts, from_prediction=6)
    agreement = changed(plain, methods={"keypoints": changed(result, annotators=people, counts=counts)})

    note = from_prediction_note(agreement)

    assert note is not None
    assert "By keypoints: 6 (ben 2 and chiara 4)." in note.text
    assert note in outline(agreement, {}).sections[0].items
    assert from_prediction_note(plain) is None
