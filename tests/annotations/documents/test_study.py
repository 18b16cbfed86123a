import errno
import os
import tomllib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings
from pydantic import ValidationError

from annotations.documents.study import (
    STUDY_FILE,
    Study,
    StudyError,
    StudyVolume,
    ViewingRules,
    annotation_name,
    annotation_path,
    annotator_problems,
    folder_name,
    load_study,
    reviewer_problems,
    save_study,
)
from annotations.durable_files import SaveError

SOUND = """
schema = "oct-study/1"
title = "Three annotators, thirty volumes"
tool = "magnetic-forceps"
methods = ["keypoints", "boxes"]
annotators = ["anna", "ben"]

[[volumes]]
id = "v001"
path = "volumes/v001.npy"

[[volumes]]
id = "v002"
path = "../shared volumes/Größe 2.h5"
dataset = "scan/intensity"
spacing_um = [15.9, 13.5, 9]
"""

text = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
names = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,8}", fullmatch=True)
people = names.filter(lambda name: not name.endswith(".")) | st.sampled_from(["Anna Meyer", "Jürgen", "安娜"])
relative_paths = (
    st.lists(
        st.text(
            st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="/\\:"), min_size=1, max_size=8
        )
        | st.just(".."),
        min_size=1,
        max_size=4,
    )
    .map("/".join)
    .filter(lambda path: path.strip("./"))
)
volumes = st.builds(
    StudyVolume,
    id=names,
    path=relative_paths,
    dataset=st.none() | text,
    spacing_um=st.none() | st.tuples(*[st.floats(1e-3, 1e4)] * 3),
    repeats=st.integers(0, 3),
    batch=st.integers(0, 3),
)
viewing_rules = st.builds(
    ViewingRules,
    others=st.sampled_from(["when_done", "never"]),
    may_look=st.booleans(),
    reviewers=st.lists(people, max_size=2).map(tuple),
)


@st.composite
def studies(draw: st.DrawFn) -> Study:
    annotators = draw(st.lists(people, max_size=3, unique_by=str.casefold))
    methods = draw(st.sampled_from([("keypoints",), ("boxes",), ("boxes", "keypoints")]))
    assigned = st.lists(st.sampled_from(methods), min_size=1, unique=True).map(tuple)
    return Study(
        title=draw(text),
        tool=draw(names),
        methods=methods,
        annotators=tuple(annotators),
        assignments={name: draw(assigned) for name in annotators if draw(st.booleans())},
        blind=draw(st.booleans()),
        order=draw(st.sampled_from(["listed", "shuffled"])),
        seed=draw(st.integers(0, 2**63 - 1)),
        viewing=draw(viewing_rules),
        volumes=tuple(draw(st.lists(volumes, max_size=3, unique_by=lambda volume: volume.id.casefold()))),
    )


def write(folder: Path, content: str) -> Path:
    (folder / STUDY_FILE).write_text(content, encoding="utf-8")
    return folder


def test_a_study_written_by_hand_is_read(tmp_path: Path) -> None:
    study = load_study(write(tmp_path, SOUND))
    assert study.title == "Three annotators, thirty volumes"
    assert study.tool == "magnetic-forceps"
    assert study.methods == ("keypoints", "boxes")
    assert study.annotators == ("anna", "ben")
    assert study.volumes == (
        StudyVolume(id="v001", path="volumes/v001.npy"),
        StudyVolume(
            id="v002",
            path="../shared volumes/Größe 2.h5",
            dataset="scan/intensity",
            spacing_um=(15.9, 13.5, 9.0),
        ),
    )


def test_little_has_to_be_said(tmp_path: Path) -> None:
    study = load_study(write(tmp_path, 'title = "Trial"\ntool = "needle"\n'))
    assert (study.methods, study.annotators, study.volumes) == (("keypoints",), (), ())


