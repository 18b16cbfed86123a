import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from annotations.cli import main
from annotations.documents.annotation import Annotation
from annotations.documents.edits import clear, pose_tool, set_state
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.record import changed
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.rotations import from_yaw_pitch_roll, yaw_pitch_roll_deg
from annotations.geometry.tool_library import shipped_tools

FORCEPS = shipped_tools()["magnetic-forceps"]
ROLL_DEG = 37.2


@pytest.fixture
def repose(truth_path: Path) -> Callable[..., None]:
    """Bend the tool of the annotation file, whose root link has a roll of 37.2°."""

    def repose(theta1_deg: float, theta2_deg: float) -> None:
        document, identity = load_annotation(truth_path)
        rotation = from_yaw_pitch_roll(80.0, 10.0, ROLL_DEG)
        pose = ToolPose((8000.0, 9000.0, 5000.0), rotation, {"theta1": theta1_deg, "theta2": theta2_deg})
        save_annotation(pose_tool(document, FORCEPS, pose), truth_path, expected=identity)

    return repose


@pytest.fixture
def out(truth_path: Path) -> Path:
    return truth_path.with_name("v001.boxes.json")


def load(path: Path) -> Annotation:
    return load_annotation(path)[0]


def test_the_original_stays_and_the_new_file_says_where_it_comes_from(
    truth_path: Path, out: Path, repose: Callable[..., None], run_json: Any
) -> None:
    repose(-30.0, 40.0)
    before = truth_path.read_bytes()

    code, [fields], messages = run_json("convert", truth_path, "--to", "boxes", "-o", out)

    assert (code, messages) == (0, "")
    assert fields == {
        "path": str(out),
        "original": str(truth_path),
        "method": "boxes",
        "placed": ["link0", "link1", "link2"],
        "roll_deg": None,
    }
    assert truth_path.read_bytes() == before
    derived = load(out)
    assert {part.source for part in derived.boxes} == {"derived"}
    assert derived.derived_from is not None
    assert derived.derived_from.path == "v001.keypoints.json"
    assert derived.volume == load(truth_path).volume


def test_there_and_back_the_targets_stay(
    truth_path: Path, out: Path, repose: Callable[..., None], run_json: Any
) -> None:
    repose(-30.0, 40.0)
    back = truth_path.with_name("back.json")
    assert run_json("convert", truth_path, "--to", "boxes", "-o", out)[0] == 0
    assert run_json("convert", out, "--to", "keypoints", "-o", back)[0] == 0

    _, [first, boxes, second], _ = run_json("targets", truth_path, out, back)

    for name in ("theta1_deg", "theta2_deg"):
        assert boxes[name] == pytest.approx(first[name], abs=1e-9)
        assert second[name] == pytest.approx(first[name], abs=1e-9)
    assert second["position_um"] == pytest.approx(first["position_um"], abs=1e-9)
    assert (boxes["theta1_signed_deg"], boxes["theta2_signed_deg"]) == pytest.approx((-30.0, 40.0))
    assert not any("signed" in name for name in (*first, *second))


def test_a_roll_that_only_a_person_knows_is_asked_for(
    truth_path: Path, out: Path, repose: Callable[..., None], run_json: Any
) -> None:
    repose(-30.0, 0.0)

    code, [fields], messages = run_json("convert", truth_path, "--to", "boxes", "-o", out)

    assert code == 1
    assert str(truth_path) in messages
    assert "--roll-deg 37.2" in messages
    assert "--roll-deg -142.8" in messages
    assert "error" in fields
    assert not out.exists()

    again = run_json("convert", truth_path, "--to", "boxes", "--roll-deg", "-142.8", "-o", out)
    assert again[::2] == (0, "")
    derived = load(out)
    assert yaw_pitch_roll_deg(derived.placed_boxes["link0"].rotation_wxyz)[2] == pytest.approx(-142.8)
    assert derived.derived_from is not None
    assert derived.derived_from.roll_deg == -142.8
    assert run_json("targets", out)[1][0]["theta1_signed_deg"] == pytest.approx(30.0)


def test_a_straight_tool_needs_a_roll(
    truth_path: Path, out: Path, repose: Callable[..., None], run_json: Any
) -> None:
    repose(0.0, 0.0)

    code, _, messages = run_json("convert", truth_path, "--to", "boxes", "-o", out)

    assert code == 1
    assert "no clear bend shows it. Say it: --roll-deg R." in messages


def test_a_roll_against_the_bend_is_taken_with_a_word(
    truth_path: Path, out: Path, repose: Callable[..., None], run_json: Any
) -> None:
    repose(-30.0, 40.0)

    code, [fields], messages = run_json("convert", truth_path, "--to", "boxes", "--roll-deg", 100, "-o", out)

    assert (code, fields["roll_deg"]) == (0, 100.0)
    assert "the bend shows a roll of 37.2° for link0" in messages
    assert "62.8° off" in messages
    assert yaw_pitch_roll_deg(load(out).placed_boxes["link0"].rotation_wxyz)[2] == pytest.approx(100.0)


