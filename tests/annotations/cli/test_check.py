import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from annotations.cli import main
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotations.geometry.tool_library import shipped_tools
from annotations.volumes import write_sidecar

Fields = dict[str, Any]
FORCEPS = shipped_tools()["magnetic-forceps"]


def kinds(fields: Fields) -> list[str]:
    return [finding["kind"] for finding in fields["findings"]]


def test_sound_files_have_no_findings(study: Path, run_json: Any) -> None:
    files = sorted((study / "annotations" / "truth").glob("*.json"))

    code, objects, messages = run_json("check", *files)

    assert (code, messages) == (0, "")
    assert objects == [{"path": str(path), "findings": []} for path in files]


def test_findings_in_words(study: Path, volume_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    volume_path.unlink()
    files = [study / f"annotations/truth/v00{number}.keypoints.json" for number in (1, 2)]

    assert main(["check", *map(str, files)]) == 1

    captured = capsys.readouterr()
    lines = captured.out.splitlines()
    assert lines[0] == str(files[0])
    assert lines[1].startswith("  volume: ")
    assert str(volume_path) in lines[1]
    assert lines[2:] == [str(files[1]), "  nothing found"]


def _rename(fields: Fields) -> None:
    fields["keypoints"][2]["name"] = "k9"


def _duplicate(fields: Fields) -> None:
    fields["keypoints"][2]["name"] = "k1"


def _unknown_field(fields: Fields) -> None:
    fields["colour"] = "blue"


def _newer(fields: Fields) -> None:
    fields["schema"] = "oct-annotation/2"


def _position_without_state(fields: Fields) -> None:
    fields["keypoints"][0]["state"] = "unplaced"


def _zero_spacing(fields: Fields) -> None:
    fields["volume"]["spacing_um"][1] = 0.0


def _negative_spacing(fields: Fields) -> None:
    fields["volume"]["spacing_um"][1] = -13.5


@pytest.mark.parametrize(
    ("edit", "kind", "said"),
    [
        (_rename, "keypoint", "k9"),
        (_duplicate, "file", "k1"),
        (_unknown_field, "file", "colour"),
        (_newer, "file", "oct-annotation/2"),
        (_position_without_state, "file", "unplaced"),
        (_zero_spacing, "file", "spacing_um"),
        (_negative_spacing, "file", "spacing_um"),
    ],
)
def test_what_a_document_may_not_say_is_found(
    truth_path: Path,
    rewrite: Callable[..., None],
    run_json: Any,
    edit: Callable[[Fields], None],
    kind: str,
    said: str,
) -> None:
    rewrite(edit)
    before = truth_path.read_bytes()

    code, [fields], _ = run_json("check", truth_path)

    assert code == 1
    assert [finding["kind"] for finding in fields["findings"] if said in finding["problem"]] == [kind]
    assert truth_path.read_bytes() == before


def test_a_missing_volume_is_found(truth_path: Path, volume_path: Path, run_json: Any) -> None:
    volume_path.unlink()

    code, [fields], _ = run_json("check", truth_path)

    assert (code, kinds(fields)) == (1, ["volume"])


def test_a_changed_shape_is_found(truth_path: Path, volume_path: Path, run_json: Any) -> None:
    np.save(volume_path, np.load(volume_path)[:-1])

    code, [fields], _ = run_json("check", truth_path)

    assert (code, kinds(fields)) == (1, ["shape"])
    assert "(21, 39, 23)" in fields["findings"][0]["problem"]


def test_changed_content_is_found(truth_path: Path, volume_path: Path, run_json: Any) -> None:
    np.save(volume_path, np.load(volume_path)[::-1])

    code, [fields], _ = run_json("check", truth_path)

    assert (code, kinds(fields)) == (1, ["fingerprint"])


def test_a_changed_spacing_is_found(truth_path: Path, volume_path: Path, run_json: Any) -> None:
    write_sidecar(volume_path, (15.9, 13.5, 9.4), 2)

    code, [fields], _ = run_json("check", truth_path)

    assert (code, kinds(fields)) == (1, ["spacing"])


def test_a_truncated_file_and_an_absent_one_are_found(
    tmp_path: Path, truth_path: Path, run_json: Any
) -> None:
    truncated = tmp_path / "truncated.json"
    truncated.write_text(truth_path.read_text()[:400])

    code, objects, _ = run_json("check", truncated, tmp_path / "absent.json", truth_path)

    assert code == 1
    assert [kinds(fields) for fields in objects] == [["file"], ["file"], []]
    assert "line" in objects[0]["findings"][0]["problem"]


def test_an_implausible_link_is_found(truth_path: Path, rewrite: Callable[..., None], run_json: Any) -> None:
    def swap(fields: Fields) -> None:
        first, last = fields["keypoints"][0], fields["keypoints"][4]
        first["position_um"], last["position_um"] = last["position_um"], first["position_um"]

    rewrite(swap)

    code, [fields], _ = run_json("check", truth_path)

    assert code == 1
    assert "link" in kinds(fields)


def _swap_first(fields: Fields) -> None:
    first, second = fields["keypoints"][:2]
    first["position_um"], second["position_um"] = second["position_um"], first["position_um"]


def _open_too_far(fields: Fields) -> None:
    rotation = from_yaw_pitch_roll(80.0, 0.0, 90.0)
    pose = ToolPose((8000.0, 9000.0, 5000.0), rotation, {"theta1": 20.0, "theta2": 120.0})
    positions_um = keypoints_um(pose, FORCEPS)
    for keypoint in fields["keypoints"]:
        keypoint["position_um"] = list(positions_um[keypoint["name"]])


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (_swap_first, "exchange its ends, k0 and k1"),
        (_open_too_far, "theta2 would be 120°, beyond its limit of 90°"),
    ],
)
def test_what_the_tool_cannot_look_like_is_found(
    truth_path: Path,
    rewrite: Callable[..., None],
    run_json: Any,
    edit: Callable[[Fields], None],
    said: str,
) -> None:
    rewrite(edit)

    code, [fields], _ = run_json("check", truth_path)

    assert (code, kinds(fields)) == (1, ["plausibility"])
    assert said in fields["findings"][0]["problem"]


