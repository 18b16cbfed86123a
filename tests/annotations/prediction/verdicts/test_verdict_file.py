"""Files of verdicts: read back, refused when wrong, and never written over each other."""

import csv
import io
import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

from annotations.documents.files import DocumentError
from annotations.documents.record import changed, now
from annotations.documents.study import Study, StudyVolume, save_study
from annotations.documents.study_checks import check_study
from annotations.durable_files import SaveError
from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable
from annotations.prediction.prediction import CheckpointReference
from annotations.prediction.verdicts.verdict_csv import verdicts_csv
from annotations.prediction.verdicts.verdict_file import (
    VERDICT_FILE,
    load_verdicts,
    record_verdict,
    study_verdicts,
    verdict_bytes,
    verdict_path,
    withdraw_verdict,
)
from annotations.prediction.verdicts.verdicts import VerdictList, VolumeVerdict, is_stale, verdict_on
from tests.annotations.prediction.made_predictions import CHECKPOINT, moments, names, not_negative, words

ROW = ErrorsOfVolume(
    volume="v1",
    whose="anna",
    presence=1.0,
    targets={"position_mm": 0.5, "theta1_deg": 3.0},
    annotation_sha256="a" * 64,
)

hashes = st.text("0123456789abcdef", min_size=64, max_size=64)
verdicts = st.builds(
    VolumeVerdict,
    volume=names,
    verdict=st.sampled_from(["annotation_wrong", "model_wrong", "both_wrong", "neither_wrong"]),
    note=words,
    moment=moments,
    annotator=names,
    annotation_sha256=st.none() | hashes,
    checkpoint_sha256=hashes,
    errors=st.dictionaries(words, not_negative, max_size=3),
)
lists = st.builds(
    VerdictList,
    checkpoint=names,
    reviewer=names,
    verdicts=st.lists(verdicts, max_size=4, unique_by=lambda each: each.volume).map(tuple),
    program=words,
)


def on(volume: str, **fields: object) -> VolumeVerdict:
    return changed(verdict_on(ROW, CHECKPOINT, "model_wrong"), volume=volume, **fields)


def record(folder: Path, verdict: VolumeVerdict, reviewer: str = "rita") -> VerdictList:
    return record_verdict(folder, CHECKPOINT.name, CHECKPOINT.sha256, reviewer, verdict)


@given(lists)
def test_a_file_holds_all_verdicts(said: VerdictList) -> None:
    assert VERDICT_FILE.parse(verdict_bytes(said), "x") == said


@given(lists)
@settings(max_examples=20)
def test_a_file_is_standard_json_without_nan_or_null(said: VerdictList) -> None:
    def refuse(token: str) -> None:
        raise AssertionError(token)

    json.loads(verdict_bytes(said), parse_constant=refuse)
    assert b": null" not in verdict_bytes(said)


def test_a_verdict_says_what_it_is_about() -> None:
    said = verdict_on(ROW, CHECKPOINT, "annotation_wrong", "k3 is on the wrong side")

    assert (said.volume, said.annotator, said.errors) == ("v1", "anna", ROW.targets)
    assert (said.annotation_sha256, said.checkpoint_sha256) == (ROW.annotation_sha256, CHECKPOINT.sha256)


def test_a_verdict_is_kept_changed_and_taken_back(tmp_path: Path) -> None:
    record(tmp_path, on("v1"))
    record(tmp_path, on("v2"))
    record(tmp_path, on("v1", verdict="both_wrong", note="see k4"))

    said = load_verdicts(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "rita")

    assert said is not None
    assert [(each.volume, each.verdict) for each in said.verdicts] == [
        ("v1", "both_wrong"),
        ("v2", "model_wrong"),
    ]
    assert said.on("v1") == on("v1", verdict="both_wrong", note="see k4", moment=said.verdicts[0].moment)
    left = withdraw_verdict(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "rita", "v1")
    assert left == load_verdicts(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "rita")
    assert [each.volume for each in left.verdicts] == ["v2"]
    assert left.on("v1") is None


