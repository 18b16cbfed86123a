from pathlib import Path
from typing import Any

import pytest

from annotations.cli import main
from annotations.documents.study import ViewingRules, load_study


def test_a_study_is_made_of_the_volumes_in_a_folder(study: Path, tmp_path: Path, run_json: Any) -> None:
    folder = tmp_path / "new"
    code, [made], messages = run_json(
        "study", folder, "--volumes", study, "--tool", "needle", "--annotators", "anna", "ben",
        "--methods", "keypoints", "boxes", "--title", "Needles", "--blind", "--shuffle", "--repeats", 1,
        "--seed", 4, "--others", "never", "--may-look", "--reviewers", "rita",
    )  # fmt: skip
    assert (code, messages) == (0, "")
    written = load_study(folder)
    assert (written.title, written.tool, written.methods) == ("Needles", "needle", ("keypoints", "boxes"))
    assert (written.blind, written.order, written.seed) == (True, "shuffled", 4)
    assert written.viewing == ViewingRules(others="never", may_look=True, reviewers=("rita",))
    assert [volume.path for volume in written.volumes] == [f"../study/volumes/v00{n}.npy" for n in (1, 2)]
    assert sum(volume.repeats for volume in written.volumes) == 1
    assert made["path"] == str(folder / "study.toml")
    assert [volume["id"] for volume in made["volumes"]] == ["v001", "v002"]
    assert made["annotators"] == ["anna", "ben"]


def test_what_was_made_is_said_in_words(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "new"
    arguments = ["--volumes", str(study), "--tool", "needle", "--repeats", "1"]
    assert main(["study", str(folder), *arguments]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        str(folder / "study.toml"),
        "  volumes     2, and 1 a second time",
        "  annotators  none yet",
        "  methods     keypoints",
        f"  seed        {load_study(folder).seed}",
    ]


def test_every_new_study_has_a_seed_of_its_own(study: Path, tmp_path: Path, run_json: Any) -> None:
    seeds = set()
    for name in ("a", "b", "c"):
        _, [made], _ = run_json("study", tmp_path / name, "--volumes", study, "--tool", "needle")
        seeds.add(made["seed"])
    assert len(seeds) > 1


def test_volumes_that_cannot_be_read_are_left_out_unless_they_are_wanted(
    study: Path, tmp_path: Path, run_json: Any
) -> None:
    (study / "volumes" / "broken.npy").write_bytes(bytes(range(100)))
    (study / "volumes" / "twin.npy").write_bytes((study / "volumes" / "v001.npy").read_bytes())
    arguments = ("--volumes", study, "--tool", "needle")
    code, [made], messages = run_json("study", tmp_path / "new", *arguments)
    assert code == 1
    assert [volume["id"] for volume in made["volumes"]] == ["twin", "v001", "v002"]
    assert "broken.npy: its content is of no format that can be opened. It is left out" in messages
    assert "v001.npy: it is the same volume as" in messages
    code, [made], messages = run_json("study", tmp_path / "all", *arguments, "--keep-unreadable")
    assert code == 0
    assert "broken" in [volume["id"] for volume in made["volumes"]]
    assert "taken all the same" in messages


def test_a_study_of_nothing_that_can_be_read_is_not_made(tmp_path: Path, run_json: Any) -> None:
    (tmp_path / "broken.npy").write_bytes(bytes(range(100)))
    code, _, messages = run_json("study", tmp_path, "--tool", "needle")
    assert code == 1
    assert "none of the volumes can be read" in messages
    assert not (tmp_path / "study.toml").exists()


def test_what_is_there_already_is_said_and_the_rest_is_added(
    study: Path, run_json: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (study / "study.toml").read_bytes()
    assert main(["study", str(study), "--add-volumes", str(study)]) == 0
    said = capsys.readouterr().out
    assert "2 of the volumes named are in it already" in said
    assert "nothing was added" in said
    assert (study / "study.toml").read_bytes() == before
    assert main(["study", str(study), "--add-annotators", "cara", "truth"]) == 0
    said = capsys.readouterr().out
    assert "truth annotates in it already" in said
    assert "1 annotator added" in said
    assert load_study(study).annotators == ("truth", "cara")


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
        (["--others", "never", "--add-annotators", "anna"], "--others is for new studies"),
        (["--seed", "0", "--add-annotators", "anna"], "--seed is for new studies"),
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