@given(study=studies())
@settings(max_examples=50)
def test_what_is_saved_is_what_is_loaded(study: Study) -> None:
    with TemporaryDirectory() as folder:
        save_study(study, Path(folder))
        assert load_study(Path(folder)) == study


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ('schema = "oct-study/1"', 'schema = "oct-study/2"', "schema: Input should be 'oct-study/1'"),
        ('schema = "oct-study/1"', 'schema_id = "oct-study/1"', "the field 'schema_id' is unknown"),
        ('tool = "magnetic-forceps"', "", "the field 'tool' is missing"),
        ('tool = "magnetic-forceps"', 'tool = "../forceps"', "tool: a name holds letters"),
        ('["keypoints", "boxes"]', '["points"]', "methods.0: Input should be 'keypoints' or 'boxes'"),
        ('["keypoints", "boxes"]', "[]", "methods: Tuple should have at least 1 item"),
        ('["keypoints", "boxes"]', '["boxes", "boxes"]', "method 'boxes' stands more than once"),
        ('["anna", "ben"]', '["anna", "anna"]', "annotator 'anna' stands more than once"),
        ('["anna", "ben"]', '["anna", "Anna"]', "annotator 'anna' stands more than once"),
        ('["anna", "ben"]', '["anna", "../ben"]', "annotators.1: an annotator's name is also a folder's"),
        ('["anna", "ben"]', '["anna", ".."]', "annotators.1: an annotator's name is also a folder's"),
        ('["anna", "ben"]', '["anna", ""]', "annotators.1: an annotator's name is also a folder's"),
        ('["anna", "ben"]', '["Jürgen", "Ju\u0308rgen"]', "annotator 'Jürgen' stands more than once"),
        ('["anna", "ben"]', '"anna"', "annotators: Input should be a valid tuple"),
        ('id = "v002"', 'id = "v001"', "volume 'v001' stands more than once"),
        ('id = "v002"', 'id = "V001"', "stands more than once (capitals do not count)"),
        ('id = "v002"', 'id = "a/b"', "volumes.1.id: a name holds letters"),
        ('id = "v002"', "", "the field 'volumes.1.id' is missing"),
        ('id = "v002"', 'id = "v002"\nspacing = 5', "the field 'volumes.1.spacing' is unknown"),
        ('"volumes/v001.npy"', '"/data/v001.npy"', "volumes.0.path: a volume's path is relative"),
        ('"volumes/v001.npy"', '"//server/v001.npy"', "volumes.0.path: a volume's path is relative"),
        ('"volumes/v001.npy"', "'C:/data/v001.npy'", "volumes.0.path: a volume's path is relative"),
        ('"volumes/v001.npy"', "'volumes\\v001.npy'", "volumes.0.path: a volume's path is relative"),
        ('"volumes/v001.npy"', '""', "volumes.0.path: a volume's path is relative"),
        ('"volumes/v001.npy"', '"."', "volumes.0.path: a volume's path is relative"),
        ('"volumes/v001.npy"', '"a\\u0000b"', "volumes.0.path: a volume's path must be text"),
        (
            "[15.9, 13.5, 9]",
            "[15.9, 13.5, 0]",
            "volumes.1.spacing_um.2: Input should be greater than 0, found 0",
        ),
        ("[15.9, 13.5, 9]", "[15.9, -1.5, 9]", "volumes.1.spacing_um.1: Input should be greater than 0"),
        ("[15.9, 13.5, 9]", "[15.9, 13.5, nan]", "volumes.1.spacing_um.2: Input should be a finite number"),
        ("[15.9, 13.5, 9]", "[15.9, 13.5]", "the field 'volumes.1.spacing_um.2' is missing"),
        ("[15.9, 13.5, 9]", '["15.9", 13.5, 9]', "volumes.1.spacing_um.0: Input should be a valid number"),
        ('id = "v002"', 'id = "v002"\nrepeats = -1', "volumes.1.repeats: Input should be greater than or"),
        ('id = "v002"', 'id = "v002"\nrepeats = 1.0', "volumes.1.repeats: Input should be a valid integer"),
        ('"ben"]', '"ben"]\nblind = "yes"', "blind: Input should be a valid boolean"),
        ('"ben"]', '"ben"]\norder = "random"', "order: Input should be 'listed' or 'shuffled'"),
        ('"ben"]', '"ben"]\nseed = -1', "seed: Input should be greater than or equal to 0"),
        ('"ben"]', '"ben"]\nassignments = { cara = ["boxes"] }', "assignments name 'cara', who is not among"),
        ('"ben"]', '"ben"]\nassignments = { ben = [] }', "assignments.ben: Tuple should have at least 1"),
        (
            '["keypoints", "boxes"]',
            '["boxes"]\nassignments = { ben = ["keypoints"] }',
            "'keypoints', which is",
        ),
        ('"ben"]', '"ben", "consensus"]', "no annotator can be called 'consensus'"),
        ('"ben"]', '"ben"]\nviewing = { others = "sometimes" }', "viewing.others: Input should be"),
        ('"ben"]', '"ben"]\nviewing = { reviewers = ["a/b"] }', "viewing.reviewers.0: a reviewer's name"),
        ("[[volumes]]\nid", "[[volumes]\nid", "it is not valid TOML"),
        ('tool = "magnetic-forceps"', 'tool = "needle"\ntool = "needle"', "it is not valid TOML"),
    ],
)
def test_a_wrong_study_is_refused_by_name(tmp_path: Path, right: str, wrong: str, message: str) -> None:
    assert right in SOUND
    folder = write(tmp_path, SOUND.replace(right, wrong, 1))
    with pytest.raises(StudyError) as refused:
        load_study(folder)
    assert message in str(refused.value)
    assert refused.value.where == folder / STUDY_FILE