def test_reviewers_and_checkpoints_have_files_of_their_own(tmp_path: Path) -> None:
    record(tmp_path, on("v1"), "rita")
    record(tmp_path, on("v1"), "Anna")
    record_verdict(tmp_path, "a/b: of V2V?", CHECKPOINT.sha256, "rita", on("v1"))
    withdraw_verdict(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "zoe", "v1")

    assert [each.reviewer for each in study_verdicts(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256)[0]] == [
        "Anna",
        "rita",
    ]
    assert [each.checkpoint for each in study_verdicts(tmp_path, "a/b: of V2V?", CHECKPOINT.sha256)[0]] == [
        "a/b: of V2V?"
    ]
    assert study_verdicts(tmp_path, "none", CHECKPOINT.sha256) == ((), ())
    assert load_verdicts(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "ben") is None
    path = verdict_path(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "rita")
    assert path == tmp_path / "verdicts" / "Known" / "rita.json"
    assert path.is_file()


def test_verdicts_stay_with_their_checkpoint_after_its_predictions_are_deleted(tmp_path: Path) -> None:
    name, later = CHECKPOINT.name, "e" * 64
    kept = record(tmp_path, on("v1"))

    # A later file of the same name, before it has predicted anything.
    record_verdict(tmp_path, name, later, "rita", on("v1", checkpoint_sha256=later, note="new"))

    assert load_verdicts(tmp_path, name, CHECKPOINT.sha256, "rita") == kept
    apart = load_verdicts(tmp_path, name, later, "rita")
    assert apart is not None
    assert [each.checkpoint_sha256 for each in apart.verdicts] == [later]


def test_two_windows_of_one_person_lose_nothing(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda number: record(tmp_path, on(f"v{number}")), range(24)))

    said = load_verdicts(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "rita")

    assert said is not None
    assert {each.volume for each in said.verdicts} == {f"v{number}" for number in range(24)}


@pytest.mark.parametrize(
    "content",
    [b"", b"a letter", b'{"schema": "oct-prediction/1"}', b'{"schema": "oct-verdicts/2"}'],
    ids=["empty", "letter", "prediction", "newer"],
)
def test_no_other_file_is_overwritten(tmp_path: Path, content: bytes) -> None:
    path = verdict_path(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "rita")
    path.parent.mkdir(parents=True)
    path.write_bytes(content)
    record(tmp_path, on("v1"), "anna")

    with pytest.raises(SaveError, match="are not written over"):
        record(tmp_path, on("v1"))
    said, [problem] = study_verdicts(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256)

    assert [each.reviewer for each in said] == ["anna"]
    assert problem.where is not None
    assert str(path) in str(problem.where)

    assert path.read_bytes() == content


def test_somebody_elses_file_is_not_taken_for_ones_own(tmp_path: Path) -> None:
    record(tmp_path, on("v1"), "Rita")
    verdict_path(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "Rita").rename(
        verdict_path(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "rita")
    )

    with pytest.raises(DocumentError, match="'Rita' says"):
        load_verdicts(tmp_path, CHECKPOINT.name, CHECKPOINT.sha256, "rita")
    with pytest.raises(SaveError):
        record(tmp_path, on("v2"))


@pytest.mark.parametrize(
    ("right", "wrong", "problem"),
    [
        ('"verdict": "model_wrong"', '"verdict": "nobody"', "verdicts.0.verdict"),
        ('"annotator": "anna"', '"annotator": "anna", "mood": "good"', "'verdicts.0.mood' is unknown"),
        ('"position_mm": 0.5', '"position_mm": -0.5', "verdicts.0.errors.position_mm"),
        ('"volume": "v2"', '"volume": "v1"', "the verdict on volume 'v1' stands more than once"),
        ('"schema": "oct-verdicts/1"', '"schema": "oct-verdicts/2"', "newer version of the program"),
        ('"schema": "oct-verdicts/1"', '"schema": "oct-annotation/1"', "it is not a file of verdicts"),
    ],
)
def test_a_wrong_file_is_refused_in_words(right: str, wrong: str, problem: str) -> None:
    text = verdict_bytes(
        VerdictList(checkpoint="Known", reviewer="rita", verdicts=(on("v1"), on("v2")))
    ).decode()
    assert right in text

    with pytest.raises(DocumentError) as refused:
        VERDICT_FILE.parse(text.replace(right, wrong, 1).encode(), "rita.json")

    assert problem in str(refused.value)


