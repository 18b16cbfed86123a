from pathlib import Path
from typing import Any

import pytest

from annotations.cli import main
from annotations.documents.study import load_study


def test_a_study_is_made_of_the_volumes_in_a_folder(study: Path, tmp_path: Path, run_json: Any) -> None:
    folder = tmp_path / "new"
    code, [made], messages = run_json(
        "study", folder, "--volumes", study, "--tool", "needle", "--annotators", "anna", "ben",
        "--methods", "keypoints", "boxes", "--title", "Needles", "--blind", "--shuffle", "--repeats", 1,
        "--seed", 4, "--may-look", "--reviewers", "rita",
    )  # fmt: skip
    assert (code, messages) == (0, "")
    written = load_study(folder)
    assert (written.title, written.tool, written.methods) == ("Needles", "needle", ("keypoints", "boxes"))
    assert (written.blind, written.order, written.seed) == (True, "shuffled", 4)
    assert (written.viewing.may_look, written.viewing.reviewers) == (True, ("rita",))
    assert [volume.path for volume in written.volumes] == [f"../study/volumes/v00{n}.npy" for n in (1, 2)]
    assert sum(volume.repeats for volume in written.volumes) == 1
    assert made["path"] == str(folder / "study.toml")
    assert [volume["id"] for volume in made["volumes"]] == ["v001", "v002"]
    assert made["annotators"] == ["anna", "ben"]


def test_what_was_made_is_said_in_words(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "new"
    assert main(["study", str(folder), "--volumes", str(study), "--tool", "needle", "--repeats", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        str(folder / "study.toml"),
        "  volumes     2, and 1 a second time",
        "  annotators  none yet",
        "  methods     keypoints",
    ]


def test_an_existing_study_is_added_to_and_never_overwritten(study: Path, run_json: Any) -> None:
    code, _, messages = run_json("study", study, "--tool", "needle")
    assert code == 1
    assert "not overwritten" in messages
    before = load_study(study)
    (study / "more").mkdir()
    (study / "volumes" / "v002.npy").rename(study / "more" / "v002.npy")
    code, _, messages = run_json(
        "study", study, "--add-volumes", study, study / "more/v002.npy", "--add-annotators", "anna"
    )
    assert (code, messages) == (0, "")
    after = load_study(study)
    assert after.volumes[:2] == before.volumes
    assert [(volume.id, volume.path, volume.batch) for volume in after.volumes[2:]] == [
        ("more-v002", "more/v002.npy", 1)
    ]
    assert after.annotators == ("truth", "anna")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "a new study needs --tool"),
        (["--tool", "spoon"], "there is no tool specification 'spoon'"),
        (["--tool", "needle", "--add-annotators", "anna"], "--tool is for new studies"),
        (["--may-look", "--add-annotators", "anna"], "--may-look is for new studies"),
        (["--repeats", "1", "--add-annotators", "anna"], "--repeats is for new volumes"),
        (["--tool", "needle", "--methods", "points"], "invalid choice"),
    ],
)
def test_misuse_is_told(
    study: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["study", str(study), *arguments])
    assert caught.value.code == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--annotators", "anna", "Anna"], "annotator 'anna' stands more than once"),
        (["--annotators", "a/b"], "an annotator's name is also a folder's"),
        (["--repeats", "3"], "3 volumes cannot be repeated: there are 2"),
        (["--volumes", "nowhere"], "nowhere"),
    ],
)
def test_what_cannot_be_leaves_no_file(
    study: Path, tmp_path: Path, arguments: list[str], message: str, run_json: Any
) -> None:
    folder = tmp_path / "new"
    volumes = [] if "--volumes" in arguments else ["--volumes", study]
    code, _, messages = run_json("study", folder, "--tool", "needle", *volumes, *arguments)
    assert code == 1
    assert message in messages
    assert not folder.exists()
