import errno
import hashlib
import os
import shutil
import tomllib
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from annotations import __version__
from annotations.documents.checks import check_file
from annotations.documents.files import load_annotation, tool_of
from annotations.documents.study import load_study
from annotations.documents.study_building import find_volumes, with_volumes
from annotations.documents.study_checks import check_study, is_wrong
from annotations.durable_files import SaveError
from annotations.errors import Cancelled, UserError
from annotations.geometry.frames import nearest_voxel
from annotations.geometry.tool_library import find_tool, shipped_tools
from annotations.synthesis import synthetic_study
from annotations.synthesis.conditions import SceneConditions
from annotations.synthesis.mesh_tool import read_mesh_tool
from annotations.synthesis.recipe import RECIPE_FILE, Recipe
from annotations.synthesis.synthetic_study import write_study
from annotations.volumes import open_volume
from tests.annotations.synthesis.stl_files import write_links

FORCEPS = shipped_tools()["magnetic-forceps"]
SHAPE = (22, 39, 23)


def files_in(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_study_holds_volumes_and_the_truth_about_them(empty_folder: Path) -> None:
    folder = empty_folder / "a" / "study"

    written = write_study(folder, FORCEPS, count=2, seed=1, shape=SHAPE, annotators=("anna",))

    study = load_study(folder)
    assert study == written
    assert study.annotators == ("truth", "anna")
    assert files_in(folder) == {
        "study.toml",
        "synthesis.toml",
        "annotations/truth/.writing.lock",
        "volumes/v001.npy",
        "volumes/v001.npy.volume.toml",
        "volumes/v002.npy",
        "volumes/v002.npy.volume.toml",
        "annotations/truth/v001.keypoints.json",
        "annotations/truth/v002.keypoints.json",
    }
    for name in ("v001", "v002"):
        path = folder / "annotations" / "truth" / f"{name}.keypoints.json"
        assert check_file(path) == ()
        annotation, _ = load_annotation(path)
        with open_volume(folder / "volumes" / f"{name}.npy") as volume:
            assert volume.shape == SHAPE
            assert volume.depth_axis == 2
            assert volume.spacing_um == annotation.volume.spacing_um


def test_the_truth_can_be_written_as_boxes_too(empty_folder: Path) -> None:
    write_study(
        empty_folder,
        FORCEPS,
        count=2,
        seed=1,
        shape=SHAPE,
        truth_methods=("keypoints", "boxes"),
        conditions=SceneConditions(out_of_view_probability=1.0, clutter=(1, 2)),
    )

    for name in ("v001", "v002"):
        keypoints, boxes = (
            empty_folder / f"annotations/truth/{name}.{method}.json" for method in ("keypoints", "boxes")
        )
        assert check_file(boxes) == ()
        exact = load_annotation(keypoints)[0].positions_um
        for link, box in load_annotation(boxes)[0].placed_boxes.items():
            assert box.base_um == pytest.approx(exact[FORCEPS.link(link).base], abs=1e-6)
            assert box.tip_um == pytest.approx(exact[FORCEPS.link(link).tip], abs=1e-6)


def test_keypoints_lie_inside_the_bright_tool(empty_folder: Path) -> None:
    write_study(empty_folder, FORCEPS, count=1, seed=5, shape=(110, 194, 115))
    annotation, _ = load_annotation(empty_folder / "annotations/truth/v001.keypoints.json")
    volume = np.load(empty_folder / "volumes/v001.npy")

    inwards = {}
    for link in FORCEPS.links:
        base, tip = (np.array(annotation.positions_um[end]) for end in (link.base, link.tip))
        inwards[link.base], inwards[link.tip] = base + 0.15 * (tip - base), tip - 0.15 * (tip - base)
    for position_um in inwards.values():
        x, y, z = nearest_voxel(position_um, annotation.volume.spacing_um, volume.shape)
        above = volume[x, y, : z + 1]
        assert above.max() > volume[0, 0].max()


def test_the_same_seed_gives_the_same_study(empty_folder: Path) -> None:
    for name in ("one", "two"):
        write_study(empty_folder / name, FORCEPS, count=2, seed=9, shape=SHAPE)

    for number in ("v001", "v002"):
        one, two = (empty_folder / name / "volumes" / f"{number}.npy" for name in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()
        documents = [
            load_annotation(empty_folder / name / f"annotations/truth/{number}.keypoints.json")[0]
            for name in ("one", "two")
        ]
        assert documents[0].keypoints == documents[1].keypoints
        assert documents[0].volume == documents[1].volume
    assert (empty_folder / "one/volumes/v001.npy").read_bytes() != (
        empty_folder / "one/volumes/v002.npy"
    ).read_bytes()


def test_more_volumes_continue_the_same_series(empty_folder: Path) -> None:
    write_study(empty_folder / "one", FORCEPS, count=1, seed=9, shape=SHAPE)
    write_study(empty_folder / "two", FORCEPS, count=2, seed=9, shape=SHAPE)

    first = [(empty_folder / name / "volumes/v001.npy").read_bytes() for name in ("one", "two")]
    assert first[0] == first[1]


def test_a_tool_of_the_users_own_travels_with_the_study(empty_folder: Path) -> None:
    own = FORCEPS.model_copy(update={"name": "my-forceps"})

    write_study(empty_folder / "s", own, count=1, seed=1, shape=SHAPE)
    moved = (empty_folder / "s").rename(empty_folder / "elsewhere")

    assert find_tool(load_study(moved).tool, (moved / "tools",)) == own
    path = moved / "annotations/truth/v001.keypoints.json"
    assert tool_of(load_annotation(path)[0]) == own
    assert check_file(path) == ()


@pytest.mark.parametrize("name", ["study.toml", "notes.txt"])
def test_a_folder_with_anything_in_it_is_left_alone(empty_folder: Path, name: str) -> None:
    (empty_folder / name).write_text("mine")

    with pytest.raises(UserError, match="already" if name == "study.toml" else "not empty"):
        write_study(empty_folder, FORCEPS, count=1, seed=1, shape=SHAPE)

    assert files_in(empty_folder) == {name}
    assert (empty_folder / name).read_text() == "mine"


def test_a_file_in_the_folders_place_is_left_alone(empty_folder: Path) -> None:
    (empty_folder / "s").write_text("mine")

    with pytest.raises(SaveError, match="cannot be used"):
        write_study(empty_folder / "s", FORCEPS, count=1, seed=1, shape=SHAPE)

    assert (empty_folder / "s").read_text() == "mine"


class Usage(NamedTuple):
    total: int
    used: int
    free: int


def test_too_little_room_is_told_before_the_work_begins(
    empty_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _folder: Usage(10**12, 10**12 - 10**9, 10**9))

    with pytest.raises(SaveError, match=r"need 4\.9 GB, and 1\.0 GB are free"):
        write_study(empty_folder / "s", FORCEPS, count=2, seed=1, shape=(1096, 1936, 1152))

    assert files_in(empty_folder) == set()


@pytest.mark.parametrize("existed", [True, False])
def test_a_failure_half_way_leaves_the_folder_as_it_was(
    empty_folder: Path, monkeypatch: pytest.MonkeyPatch, existed: bool
) -> None:
    folder = empty_folder / "s"
    if existed:
        folder.mkdir()

    def refuse(*_arguments: object) -> None:
        raise SaveError(os.strerror(errno.ENOSPC), where=folder)

    monkeypatch.setattr(synthetic_study, "save_study", refuse)

    with pytest.raises(SaveError, match="No space left"):
        write_study(folder, FORCEPS, count=2, seed=1, shape=SHAPE)

    assert folder.exists() == existed
    assert files_in(empty_folder) == set()


@pytest.mark.parametrize(("masks", "share", "most"), [(False, 0.7, 0.8), (True, 0.8, 0.85)])
def test_cancelling_leaves_the_folder_as_it_was(
    empty_folder: Path, masks: bool, share: float, most: float
) -> None:
    shares: list[float] = []

    with pytest.raises(Cancelled):
        write_study(
            empty_folder / "s",
            FORCEPS,
            count=2,
            seed=1,
            shape=SHAPE,
            masks=masks,
            progress=shares.append,
            cancelled=lambda: shares[-1] > share,
        )

    assert np.all(np.diff(shares) > 0)
    assert share < shares[-1] < most
    assert list(empty_folder.iterdir()) == []


def test_progress_covers_all_volumes(empty_folder: Path) -> None:
    shares: list[float] = []

    write_study(empty_folder / "s", FORCEPS, count=3, seed=1, shape=SHAPE, progress=shares.append)

    assert len(shares) == 3 * SHAPE[0]
    assert np.all(np.diff(shares) > 0)
    assert shares[-1] == pytest.approx(1)


def test_masks_lie_beside_the_volumes_and_are_none_of_the_study(empty_folder: Path) -> None:
    study = write_study(empty_folder, FORCEPS, count=2, seed=1, shape=SHAPE, masks=True)

    assert [volume.path for volume in study.volumes] == ["volumes/v001.npy", "volumes/v002.npy"]
    assert {path for path in files_in(empty_folder) if path.startswith("masks/")} == {
        f"masks/{name}.npy{suffix}" for name in ("v001", "v002") for suffix in ("", ".volume.toml")
    }
    for name in ("v001", "v002"):
        paths = [empty_folder / kind / f"{name}.npy" for kind in ("volumes", "masks")]
        with open_volume(paths[0]) as volume, open_volume(paths[1]) as mask:
            assert mask.shape == volume.shape == SHAPE
            assert mask.dtype == np.uint8
            assert (mask.spacing_um, mask.depth_axis) == (volume.spacing_um, volume.depth_axis)
        annotation, _ = load_annotation(empty_folder / "annotations/truth" / f"{name}.keypoints.json")
        positions_um = {point.name: point.position_um for point in annotation.keypoints}
        link = FORCEPS.links[0]
        middle_um = np.mean([positions_um[link.base], positions_um[link.tip]], axis=0)
        assert np.load(paths[1])[nearest_voxel(middle_um, annotation.volume.spacing_um, SHAPE)] == 1


def test_masks_change_nothing_in_the_volumes(empty_folder: Path) -> None:
    for masks in (False, True):
        write_study(empty_folder / str(masks), FORCEPS, count=1, seed=1, shape=SHAPE, masks=masks)

    one, other = (empty_folder / str(masks) / "volumes/v001.npy" for masks in (False, True))
    assert one.read_bytes() == other.read_bytes()


def test_a_study_with_masks_has_nothing_to_complain_of_and_no_more_volumes(empty_folder: Path) -> None:
    methods = ("keypoints", "boxes")
    study = write_study(
        empty_folder, FORCEPS, count=2, seed=1, shape=SHAPE, truth_methods=methods, masks=True
    )

    assert not any(is_wrong(finding) for _, finding in check_study(empty_folder))
    assert with_volumes(study, empty_folder, find_volumes(empty_folder)).added == ()


def test_masks_need_room_too(empty_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _folder: Usage(10**12, 10**12 - 10**9, 10**9))

    with pytest.raises(SaveError, match=r"need 4\.9 GB, and 1\.0 GB are free"):
        write_study(empty_folder, FORCEPS, count=1, seed=1, shape=(1096, 1936, 1152), masks=True)


def test_a_study_can_be_made_again_from_what_it_says_of_its_making(empty_folder: Path) -> None:
    conditions = SceneConditions(clutter=(1, 2), looks=(1.5, 3.0), out_of_view_probability=0.5)
    meshes = write_links(empty_folder / "meshes")
    mesh = read_mesh_tool(FORCEPS, meshes, 1000.0)
    write_study(empty_folder / "one", FORCEPS, count=2, seed=9, shape=SHAPE, conditions=conditions, mesh=mesh)

    recipe = Recipe.model_validate(tomllib.loads((empty_folder / "one" / RECIPE_FILE).read_text()))
    assert recipe.program == __version__
    assert recipe.tool_fingerprint == FORCEPS.fingerprint
    assert recipe.meshes is not None
    assert recipe.meshes.sha256 == {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in meshes.iterdir()
    }
    write_study(
        empty_folder / "two",
        shipped_tools()[recipe.tool],
        count=recipe.count,
        seed=recipe.seed,
        shape=recipe.shape,
        conditions=recipe.conditions,
        mesh=read_mesh_tool(FORCEPS, meshes, recipe.meshes.um_per_unit),
    )
    for number in ("v001", "v002"):
        one, two = (empty_folder / name / f"volumes/{number}.npy" for name in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()


def test_without_meshes_the_recipe_names_none(empty_folder: Path) -> None:
    write_study(empty_folder, FORCEPS, count=1, seed=1, shape=SHAPE)

    assert "meshes" not in tomllib.loads((empty_folder / RECIPE_FILE).read_text())