def test_output_is_json_also_when_text_is_not_ascii(
    truth_path: Path, rewrite: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    rewrite(lambda fields: fields.update(größe=1))

    assert main(["check", "--json", str(truth_path)]) == 1

    out = capsys.readouterr().out
    assert out.isascii()
    assert "größe" in json.loads(out)["findings"][0]["problem"]


def test_a_study_is_checked_as_a_whole(study: Path, volume_path: Path, run_json: Any) -> None:
    volume_path.unlink()

    code, objects, _ = run_json("check", study / "study.toml")

    assert code == 1
    by_path = {each["path"]: kinds(each) for each in objects}
    assert next(iter(by_path)) == str(study / "study.toml")
    assert by_path == {
        str(study / "study.toml"): ["note", "note"],
        str(study / "annotations" / "truth"): ["missing"],
        str(volume_path): ["volume"],
    }
    assert run_json("check", study)[1] == objects


def test_notes_alone_are_no_findings_for_the_exit_code(study: Path, run_json: Any) -> None:
    text = (study / "study.toml").read_text()
    (study / "study.toml").write_text(text.replace('    "boxes",\n', ""))

    code, [fields], _ = run_json("check", study)

    assert (code, kinds(fields)) == (0, ["note"])


def test_of_a_study_too_it_is_said_what_the_tool_cannot_look_like(
    study: Path, rewrite: Callable[..., None], truth_path: Path, run_json: Any
) -> None:
    rewrite(_swap_first)

    _, objects, _ = run_json("check", study)

    assert [kinds(each) for each in objects if each["path"] == str(truth_path)] == [["plausibility"]]


def test_every_annotation_in_a_folder_without_a_study_is_checked(
    study: Path, truth_path: Path, run_json: Any
) -> None:
    (study / "study.toml").unlink()
    files = sorted(truth_path.parent.glob("*.json"))

    for folder in (study, truth_path.parent):
        code, objects, _ = run_json("check", folder)
        assert (code, objects) == (0, [{"path": str(path), "findings": []} for path in files])


def test_a_folder_without_annotations_is_an_error(tmp_path: Path, run_json: Any) -> None:
    code, [fields], messages = run_json("check", tmp_path)

    assert code == 1
    assert "there is no annotation file in this folder" in messages
    assert fields["error"]


def test_a_study_that_cannot_be_read_is_an_error(study: Path, run_json: Any) -> None:
    (study / "study.toml").write_text("title = ")

    code, [fields], _ = run_json("check", study)

    assert code == 1
    assert "not valid TOML" in fields["error"]
