import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from annotations.app_folders import tool_folder
from annotations.cli import main
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis import SceneSeed, random_scene, write_study

FORCEPS = shipped_tools()["magnetic-forceps"]
NEEDLE = shipped_tools()["needle"]


def test_targets_are_those_of_the_pose(truth_path: Path, run_json: Any) -> None:
    code, [fields], messages = run_json("targets", truth_path)

    pose = random_scene(FORCEPS, SceneSeed(3, 0)).pose
    assert (code, messages) == (0, "")
    assert fields["position_um"] == pytest.approx(pose.position_um)
    assert sum(part**2 for part in fields["orientation"]) == pytest.approx(1)
    assert fields["theta1_deg"] == pytest.approx(abs(pose.angles_deg["theta1"]))
    assert fields["theta2_deg"] == pytest.approx(abs(pose.angles_deg["theta2"]))
    assert fields["path"] == str(truth_path)
    assert (fields["tool"], fields["annotator"], fields["status"]) == ("magnetic-forceps", "truth", "done")


def test_targets_need_the_document_alone(truth_path: Path, tmp_path: Path, run_json: Any) -> None:
    alone = tmp_path / "elsewhere" / "a.json"
    alone.parent.mkdir()
    shutil.copy(truth_path, alone)
    shutil.rmtree(tmp_path / "study")

    code, [fields], _ = run_json("targets", alone)

    assert code == 0
    assert fields["theta1_deg"] is not None


def test_a_tool_of_ones_own_travels_in_the_document(tmp_path: Path, run_json: Any) -> None:
    own = NEEDLE.model_copy(update={"name": "my-needle"})
    write_study(tmp_path / "s", own, count=1, seed=1, shape=(9, 14, 11))
    alone = tmp_path / "a.json"
    shutil.copy(tmp_path / "s/annotations/truth/v001.keypoints.json", alone)
    shutil.rmtree(tmp_path / "s")

    code, [fields], _ = run_json("targets", alone)

    assert code == 0
    assert len(fields["orientation"]) == 3
    # A needle has no joints, and says nothing about them.
    assert not any(name.endswith("_deg") for name in fields)


@pytest.mark.parametrize("whose", ["study", "user"])
def test_a_tool_without_a_copy_is_found_in_the_folders(
    study: Path, truth_path: Path, rewrite: Callable[..., None], run_json: Any, whose: str
) -> None:
    own = FORCEPS.model_copy(update={"name": "my-forceps"})
    rewrite(lambda fields: fields.update(tool="my-forceps", tool_fingerprint=own.fingerprint))
    assert run_json("targets", truth_path)[0] == 1

    folder = study / "tools" if whose == "study" else tool_folder()
    folder.mkdir(parents=True)
    content = own.model_dump(mode="json", by_alias=True, exclude_none=True)
    (folder / "my-forceps.toml").write_text(tomli_w.dumps(content))

    assert run_json("targets", truth_path)[0] == 0


def test_unplaced_keypoints_leave_their_targets_unknown(
    truth_path: Path, rewrite: Callable[..., None], run_json: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    def forget_k5(fields: dict[str, Any]) -> None:
        fields["keypoints"] = fields["keypoints"][:5]

    rewrite(forget_k5)

    code, [fields], _ = run_json("targets", truth_path)
    assert main(["targets", str(truth_path)]) == 0

    assert code == 0
    assert fields["theta2_deg"] is None
    assert fields["theta1_deg"] is not None
    assert "theta2       unknown" in capsys.readouterr().out


def test_targets_in_words(truth_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["targets", str(truth_path)]) == 0

    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == str(truth_path)
    assert [line.split()[0] for line in lines[1:]] == ["position", "orientation", "theta1", "theta2"]
    assert lines[1].endswith("µm")
    assert lines[3].endswith("°")


def test_one_object_per_file_failed_ones_included(study: Path, tmp_path: Path, run_json: Any) -> None:
    files = [study / f"annotations/truth/v00{number}.keypoints.json" for number in (1, 2)]
    broken = tmp_path / "broken.json"
    broken.write_text(files[0].read_text()[:300])

    code, objects, messages = run_json("targets", files[0], broken, files[1])

    assert code == 1
    assert [fields["path"] for fields in objects] == [str(files[0]), str(broken), str(files[1])]
    assert [("error" in fields) for fields in objects] == [False, True, False]
    assert str(broken) in messages


def test_an_unknown_keypoint_is_named_with_its_file(
    truth_path: Path, rewrite: Callable[..., None], run_json: Any
) -> None:
    def rename(fields: dict[str, Any]) -> None:
        fields["keypoints"][2]["name"] = "k9"

    rewrite(rename)

    code, _, messages = run_json("targets", truth_path)

    assert code == 1
    assert "k9" in messages
    assert str(truth_path) in messages


def test_a_newer_schema_is_refused_and_left_alone(
    truth_path: Path, rewrite: Callable[..., None], run_json: Any
) -> None:
    rewrite(lambda fields: fields.update(schema="oct-annotation/2"))
    before = truth_path.read_bytes()

    code, _, messages = run_json("targets", truth_path)

    assert code == 1
    assert "oct-annotation/2" in messages
    assert json.loads(before)["schema"] == "oct-annotation/2"
    assert truth_path.read_bytes() == before


def test_what_was_filled_in_from_the_fit_does_not_pass_for_seen(
    truth_path: Path, rewrite: Callable[..., None], run_json: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    rewrite(lambda fields: fields["keypoints"][3].update(state="occluded", source="fitted"))

    _, [fields], _ = run_json("targets", truth_path)

    assert fields["keypoints"]["k3"] == {"state": "occluded", "certainty": "sure", "source": "fitted"}
    assert fields["keypoints"]["k0"]["source"] == "synthesized"
    main(["targets", str(truth_path)])
    assert "not seen     k3 (occluded, fitted)" in capsys.readouterr().out
