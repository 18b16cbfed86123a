import errno
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from annotations.app_folders import tool_folder
from annotations.cli import main
from annotations.cli import synthesize as command
from annotations.documents.study import load_study
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis import (
    FULL_SHAPE,
    PLAIN_CONDITIONS,
    REALTIME_SHAPE,
    TRAINING_CONDITIONS,
    SceneConditions,
)
from tests.annotations.synthesis.stl_files import (
    link_shapes,
    without,
    write_configurations,
    write_links,
    write_stl,
)

SMALL = ("--shape", 9, 14, 11)


def test_synthesize_makes_a_study(tmp_path: Path, run_json: Any) -> None:
    folder = tmp_path / "s"

    code, objects, messages = run_json("synthesize", folder, "--count", 2, "--seed", 7, *SMALL)

    assert (code, messages) == (0, "")
    assert [fields["path"] for fields in objects] == [str(folder / f"volumes/v00{n}.npy") for n in (1, 2)]
    for fields in objects:
        assert list(np.load(fields["path"], mmap_mode="r").shape) == fields["shape"] == [9, 14, 11]
        assert run_json("check", fields["annotation"], fields["boxes"])[0] == 0
    assert load_study(folder).tool == "magnetic-forceps"


def test_what_was_made_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "s"

    assert main(["synthesize", str(folder), "--count", "1", "--seed", "7", *map(str, SMALL)]) == 0

    assert capsys.readouterr().out.splitlines() == [
        str(folder / "volumes/v001.npy"),
        f"  truth  {folder / 'annotations/truth/v001.keypoints.json'}",
        f"  boxes  {folder / 'annotations/truth/v001.boxes.json'}",
    ]


