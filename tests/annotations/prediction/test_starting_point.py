"""Annotations that are begun from a prediction."""

from pathlib import Path

import pytest

from annotations.documents.annotation import Annotation, VolumeReference, new_annotation
from annotations.documents.edits import EditRefused, accept_predicted, lock, place_keypoint, set_state
from annotations.documents.files import annotation_bytes, parse_annotation
from annotations.documents.record import Method, changed
from annotations.documents.standing import standing
from annotations.documents.volume_link import referenced_path
from annotations.prediction.prediction import Prediction
from annotations.prediction.starting_point import start_from
from tests.annotations.prediction.known_keypoints import FORCEPS, SHA256
from tests.annotations.prediction.made_predictions import TRUE_UM, VOLUME, made_prediction

PREDICTION_PATH = Path("/s/predictions/Known/v001.json")
ANNOTATION_PATH = Path("/s/annotations/anna/v001.keypoints.json")


def begun(method: Method = "keypoints", volume: VolumeReference = VOLUME) -> Annotation:
    return new_annotation(volume, FORCEPS, "anna", method, ships=True)


def started(document: Annotation, prediction: Prediction) -> Annotation:
    return start_from(document, prediction, prediction_path=PREDICTION_PATH, annotation_path=ANNOTATION_PATH)


def test_a_document_begins_where_the_network_sees_the_keypoints() -> None:
    document = started(begun(), made_prediction())

    assert document.positions_um == TRUE_UM
    assert {standing(part) for part in document.parts} == {"predicted"}
    assert document.status == "in_progress"
    assert document.predicted_from is not None
    assert document.predicted_from.checkpoint == "Known"
    assert document.predicted_from.sha256 == SHA256
    assert referenced_path(document.predicted_from, ANNOTATION_PATH) == PREDICTION_PATH
    assert parse_annotation(annotation_bytes(document), "x") == document


def test_what_the_network_does_not_see_stays_unplaced() -> None:
    some_um = {name: TRUE_UM[name] for name in ("k0", "k1")} | {"k2": (-100.0, 5000.0, 5000.0)}

    document = started(begun(), made_prediction(some_um))

    assert [part.state for part in document.parts] == ["placed", "placed", "out_of_view", *["unplaced"] * 3]


def test_a_keypoint_that_a_person_moved_counts_as_theirs() -> None:
    document = place_keypoint(started(begun(), made_prediction()), "k1", (1.0, 2.0, 3.0), "dragged")

    assert standing(document.part("k1")) == "counted"
    assert standing(document.part("k0")) == "predicted"


def test_a_keypoint_that_a_person_brought_back_into_view_is_placed() -> None:
    outside = {**TRUE_UM, "k2": (-100.0, 5000.0, 5000.0)}

    document = place_keypoint(started(begun(), made_prediction(outside)), "k2", (100.0, 5.0, 5.0), "dragged")

    assert document.part("k2").state == "placed"


def test_what_is_placed_or_locked_stays() -> None:
    mine = lock(place_keypoint(begun(), "k0", (1.0, 2.0, 3.0), "clicked"), "k1", locked=True)

    document = started(mine, made_prediction())

    assert document.part("k0") == mine.part("k0")
    assert document.part("k1") == mine.part("k1")
    assert document.part("k2").source == "predicted"


def test_a_prediction_without_keypoints_changes_nothing() -> None:
    document = begun()

    assert started(document, made_prediction({})) is document


@pytest.mark.parametrize(
    ("document", "problem"),
    [
        (begun("boxes"), "document of boxes"),
        (begun(volume=changed(VOLUME, fingerprint="1" * 64)), "of another volume"),
        (begun(volume=changed(VOLUME, spacing_um=(15.9, 13.5, 9.5))), "spacing"),
    ],
)
def test_a_document_that_it_does_not_fit_is_refused(document: Annotation, problem: str) -> None:
    with pytest.raises(EditRefused, match=problem):
        started(document, made_prediction())


def test_what_a_person_accepts_counts_as_adopted_from_the_checkpoint() -> None:
    outside = {**TRUE_UM, "k2": (-100.0, 5000.0, 5000.0)}
    begun_from = place_keypoint(started(begun(), made_prediction(outside)), "k1", (1.0, 2.0, 3.0), "dragged")

    document = accept_predicted(begun_from)

    assert {standing(part) for part in document.parts} == {"counted"}
    assert {part.adopted_from for part in document.parts if part.source == "adopted"} == {"Known"}
    assert document.part("k1") == begun_from.part("k1")
    assert document.part("k2").state == "out_of_view"
    assert document.positions_um == begun_from.positions_um
    assert accept_predicted(document) is document
    assert parse_annotation(annotation_bytes(document), "x") == document


def test_what_is_locked_is_not_accepted_with_the_rest() -> None:
    document = accept_predicted(lock(started(begun(), made_prediction()), "k0", locked=True))

    assert [part.source for part in document.parts] == ["predicted", *["adopted"] * 5]


def test_who_calls_a_predicted_keypoint_placed_has_accepted_it_and_no_other() -> None:
    document = set_state(started(begun(), made_prediction()), "k3", "placed")

    assert standing(document.part("k3")) == "counted"
    assert [standing(part) for part in document.parts].count("predicted") == 5


def test_who_says_that_a_predicted_keypoint_is_hidden_has_not_accepted_its_place() -> None:
    document = set_state(started(begun(), made_prediction()), "k3", "occluded")

    assert (document.part("k3").state, document.part("k3").source) == ("occluded", "predicted")
