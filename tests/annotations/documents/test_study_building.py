import os
import sys
from collections.abc import Callable
from pathlib import Path

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from annotations.documents import study_building
from annotations.documents.queue import queue
from annotations.documents.study import STUDY_FILE, Study, StudyError, StudyVolume, load_study, save_study
from annotations.documents.study_building import (
    StudyChanged,
    create_study,
    drawn_seed,
    find_volumes,
    replace_study,
    study_of_volumes,
    volumes_at,
    why_not_in,
    with_annotators,
    with_repeats,
    with_rules,
    with_volumes,
)
from annotations.durable_files import SaveError
from annotations.geometry.tool import ToolError, ToolSpecification
from annotations.geometry.tool_library import load_tool, shipped_tools
from annotations.volumes import VolumeError, open_volume

NEEDLE = shipped_tools()["needle"]
WriteVolume = Callable[..., Path]


@pytest.fixture
def folder(tmp_path: Path, write_volume: WriteVolume) -> Path:
    """A folder with volumes of its own and in sub-folders, and with what is none."""
    folder = tmp_path / "Phantom series"
    names = ["scan 9.npy", "scan 10.npy", "day1/scan.npy", "day2/scan.npy", "day2/Größe_α.npy"]
    for seed, name in enumerate(names):
        write_volume(folder / name, seed)
    for name in (
        "annotations/anna.npy",
        "tools/tool.npy",
        "masks/v1.npy",
        ".hidden/secret.npy",
        "day1/deep/deeper.npy",
    ):
        write_volume(folder / name)
    (folder / "day1" / "readme.txt").write_text("notes")
    return folder


def study_of_folder(folder: Path, tool: str, *, study_folder: Path | None = None, **rules: object) -> Study:
    return study_of_volumes(volumes_at([folder]), tool, study_folder or folder, **rules)


def ids(study: Study) -> list[str]:
    return [volume.id for volume in study.volumes]


def study_with(count: int, **rules: object) -> Study:
    volumes = tuple(StudyVolume(id=f"v{number}", path=f"v{number}.npy") for number in range(count))
    return with_rules(Study(title="Trial", tool="needle", volumes=volumes), **rules)


def test_volumes_are_found_in_the_folder_and_in_those_directly_in_it(folder: Path) -> None:
    found = [path.relative_to(folder).as_posix() for path in find_volumes(folder)]
    assert found == ["scan 9.npy", "scan 10.npy", "day1/scan.npy", "day2/Größe_α.npy", "day2/scan.npy"]


def test_a_study_of_a_folder_names_volumes_after_their_files(folder: Path) -> None:
    study = study_of_folder(folder, "needle", annotators=("anna",), blind=True)
    assert (study.title, study.tool, study.annotators, study.blind) == (
        "Phantom series",
        "needle",
        ("anna",),
        True,
    )
    assert ids(study) == ["scan-9", "scan-10", "day1-scan", "Grosse", "day2-scan"]
    assert [volume.path for volume in study.volumes] == [
        "scan 9.npy",
        "scan 10.npy",
        "day1/scan.npy",
        "day2/Größe_α.npy",
        "day2/scan.npy",
    ]


def test_a_study_may_lie_elsewhere_than_its_volumes(folder: Path, tmp_path: Path) -> None:
    study_folder = tmp_path / "studies" / "first"
    study = study_of_folder(folder, "needle", study_folder=study_folder)
    assert study.title == "first"
    assert study.volumes[0].path == "../../Phantom series/scan 9.npy"
    create_study(study, study_folder, NEEDLE)
    for volume in load_study(study_folder).volumes:
        open_volume(study_folder / volume.path).close()


@pytest.mark.skipif(sys.platform == "win32", reason="links ask for a right there")
def test_a_study_in_a_linked_folder_finds_its_volumes(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "far" / "away").mkdir(parents=True)
    linked = tmp_path / "linked"
    linked.symlink_to(tmp_path / "far" / "away")
    study = study_of_folder(folder, "needle", study_folder=linked)
    for volume in study.volumes:
        open_volume(linked / volume.path).close()


def test_the_suffix_is_no_part_of_an_id_however_it_is_written(tmp_path: Path) -> None:
    (tmp_path / "SCAN.NPY").write_bytes(b"x")
    assert ids(study_of_folder(tmp_path, "needle")) == ["SCAN"]


def test_zarr_volumes_are_volumes_not_folders_of_them(tmp_path: Path) -> None:
    (tmp_path / "scan.ome.zarr").mkdir()
    (tmp_path / "scan.ome.zarr" / "zarr.json").write_text("{}")
    np.save(tmp_path / "scan.ome.zarr" / "inside.npy", np.zeros((2, 2, 2)))
    assert ids(study_of_folder(tmp_path, "needle")) == ["scan"]


