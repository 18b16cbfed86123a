from typing import Any

import pytest

from annotations.documents.record import changed
from annotations.documents.study import Study, StudyVolume, ViewingRules
from annotations.documents.study_building import with_rules
from annotations.documents.study_changes import study_changes

VOLUMES = tuple(StudyVolume(id=f"v{number}", path=f"v{number}.npy") for number in range(3))
STUDY = Study(
    title="Pilot",
    tool="needle",
    methods=("keypoints", "boxes"),
    annotators=("anna", "ben"),
    volumes=VOLUMES,
)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({}, []),
        ({"title": "Main"}, ["The title becomes “Main”"]),
        ({"tool": "probe"}, ["The tool becomes probe, in place of needle"]),
        (
            {"methods": ("boxes",)},
            ["It is annotated by boxes, no longer by keypoints and boxes"],
        ),
        ({"annotators": ("anna", "ben", "cara")}, ["cara is to annotate by keypoints and boxes"]),
        ({"annotators": ("anna",)}, ["ben no longer annotates; what ben has done stays"]),
        (
            {"assignments": {"ben": ("boxes",)}},
            ["ben annotates by boxes, no longer by keypoints and boxes"],
        ),
        (
            {"volumes": (*VOLUMES, StudyVolume(id="new", path="new.npy", repeats=1))},
            ["1 new volume: new", "A second time: new"],
        ),
        (
            {"volumes": (*VOLUMES, *(StudyVolume(id=f"w{n}", path=f"w{n}.npy") for n in range(9)))},
            ["9 new volumes: w0, w1, w2, w3, w4, w5 and 3 more"],
        ),
        ({"volumes": VOLUMES[1:]}, ["No longer in the study: v0"]),
        ({"blind": True}, ["Annotators see numbers in place of the volumes' names"]),
        ({"order": "shuffled"}, ["The order becomes: an order of each annotator's own"]),
        ({"seed": 4}, ["The seed of the order becomes 4"]),
        (
            {"viewing": ViewingRules(others="never", may_look=True, reviewers=("rita",))},
            [
                "Annotators see each other's work never",
                "Looking before one's own is done is possible, and written down",
                "Reviewers: rita",
            ],
        ),
    ],
)
def test_each_change_is_a_sentence(fields: dict[str, Any], said: list[str]) -> None:
    assert list(study_changes(STUDY, with_rules(STUDY, **fields))) == said


def test_a_change_taken_back_is_said_the_other_way() -> None:
    strict = with_rules(STUDY, blind=True, viewing=ViewingRules(may_look=True, reviewers=("rita",)))
    assert study_changes(strict, STUDY) == (
        "Annotators see the volumes' names",
        "Looking before one's own is done is not possible",
        "Reviewers: everyone who does not annotate",
    )


def test_every_field_that_can_change_is_told() -> None:
    """A field that is added to studies one day must not change in silence."""
    other = {
        "title": "Main",
        "tool": "probe",
        "methods": ("boxes", "keypoints"),
        "annotators": ("anna",),
        "assignments": {"anna": ("boxes",)},
        "blind": True,
        "order": "shuffled",
        "seed": 1,
        "viewing": ViewingRules(may_look=True),
        "volumes": (),
    }
    assert set(other) == set(Study.model_fields) - {"schema_id"}
    for name, value in other.items():
        assert study_changes(STUDY, changed(STUDY, **{name: value})), name
