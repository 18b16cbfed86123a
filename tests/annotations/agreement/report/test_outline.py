import hashlib
from typing import Any

from annotations.agreement.report.contents import Note
from annotations.agreement.report.outline import fingerprint, in_words, is_anything_compared, outline
from annotations.agreement.report.tables import annotators_table, scatter_table
from annotations.agreement.results import Agreement
from annotations.documents.record import changed


def test_the_deviation_comes_first_and_the_inputs_last(agreement: Agreement) -> None:
    anchors = [section.anchor for section in outline(agreement, {}).sections]

    assert anchors[0] == "deviation"
    assert anchors[-2:] == ["definitions", "inputs"]
    assert len(set(anchors)) == len(anchors)


def test_what_was_compared_is_said_in_words(make: Any, empty: Agreement) -> None:
    agreement = make(("anna", "ben"), methods=("boxes",), volumes=5)

    assert in_words(agreement) == (
        "2 annotators; by bounding boxes 10 annotations of 5 volumes, of which 5 with at least two "
        "annotators."
    )
    assert is_anything_compared(agreement)
    assert in_words(empty).startswith("Nothing could be compared")
    assert not is_anything_compared(empty)


def test_the_fingerprint_of_all_inputs_does_not_hang_on_their_order(agreement: Agreement) -> None:
    turned = agreement.model_copy(update={"inputs": agreement.inputs[::-1]})
    fewer = agreement.model_copy(update={"inputs": agreement.inputs[:1]})
    line = f"{agreement.inputs[0].sha256}  {agreement.inputs[0].path}\n"

    assert fingerprint(turned) == fingerprint(agreement) != fingerprint(fewer)
    assert fingerprint(fewer) == hashlib.sha256(line.encode()).hexdigest()


def test_figures_of_few_volumes_come_with_a_warning(make: Any, empty: Agreement) -> None:
    def notes(agreement: Agreement) -> list[str]:
        first = outline(agreement, {}).sections[0]
        return [
            item.text
            for item in first.items
            if isinstance(item, Note) and "an interval is rough" in item.text
        ]

    assert ["of 9 volumes only" in note for note in notes(make(volumes=9))] == [True]
    assert notes(make(volumes=10)) == []
    assert notes(empty) == []


def test_who_is_left_out_as_not_blind_is_counted_by_person_where_there_is_one(agreement: Agreement) -> None:
    result = agreement.methods["keypoints"]
    some = [changed(each, not_blind=3 * place) for place, each in enumerate(result.annotators)]
    seen = changed(agreement, methods={"keypoints": changed(result, annotators=tuple(some))})

    table = annotators_table(seen, "keypoints")

    assert [row[table.columns.index("Not blind")] for row in table.rows] == ["0", "3", "6"]
    assert "Not blind" not in annotators_table(agreement, "keypoints").columns


def test_who_began_from_predictions_is_counted_by_person_and_the_figures_are_given_with_it(
    agreement: Agreement,
) -> None:
    result = agreement.methods["keypoints"]
    some = [changed(each, from_prediction=3 * place) for place, each in enumerate(result.annotators)]
    begun = changed(agreement, methods={"keypoints": changed(result, annotators=tuple(some))})

    table = annotators_table(begun, "keypoints")

    assert [row[table.columns.index("From predictions")] for row in table.rows] == ["0", "3", "6"]
    assert "begun from a network's prediction are left out" in table.caption
    assert "From predictions" not in annotators_table(agreement, "keypoints").columns
    [selections] = [each for each in outline(agreement, {}).sections if each.anchor == "selections"]
    assert any("begun from a network's prediction" in item.caption for item in selections.items)  # type: ignore[union-attr]


def test_the_spread_of_an_annotator_is_that_around_the_bias(agreement: Agreement) -> None:
    table = scatter_table(agreement, "boxes")

    assert table.columns[:2] == ("Annotator", "Position x (µm)")
    for row, each in zip(table.rows, agreement.methods["boxes"].annotators, strict=True):
        assert row[1] == f"{each.bias['position_x_um'].sd:.1f}"
        assert row[-1] == f"{each.bias['theta2_deg'].sd:.2f}"