def test_keypoints_that_end_no_box_are_named(
    truth_path: Path, out: Path, repose: Callable[..., None], run_json: Any
) -> None:
    repose(-30.0, 40.0)
    document, identity = load_annotation(truth_path)
    save_annotation(clear(document, "k4"), truth_path, expected=identity)

    code, [fields], messages = run_json(
        "convert", truth_path, "--to", "boxes", "--roll-deg", ROLL_DEG, "-o", out
    )

    assert (code, fields["placed"]) == (0, ["link0", "link1"])
    assert "no box ends at k5" in messages


def test_nothing_is_overwritten(
    truth_path: Path, out: Path, repose: Callable[..., None], run_json: Any
) -> None:
    repose(-30.0, 40.0)
    out.write_text("mine")

    code, _, messages = run_json("convert", truth_path, "--to", "boxes", "-o", out)

    assert code == 1
    assert f"{out}: there is a file already, and it is not overwritten" in messages
    assert out.read_text() == "mine"


def test_a_folder_is_no_place_for_a_file(
    truth_path: Path, repose: Callable[..., None], run_json: Any
) -> None:
    repose(-30.0, 40.0)
    folder = truth_path.parent

    code, _, messages = run_json("convert", truth_path, "--to", "boxes", "-o", folder)

    assert code == 1
    assert f"{folder}: it is a folder" in messages
    assert f"-o {folder / 'v001.boxes.json'}" in messages


def test_no_zero_is_negative(truth_path: Path, out: Path, run_json: Any) -> None:
    document, identity = load_annotation(truth_path)
    pose = ToolPose(
        (8000.0, 9000.0, 5000.0), from_yaw_pitch_roll(80.0, 10.0, -0.01), {"theta1": 30.0, "theta2": 0.0}
    )
    save_annotation(pose_tool(document, FORCEPS, pose), truth_path, expected=identity)
    messages = run_json("convert", truth_path, "--to", "boxes", "-o", out)[2]
    assert "--roll-deg 0.0" in messages
    assert "-0.0" not in messages

    assert run_json("convert", truth_path, "--to", "boxes", "--roll-deg=-0.0", "-o", out)[0] == 0

    derivation = load(out).derived_from
    assert derivation is not None
    assert str(derivation.roll_deg) == "0.0"


def test_the_same_method_is_refused(truth_path: Path, out: Path, run_json: Any) -> None:
    code, _, messages = run_json("convert", truth_path, "--to", "keypoints", "-o", out)

    assert code == 1
    assert "it is a document of keypoints already" in messages


@pytest.mark.parametrize(
    "arguments",
    [
        ["--to", "keypoints", "--roll-deg", "5"],
        ["--to", "boxes", "--roll-deg", "nan"],
        ["--to", "boxes", "--roll-deg", "left"],
        ["--to", "masks"],
        [],
    ],
)
def test_misuse_is_told_apart(truth_path: Path, out: Path, arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["convert", str(truth_path), "-o", str(out), *arguments])
    assert caught.value.code == 2
    assert not out.exists()


def test_a_conversion_in_words(
    truth_path: Path, out: Path, repose: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    repose(-30.0, 40.0)
    assert main(["convert", str(truth_path), "--to", "boxes", "-o", str(out)]) == 0
    assert capsys.readouterr().out == f"{out}\n  boxes        link0, link1, link2\n"

    assert main(["targets", str(out)]) == 0
    assert "theta1       30.00°, signed -30.00°" in capsys.readouterr().out


def test_boxes_that_are_missing_leave_their_targets_unknown(
    truth_path: Path, out: Path, repose: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    repose(-30.0, 40.0)
    assert main(["convert", str(truth_path), "--to", "boxes", "-o", str(out)]) == 0
    derived, identity = load_annotation(out)
    save_annotation(clear(derived, "link2"), out, expected=identity)
    capsys.readouterr()

    assert main(["targets", "--json", str(out)]) == 0
    fields = json.loads(capsys.readouterr().out)
    assert fields["theta2_deg"] is None
    assert "theta2_signed_deg" not in fields
    assert main(["targets", str(out)]) == 0
    assert "theta2       unknown: its boxes are not all placed" in capsys.readouterr().out


def test_checks_read_boxes(truth_path: Path, out: Path, repose: Callable[..., None], run_json: Any) -> None:
    repose(-30.0, 40.0)
    assert run_json("convert", truth_path, "--to", "boxes", "-o", out)[0] == 0
    assert run_json("check", out)[0] == 0
    derived, identity = load_annotation(out)
    wrong = changed(set_state(clear(derived, "link2"), "link0", "out_of_view"), status="done")
    save_annotation(wrong, out, expected=identity)

    code, [fields], _ = run_json("check", out)

    assert code == 1
    assert [finding["kind"] for finding in fields["findings"]] == ["box", "box"]


def test_nothing_is_written_where_nothing_follows(
    truth_path: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document, identity = load_annotation(truth_path)
    for name in ("k1", "k3", "k5"):
        document = clear(document, name)
    save_annotation(document, truth_path, expected=identity)

    assert main(["convert", str(truth_path), "--to", "boxes", "--roll-deg", "0", "-o", str(out)]) == 1

    assert "no boxes follow from what is placed" in capsys.readouterr().err
    assert not out.exists()