@pytest.mark.parametrize(
    ("right", "wrong", "meant"),
    [
        ('annotators = ["anna"', 'annotator = ["anna"', "'annotators' is meant"),
        ('schema = "oct-study/1"', 'schema_id = "oct-study/1"', "'schema' is meant"),
        ('id = "v002"', 'id = "v002"\nspacing = 5', "'spacing_um' is meant"),
        ('"ben"]', '"ben"]\nviewing = { reviewer = ["rita"] }', "'reviewers' is meant"),
        ('"ben"]', '"ben"]\nqqq = 1', "known are schema, title, tool"),
    ],
)
def test_for_an_unknown_field_the_likely_one_is_named(
    tmp_path: Path, right: str, wrong: str, meant: str
) -> None:
    assert right in SOUND
    with pytest.raises(StudyError, match=meant):
        load_study(write(tmp_path, SOUND.replace(right, wrong, 1)))


@pytest.mark.parametrize("wrong", ["methods = []\n", "[[volumes\n"])
def test_the_file_before_is_mentioned_where_there_is_one(tmp_path: Path, wrong: str) -> None:
    with pytest.raises(StudyError) as refused:
        load_study(write(tmp_path, wrong))
    assert "study.toml.bak" not in str(refused.value)
    (tmp_path / "study.toml.bak").write_text(SOUND, encoding="utf-8")
    with pytest.raises(StudyError, match=r"go back to study\.toml\.bak"):
        load_study(tmp_path)


def test_every_name_that_cannot_be_is_told_and_none_twice() -> None:
    problems = annotator_problems(["anna", "../x", "ben", "Anna", "consensus", ""])
    assert set(problems) == {0, 1, 3, 4, 5}
    assert problems[0].startswith("'anna' stands more than once")
    assert problems[1].count("../x") == 1
    assert "an annotator's name is also a folder's" in problems[1]
    assert "consensus is kept there" in problems[4]
    assert annotator_problems(["anna", "ben"]) == {}
    [said] = reviewer_problems(["rita", "a/b"])
    assert said.startswith("a reviewer's name")


def test_a_wrong_name_is_said_once(tmp_path: Path) -> None:
    with pytest.raises(StudyError) as refused:
        load_study(write(tmp_path, SOUND.replace('"ben"', '"../x"')))
    assert str(refused.value).count("../x") == 1


def test_what_says_nothing_is_not_written(tmp_path: Path) -> None:
    save_study(Study(title="Trial", tool="needle", volumes=(StudyVolume(id="a", path="a.npy"),)), tmp_path)
    assert tomllib.loads((tmp_path / STUDY_FILE).read_text(encoding="utf-8")) == {
        "schema": "oct-study/1",
        "title": "Trial",
        "tool": "needle",
        "methods": ["keypoints"],
        "annotators": [],
        "volumes": [{"id": "a", "path": "a.npy"}],
    }


def test_of_the_viewing_rules_only_the_unusual_ones_are_written(tmp_path: Path) -> None:
    save_study(Study(title="Trial", tool="needle", viewing=ViewingRules(may_look=True)), tmp_path)
    fields = tomllib.loads((tmp_path / STUDY_FILE).read_text(encoding="utf-8"))
    assert fields["viewing"] == {"may_look": True}


@pytest.mark.parametrize(
    ("methods", "usual"),
    [(("keypoints",), "keypoints"), (("boxes",), "boxes"), (("boxes", "keypoints"), "keypoints")],
)
def test_keypoints_are_taken_where_a_study_has_them(methods: Any, usual: str) -> None:
    assert Study(title="", tool="needle", methods=methods).usual_method == usual


def test_who_is_not_assigned_works_by_all_methods(tmp_path: Path) -> None:
    study = load_study(write(tmp_path, SOUND.replace('"ben"]', '"ben"]\nassignments = { ben = ["boxes"] }')))
    assert study.methods_of("anna") == ("keypoints", "boxes")
    assert study.methods_of("ben") == ("boxes",)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("v001.keypoints.json", ("v001", "keypoints", 0)),
        ("scan.npy.boxes.json", ("scan.npy", "boxes", 0)),
        ("v001.boxes.repeat12.json", ("v001", "boxes", 12)),
        ("v.keypoints.repeat1.keypoints.json", ("v.keypoints.repeat1", "keypoints", 0)),
        ("v001.boxes.repeat0.json", None),
        ("v001.points.json", None),
        ("v001.json", None),
        (".keypoints.json", None),
        ("v001.keypoints.json.bak", None),
    ],
)
def test_the_name_of_an_annotation_file_is_understood(
    name: str, expected: tuple[str, str, int] | None
) -> None:
    found = annotation_name(Path("annotations/anna") / name)
    assert (found and (found.volume_id, found.method, found.repeat)) == expected


