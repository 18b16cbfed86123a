import hashlib
from typing import Any

from annotations.agreement.report.outline import fingerprint, in_words, is_anything_compared, outline
from annotations.agreement.results import Agreement


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