def test_masks_are_made_where_they_are_asked_for(
    tmp_path: Path, run_json: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    wishes = ("--count", 1, "--seed", 7, *SMALL, "--masks")

    code, [fields], messages = run_json("synthesize", tmp_path / "s", *wishes)

    assert (code, messages) == (0, "")
    mask = tmp_path / "s" / "masks" / "v001.npy"
    assert fields["mask"] == str(mask)
    assert set(np.unique(np.load(mask))) == {0, 1, 2, 3}
    assert run_json("check", tmp_path / "s")[0] == run_json("check", tmp_path / "s", "--json")[0] == 0
    assert main(["synthesize", str(tmp_path / "t"), *map(str, wishes)]) == 0
    assert capsys.readouterr().out.splitlines()[3] == f"  mask   {tmp_path / 't' / 'masks' / 'v001.npy'}"


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What a study would be made with; none is made."""
    asked: dict[str, Any] = {}

    def remember(*_arguments: object, **options: object) -> None:
        asked.update(options)
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "write_study", remember)
    return asked


@pytest.mark.parametrize(("words", "shape"), [((), FULL_SHAPE), (("--realtime",), REALTIME_SHAPE)])
def test_the_shape_is_the_full_volumes_unless_given(
    tmp_path: Path, asked: dict[str, Any], words: tuple[str, ...], shape: tuple[int, int, int]
) -> None:
    assert main(["synthesize", str(tmp_path / "s"), "--count", "1", "--seed", "1", *words]) == 130

    assert asked["shape"] == shape


@pytest.mark.parametrize(
    ("words", "conditions"),
    [
        ("", PLAIN_CONDITIONS),
        ("--varied", TRAINING_CONDITIONS),
        (
            "--out-of-view 0.3 0.2",
            SceneConditions(out_of_view_probability=0.3, largest_out_of_view_share=0.2),
        ),
        ("--clutter 3", SceneConditions(clutter=(3, 3))),
        ("--noise-sigma-grey 5", SceneConditions(noise_sigma_grey=(5.0, 5.0))),
        ("--looks 1.5", SceneConditions(looks=(1.5, 1.5))),
        ("--varied --clutter 0", TRAINING_CONDITIONS.model_copy(update={"clutter": (0, 0)})),
    ],
)
def test_conditions_are_what_was_asked_for(
    tmp_path: Path, asked: dict[str, Any], words: str, conditions: SceneConditions
) -> None:
    assert main(["synthesize", str(tmp_path / "s"), "--count", "1", "--seed", "1", *words.split()]) == 130

    assert asked["conditions"] == conditions


def test_conditions_reach_the_volumes(tmp_path: Path) -> None:
    for name, words in (("plain", []), ("noisy", ["--noise-sigma-grey", "20"])):
        arguments = ["synthesize", str(tmp_path / name), "--count", "1", "--seed", "7", *map(str, SMALL)]
        assert main([*arguments, *words]) == 0

    plain, noisy = (np.load(tmp_path / name / "volumes/v001.npy").std() for name in ("plain", "noisy"))
    assert noisy > plain + 3


@pytest.mark.parametrize("name", ["needle", "my-needle"])
def test_another_tool_is_chosen_by_name(tmp_path: Path, run_json: Any, name: str) -> None:
    own = shipped_tools()["needle"].model_copy(update={"name": "my-needle"})
    tool_folder().mkdir(parents=True)
    content = own.model_dump(mode="json", by_alias=True, exclude_none=True)
    (tool_folder() / "my-needle.toml").write_text(tomli_w.dumps(content))

    code, [fields], _ = run_json(
        "synthesize", tmp_path / "s", "--count", 1, "--seed", 7, "--tool", name, *SMALL
    )

    assert code == 0
    assert load_study(tmp_path / "s").tool == name
    assert run_json("check", fields["annotation"])[0] == 0


@pytest.mark.parametrize(
    "wrong",
    [
        ["--count", "0"],
        ["--count", "many"],
        ["--seed", "-1"],
        ["--shape", "9", "0", "11"],
        ["--shape", "9", "14"],
        ["--realtime", *map(str, SMALL)],
        ["--out-of-view", "0.5", "1.5"],
        ["--out-of-view", "0.5"],
        ["--clutter", "101"],
        ["--noise-sigma-grey", "-1"],
        ["--noise-sigma-grey", "100"],
        ["--looks", "0"],
        ["--looks", "few"],
        ["--tool", "spoon"],
        ["--mesh-unit-um", "1000"],
        ["--mesh-unit-um", "0", "--meshes", "."],
    ],
)
def test_impossible_wishes_are_misuse(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wrong: list[str]
) -> None:
    wishes = {"--count": ["--count", "1"], "--seed": ["--seed", "1"], "--shape": list(map(str, SMALL))}
    wishes[wrong[0]] = wrong

    with pytest.raises(SystemExit) as caught:
        main(["synthesize", str(tmp_path / "s"), *(word for words in wishes.values() for word in words)])

    assert caught.value.code == 2
    assert wrong[0] in capsys.readouterr().err
    assert not (tmp_path / "s").exists()


def test_meshes_take_the_place_of_the_specifications_body(tmp_path: Path, run_json: Any) -> None:
    meshes = write_links(tmp_path / "meshes")
    shape = ("--shape", 28, 40, 30)

    plain = run_json("synthesize", tmp_path / "plain", "--count", 1, "--seed", 3, *shape)
    meshed = run_json("synthesize", tmp_path / "s", "--count", 1, "--seed", 3, *shape, "--meshes", meshes)

    assert (meshed[0], meshed[2]) == (0, "")
    assert run_json("check", meshed[1][0]["annotation"])[0] == 0
    first, second = (np.load(result[1][0]["path"]).astype(float) for result in (plain, meshed))
    # Of the same seed, and much alike: sharp edges in place of rounded ones.
    assert 0 < np.mean(first != second) < 0.2


def test_joints_stand_as_one_of_the_meshes_does(tmp_path: Path, run_json: Any) -> None:
    meshes = write_configurations(tmp_path / "meshes", (-35, 50))

    wishes = ("--count", 1, "--seed", 3, *SMALL, "--meshes", meshes, "--mesh-unit-um", 1000)
    code, [fields], _ = run_json("synthesize", tmp_path / "s", *wishes)

    assert code == 0
    _, [targets], _ = run_json("targets", fields["annotation"])
    assert [targets["theta1_deg"], targets["theta2_deg"]] == pytest.approx([35, 50])


def test_what_was_mended_is_told(tmp_path: Path, run_json: Any) -> None:
    meshes = write_links(tmp_path / "meshes")
    write_stl(without(link_shapes()["link2"], 0), meshes / "link2.stl")

    code, _, messages = run_json(
        "synthesize", tmp_path / "s", "--count", 1, "--seed", 3, *SMALL, "--meshes", meshes
    )

    assert code == 0
    assert f"{meshes / 'link2.stl'}: mended: holes filled with 1 triangles" in messages


def test_meshes_that_cannot_be_used_are_told_before_anything_is_made(tmp_path: Path, run_json: Any) -> None:
    meshes = write_links(tmp_path / "meshes")
    (meshes / "link1.stl").write_bytes(b"solid")

    code, objects, messages = run_json(
        "synthesize", tmp_path / "s", "--count", 1, "--seed", 3, *SMALL, "--meshes", meshes
    )

    assert (code, objects) == (1, [])
    assert str(meshes / "link1.stl") in messages
    assert not (tmp_path / "s").exists()


def test_a_folder_in_use_is_left_alone(study: Path, run_json: Any) -> None:
    before = {path: path.stat().st_mtime_ns for path in study.rglob("*")}

    code, objects, messages = run_json("synthesize", study, "--count", 1, "--seed", 7, *SMALL)

    assert (code, objects) == (1, [])
    assert str(study) in messages
    assert "already" in messages
    assert {path: path.stat().st_mtime_ns for path in study.rglob("*")} == before


@pytest.mark.parametrize(
    ("function", "number"),
    [
        pytest.param("fsync", errno.ENOSPC, id="full disk"),
        pytest.param("mkdir", errno.EROFS, id="read-only folder"),
        pytest.param("mkdir", errno.EACCES, id="folder of another"),
    ],
)
def test_what_the_system_refuses_is_told(
    tmp_path: Path, run_json: Any, monkeypatch: pytest.MonkeyPatch, function: str, number: int
) -> None:
    def refuse(*_arguments: object, **_options: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, function, refuse)

    code, objects, messages = run_json("synthesize", tmp_path / "s", "--count", 1, "--seed", 7, *SMALL)

    assert (code, objects) == (1, [])
    assert os.strerror(number) in messages
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize("is_terminal", [True, False])
def test_progress_is_for_terminals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], is_terminal: bool
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: is_terminal)

    assert main(["synthesize", str(tmp_path / "s"), "--count", "1", "--seed", "7", *map(str, SMALL)]) == 0

    err = capsys.readouterr().err
    assert err.endswith("100%\n") if is_terminal else err == ""
