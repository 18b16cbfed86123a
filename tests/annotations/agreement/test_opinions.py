"""Which of the files in a study are what the annotators say of one volume."""

from annotations.agreement.consensus import propose
from annotations.agreement.opinions import read_opinions
from annotations.documents.annotation import new_annotation
from annotations.documents.files import file_identity
from annotations.documents.provenance import PredictionOrigin
from annotations.documents.record import changed
from annotations.documents.study import CONSENSUS, annotation_path
from annotations.geometry.tool_library import shipped_tools
from tests.annotations.agreement.written import FORCEPS, WrittenStudy, document, write


def test_everybodys_first_pass_is_read_in_the_order_of_names(study: WrittenStudy) -> None:
    study.add(document("ben"), document("anna"), document("anna", repeat=1), document("anna", "v2"))
    study.add(document("anna", method="boxes"), document("stranger"))
    opinions = read_opinions(study.folder, "v1", "keypoints", FORCEPS)
    assert [opinion.document.annotator for opinion in opinions] == ["anna", "ben", "stranger"]
    assert {opinion.document.repeat for opinion in opinions} == {0}
    for opinion in opinions:
        assert opinion.path == annotation_path(study.folder, opinion.document.annotator, "v1", "keypoints")
        assert opinion.sha256 == file_identity(opinion.path)
    (boxes,) = read_opinions(study.folder, "v1", "boxes", FORCEPS)
    assert boxes.document.method == "boxes"


def test_the_consensus_is_nobodys_opinion(study: WrittenStudy) -> None:
    study.add(document("anna"), document(CONSENSUS))
    (opinion,) = read_opinions(study.folder, "v1", "keypoints", FORCEPS)
    assert opinion.document.annotator == "anna"


def test_what_is_of_another_tool_or_cannot_be_read_is_passed_over(study: WrittenStudy) -> None:
    study.add(document("anna"))
    needle = next(tool for tool in shipped_tools().values() if tool.name != FORCEPS.name)
    other = new_annotation(document("ben").volume, needle, "ben", "keypoints", ships=True)
    write(annotation_path(study.folder, "ben", "v1", "keypoints"), other)
    write(annotation_path(study.folder, "carl", "v1", "keypoints"), b"{")
    opinions = read_opinions(study.folder, "v1", "keypoints", FORCEPS)
    assert [opinion.document.annotator for opinion in opinions] == ["anna"]


def test_a_document_gets_the_parts_that_its_file_leaves_out(study: WrittenStudy) -> None:
    whole = document("anna")
    study.add(changed(whole, keypoints=whole.keypoints[:2]))
    (opinion,) = read_opinions(study.folder, "v1", "keypoints", FORCEPS)
    assert [part.name for part in opinion.document.parts] == list(FORCEPS.keypoint_names)
    assert opinion.document.keypoints[5].state == "unplaced"


def test_an_id_with_signs_of_a_pattern_names_itself_alone(study: WrittenStudy) -> None:
    study.add(document("anna"), volume="v[12]")
    study.add(document("ben"))
    (opinion,) = read_opinions(study.folder, "v[12]", "keypoints", FORCEPS)
    assert opinion.document.annotator == "anna"


def test_what_was_begun_from_a_prediction_has_no_voice_beside_opinions_of_their_own(
    study: WrittenStudy,
) -> None:
    origin = PredictionOrigin(path="p.json", checkpoint="Lean", sha256="0" * 64)
    fresh = new_annotation(document("ben").volume, FORCEPS, "ben", "keypoints", ships=True)
    study.add(document("anna", predicted_from=origin), document("carl", predicted_from=origin), fresh)
    place = annotation_path(study.folder, CONSENSUS, "v1", "keypoints")

    # Nobody has placed anything without it: what is made from it says so.
    begun = propose(read_opinions(study.folder, "v1", "keypoints", FORCEPS)).contributions(place)
    assert {each.annotator: each.predicted_from for each in begun} == {"anna": "Lean", "carl": "Lean"}

    study.add(document("ben"))
    own = propose(read_opinions(study.folder, "v1", "keypoints", FORCEPS))
    assert [each.annotator for each in own.contributions(place)] == ["ben"]
    assert own.contributions(place)[0].predicted_from is None
    assert own.parts["k0"].used == ("ben",)


def test_where_there_is_nothing_there_is_no_opinion(study: WrittenStudy) -> None:
    assert read_opinions(study.folder, "v1", "keypoints", FORCEPS) == ()