def test_a_file_with_several_arrays_is_asked_about_when_it_is_opened(tmp_path: Path) -> None:
    np.savez(tmp_path / "both.npz", first=np.zeros((2, 3, 4)), second=np.zeros((2, 3, 4)))
    assert study_of_folder(tmp_path, "needle").volumes == (StudyVolume(id="both", path="both.npz"),)


def test_a_folder_without_volumes_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="there is no volume in this folder"):
        study_of_folder(tmp_path, "needle")
    with pytest.raises(VolumeError, match="gone"):
        study_of_folder(tmp_path / "gone", "needle")


def test_a_volume_on_another_drive_is_an_error(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_common_root(*_: object) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr(os.path, "relpath", no_common_root)
    assert study_of_folder(folder, "needle").volumes
    with pytest.raises(StudyError, match="on another drive") as refused:
        study_of_folder(folder, "needle", study_folder=folder / "day1")
    assert refused.value.where == folder / "scan 9.npy"


@pytest.mark.skipif(sys.platform == "win32", reason="every name there is Unicode")
def test_a_volume_whose_name_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "a\nb.npy").write_bytes(b"x")
    with pytest.raises(StudyError, match="rename the file") as refused:
        study_of_folder(tmp_path, "needle")
    assert refused.value.where == tmp_path / "a\nb.npy"


file_names = st.text(
    st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="/\\:"), min_size=1, max_size=8
).map(lambda name: f"{name}.npy")


@given(names=st.lists(st.tuples(st.sampled_from(["", "day1", "DAY 2"]), file_names), max_size=8))
def test_ids_are_valid_and_unique_whatever_the_files_are_called(names: list[tuple[str, str]]) -> None:
    paths = [Path("/study") / folder / name for folder, name in names]
    study = with_volumes(study_with(2), Path("/study"), paths).study
    folded = [each.casefold() for each in ids(study)]
    assert len(set(folded)) == len(folded) == 2 + len(set(paths))


def test_added_volumes_are_a_batch_of_their_own_and_known_ones_are_passed_over(
    folder: Path, write_volume: WriteVolume
) -> None:
    study = study_of_folder(folder, "needle", annotators=("anna",), order="shuffled")
    new = [write_volume(folder / "later" / name, 9) for name in ("scan 9.npy", "end.npy")]
    again = folder / "day1" / ".." / "scan 9.npy"
    enlarged = with_volumes(study, folder, [*new, again, new[0]])
    assert [(volume.id, volume.batch) for volume in enlarged.added] == [("later-scan-9", 1), ("end", 1)]
    assert enlarged.already_there == 2
    assert enlarged.study.volumes == (*study.volumes, *enlarged.added)
    before = queue(study, "anna", "keypoints")
    assert queue(enlarged.study, "anna", "keypoints")[: len(before)] == before
    assert with_volumes(enlarged.study, folder, new).study == enlarged.study


def test_added_annotators_come_after_those_there_are() -> None:
    study = study_with(2, annotators=("anna",), methods=("keypoints", "boxes"))
    more = with_annotators(study, ["ben", "cara"], {"ben": ("boxes",)})
    assert more.annotators == ("anna", "ben", "cara")
    assert more.methods_of("ben") == ("boxes",)
    assert more.methods_of("cara") == ("keypoints", "boxes")


@pytest.mark.parametrize(
    ("name", "problem"),
    [("Anna", "stands more than once"), ("a/b", "is also a folder's"), ("consensus", "can be called")],
)
def test_an_annotator_who_cannot_be_added_is_an_error_in_words(name: str, problem: str) -> None:
    with pytest.raises(StudyError, match=problem):
        with_annotators(study_with(2, annotators=("anna",)), [name])


@given(count=st.integers(0, 9), seed=st.integers(0, 99), relisted=st.permutations(range(9)))
def test_a_seed_draws_as_many_repeats_as_are_asked_for_and_always_the_same(
    count: int, seed: int, relisted: list[int]
) -> None:
    study = study_with(9, seed=seed)
    repeated = {volume.id for volume in with_repeats(study, count).volumes if volume.repeats}
    assert len(repeated) == count
    other_order = with_rules(study, volumes=tuple(study.volumes[place] for place in relisted))
    again = with_repeats(other_order, count, seed=seed)
    assert {volume.id for volume in again.volumes if volume.repeats} == repeated


