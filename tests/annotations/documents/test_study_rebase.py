from pathlib import Path

from annotations.documents.study import Study, StudyVolume, ViewingRules
from annotations.documents.study_building import with_annotators, with_repeats, with_rules, with_volumes
from annotations.documents.study_rebase import rebased

FOLDER = Path("/studies/pilot")
BEFORE = Study(
    title="Pilot",
    tool="needle",
    methods=("keypoints", "boxes"),
    annotators=("anna", "ben"),
    volumes=(StudyVolume(id="v1", path="v1.npy", repeats=1), StudyVolume(id="v2", path="v2.npy")),
)


def test_both_changes_are_in_the_outcome() -> None:
    own = with_annotators(BEFORE, ["cara"], {"cara": ("boxes",)})
    own = with_rules(own, title="Main", viewing=ViewingRules(may_look=True))
    own = with_repeats(with_volumes(own, FOLDER, [FOLDER / "new" / "v3.npy"]).study, 1)
    theirs = with_rules(with_annotators(BEFORE, ["dora"]), blind=True)
    theirs = with_volumes(theirs, FOLDER, [FOLDER / "v4.npy"]).study
    both = rebased(BEFORE, own, theirs, FOLDER)
    assert (both.title, both.blind, both.viewing.may_look) == ("Main", True, True)
    assert both.annotators == ("anna", "ben", "dora", "cara")
    assert both.assignments == {"cara": ("boxes",)}
    assert [(each.id, each.batch, each.repeats) for each in both.volumes] == [
        ("v1", 0, 1),
        ("v2", 0, 0),
        ("v4", 1, 0),
        ("v3", 2, 1),
    ]


def test_what_both_added_stands_once() -> None:
    own = with_volumes(with_annotators(BEFORE, ["cara"]), FOLDER, [FOLDER / "v3.npy"]).study
    assert rebased(BEFORE, own, own, FOLDER) == own


def test_whom_they_took_out_does_not_come_back_and_what_i_reassigned_stays() -> None:
    own = with_rules(BEFORE, assignments={"anna": ("boxes",)})
    theirs = with_rules(BEFORE, annotators=("anna",))
    both = rebased(BEFORE, own, theirs, FOLDER)
    assert (both.annotators, both.assignments) == (("anna",), {"anna": ("boxes",)})


def test_without_a_change_of_theirs_nothing_but_the_own_one_is_there() -> None:
    own = with_rules(with_annotators(BEFORE, ["cara"]), title="Main")
    assert rebased(BEFORE, own, BEFORE, FOLDER) == own