@given(volume_id=names, method=st.sampled_from(["keypoints", "boxes"]), repeat=st.integers(0, 99))
def test_what_a_path_is_made_of_is_read_from_it(volume_id: str, method: Any, repeat: int) -> None:
    path = annotation_path(Path("study"), "anna", volume_id, method, repeat)
    found = annotation_name(path)
    assert found is not None
    assert (found.volume_id, found.method, found.repeat) == (volume_id, method, repeat)


def test_a_volume_whose_name_is_no_unicode_is_refused() -> None:
    with pytest.raises(ValidationError, match="rename the file"):
        StudyVolume(id="v001", path=os.fsdecode(b"Gr\xfc\xdfe.npy"))


def test_a_folder_without_a_study_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="could not be read"):
        load_study(tmp_path)


def test_a_study_that_is_no_text_is_an_error(tmp_path: Path) -> None:
    (tmp_path / STUDY_FILE).write_bytes(SOUND.encode("utf-16"))
    with pytest.raises(StudyError, match="could not be read"):
        load_study(tmp_path)


def test_saving_keeps_the_previous_study(tmp_path: Path) -> None:
    study = load_study(write(tmp_path, SOUND))
    save_study(study, tmp_path)
    assert (tmp_path / "study.toml.bak").read_text(encoding="utf-8") == SOUND


def test_a_full_disk_leaves_the_old_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(write(tmp_path, SOUND))

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(SaveError, match="No space left"):
        save_study(study, tmp_path)
    assert (tmp_path / STUDY_FILE).read_text(encoding="utf-8") == SOUND


def test_each_annotator_and_method_has_a_file_of_its_own(tmp_path: Path) -> None:
    paths = {
        annotation_path(tmp_path, annotator, volume, method)
        for annotator in ("anna", "ben")
        for volume in ("v001", "v002")
        for method in ("keypoints", "boxes")
    }
    assert len(paths) == 8
    assert tmp_path / "annotations" / "anna" / "v001.keypoints.json" in paths


@pytest.mark.parametrize("wrong", [{"title": None}, {"volumes": ()}, {"tool": "needle"}])
def test_a_study_cannot_be_changed(tmp_path: Path, wrong: dict[str, Any]) -> None:
    study = load_study(write(tmp_path, SOUND))
    for name, value in wrong.items():
        with pytest.raises(ValidationError, match="frozen"):
            setattr(study, name, value)


@pytest.mark.parametrize("name", ["anna", "Anna Meyer", "Jürgen", "安娜", "a.b-c_d", "O'Neill"])
def test_people_have_names_in_any_script(tmp_path: Path, name: str) -> None:
    path = annotation_path(tmp_path, name, "v001", "boxes")
    assert path == tmp_path / "annotations" / name / "v001.boxes.json"
    assert load_study(write(tmp_path, SOUND.replace('"ben"', f'"{name}x"'))).annotators[1] == f"{name}x"


@pytest.mark.parametrize(
    "name", ["", " ", "..", ".", "../ben", "a/b", "a\\b", "a:b", "a\nb", "a\0b", "anna ", ".anna"]
)
def test_a_name_that_is_no_folders_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(StudyError, match="an annotator's name is also a folder's"):
        annotation_path(tmp_path, name, "v001", "keypoints")


@pytest.mark.parametrize("name", ["Lean", "Lean 2 (fine-tuned)", "Größe", "網"])
def test_most_names_are_a_folders_as_they_are(name: str) -> None:
    assert folder_name(name) == name


def test_other_names_become_a_folders_and_stay_apart(tmp_path: Path) -> None:
    strange = [
        "a/b",
        "a_b",
        "a\\b",
        "../../etc",
        " a",
        "a.",
        "...",
        "C:",
        "x\0y",
        "x\ny",
        "\ud800",
        "n" * 300,
    ]

    made = [folder_name(name) for name in strange]

    assert len(set(made)) == len(strange)
    for name in made:
        (tmp_path / name).mkdir()
        assert (tmp_path / name).parent == tmp_path
        assert folder_name(name) == name