def test_a_file_that_is_cut_off_anywhere_is_refused() -> None:
    content = verdict_bytes(VerdictList(checkpoint="Known", reviewer="rita", verdicts=(on("v1"),)))
    for length in range(len(content) - 1):
        with pytest.raises(DocumentError):
            VERDICT_FILE.parse(content[:length], "cut.json")


def test_a_verdict_is_stale_once_annotation_or_checkpoint_is_another() -> None:
    said = verdict_on(ROW, CHECKPOINT, "annotation_wrong")

    assert not is_stale(said, ROW, CHECKPOINT.sha256)
    assert not is_stale(said, changed(ROW, targets={"position_mm": 0.6}), CHECKPOINT.sha256)
    assert is_stale(said, changed(ROW, annotation_sha256="b" * 64), CHECKPOINT.sha256)
    assert is_stale(said, changed(ROW, whose="consensus"), CHECKPOINT.sha256)
    assert is_stale(said, ROW, "0" * 64)
    assert is_stale(said, None, CHECKPOINT.sha256)


def test_all_verdicts_are_written_as_csv() -> None:
    rita = VerdictList(
        checkpoint="Known", reviewer="rita", verdicts=(on("v1", note='half, "bent"'), on("v2"))
    )
    zoe = VerdictList(checkpoint="Other", reviewer="zoe", verdicts=(on("v1", errors={"theta2_deg": 1.5}),))
    table = ErrorTable(title="any", tool="any", checkpoint=CHECKPOINT, rows=(ROW,), created=now())

    rows = list(csv.DictReader(io.StringIO(verdicts_csv([rita, zoe], [table]).decode(), newline="")))

    assert [(row["volume"], row["reviewer"], row["checkpoint"]) for row in rows] == [
        ("v1", "rita", "Known"),
        ("v2", "rita", "Known"),
        ("v1", "zoe", "Other"),
    ]
    assert [row["changed_since"] for row in rows] == ["no", "yes", ""]
    assert rows[0]["note"] == 'half, "bent"'
    assert [row["position_mm"] for row in rows] == ["0.5", "0.5", ""]
    assert [row["theta2_deg"] for row in rows] == ["", "", "1.5"]
    assert {row["annotator"] for row in rows} == {"anna"}


def test_a_studys_check_says_nothing_about_verdicts(tmp_path: Path) -> None:
    study = Study(
        title="Any",
        tool="magnetic-forceps",
        annotators=("anna",),
        volumes=(StudyVolume(id="v1", path="volumes/v1.npy"),),
    )
    save_study(study, tmp_path)
    before = [str(found) for found in check_study(tmp_path)]

    record(tmp_path, on("v1"))

    assert [str(found) for found in check_study(tmp_path)] == before


def test_a_checkpoint_reference_is_all_that_a_verdict_needs() -> None:
    reference = CheckpointReference(name="Lean", sha256="c" * 64)
    assert verdict_on(ROW, reference, "neither_wrong").checkpoint_sha256 == "c" * 64


def test_a_verdict_that_cannot_be_written_is_not_said_to_be_kept(tmp_path: Path) -> None:
    (tmp_path / "verdicts").write_text("mine")

    with pytest.raises(SaveError) as caught:
        record(tmp_path, on("v1"))

    assert "not recorded" in caught.value.remedy
    assert "lost" not in str(caught.value)