def test_other_seeds_draw_other_repeats() -> None:
    drawn = {with_repeats(study_with(30), 5, seed=seed).volumes for seed in range(10)}
    assert len(drawn) == 10


def test_repeats_of_earlier_batches_stay() -> None:
    first = with_repeats(study_with(6), 3)
    enlarged = with_volumes(first, Path("/study"), [Path(f"/study/new{number}.npy") for number in range(4)])
    again = with_repeats(enlarged.study, 2)
    assert again.volumes[:6] == first.volumes
    assert sum(volume.repeats for volume in again.volumes[6:]) == 2


@pytest.mark.parametrize("count", [-1, 7])
def test_more_repeats_than_volumes_are_an_error(count: int) -> None:
    with pytest.raises(StudyError, match="there are 6"):
        with_repeats(study_with(6), count)


def test_an_existing_study_is_never_overwritten(folder: Path) -> None:
    study = study_of_folder(folder, "needle")
    create_study(study, folder, NEEDLE)
    written = (folder / STUDY_FILE).read_bytes()
    with pytest.raises(StudyError, match="not overwritten"):
        create_study(with_rules(study, title="Another"), folder, NEEDLE)
    assert (folder / STUDY_FILE).read_bytes() == written
    assert not (folder / "study.toml.bak").exists()


def test_a_tool_that_does_not_ship_is_copied_to_the_study(tmp_path: Path, probe: ToolSpecification) -> None:
    study = study_with(1, tool="probe")
    create_study(study, tmp_path / "first", probe)
    assert load_tool(tmp_path / "first" / "tools" / "probe.toml") == probe
    assert not (tmp_path / "first" / "tools" / "needle.toml").exists()
    # One that is there already, and the same, is used.
    (tmp_path / "first" / STUDY_FILE).unlink()
    create_study(study, tmp_path / "first", probe)
    assert load_study(tmp_path / "first") == study


def test_another_tool_of_that_name_in_the_study_is_an_error(tmp_path: Path, probe: ToolSpecification) -> None:
    create_study(study_with(1, tool="probe"), tmp_path, probe)
    (tmp_path / STUDY_FILE).unlink()
    other = probe.model_copy(update={"title": "Another probe"})
    with pytest.raises(ToolError, match="there is a file already"):
        create_study(study_with(1, tool="probe"), tmp_path, other)
    assert not (tmp_path / STUDY_FILE).exists()


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise SaveError("it could not be written", where=tmp_path)

    monkeypatch.setattr(study_building, "save_study", refuse)
    with pytest.raises(SaveError, match="could not be written"):
        create_study(study_with(1), tmp_path, NEEDLE)


def test_a_study_that_somebody_else_has_changed_is_not_replaced(tmp_path: Path) -> None:
    mine = study_with(2)
    save_study(mine, tmp_path)
    changed = with_annotators(mine, ["anna"])
    replace_study(changed, tmp_path, expected=mine)
    assert load_study(tmp_path) == changed
    with pytest.raises(StudyChanged, match="somebody has changed the study") as refused:
        replace_study(with_annotators(mine, ["ben"]), tmp_path, expected=mine)
    assert load_study(tmp_path) == refused.value.present == changed


def test_where_a_study_was_moved_away_nothing_is_made_anew(tmp_path: Path) -> None:
    mine = study_with(1)
    folder = tmp_path / "study"
    folder.mkdir()
    save_study(mine, folder)
    folder.rename(tmp_path / "moved")
    with pytest.raises(StudyError):
        replace_study(mine, folder, expected=mine)
    assert not folder.exists()


def test_a_study_inside_another_one_is_refused(folder: Path) -> None:
    create_study(study_of_folder(folder, "needle"), folder, NEEDLE)
    with pytest.raises(StudyError, match="lie inside the study “Phantom series”"):
        create_study(study_with(1), folder / "day3", NEEDLE)
    assert not (folder / "day3").exists()


def test_where_a_study_cannot_be_kept_is_told_beforehand(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert why_not_in(folder) == ""
    assert why_not_in(tmp_path / "not" / "yet" / "there") == ""
    assert "is not a folder" in why_not_in(folder / "scan 9.npy")
    create_study(study_of_folder(folder, "needle"), folder, NEEDLE)
    assert why_not_in(folder).startswith("There is a study in this folder already")
    assert "inside the study “Phantom series”" in why_not_in(folder / "day1")
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert why_not_in(tmp_path / "elsewhere").startswith(f"You may not write in {tmp_path}")


def test_seeds_are_drawn_anew() -> None:
    assert len({drawn_seed() for _ in range(20)}) > 1
