import errno
import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from annotations import __version__
from annotations.documents.edits import clear, place_keypoint, set_certainty, set_state, set_status
from annotations.documents.record import changed
from annotations.documents.representations import document_targets, keypoints_of
from annotations.documents.study import StudyVolume
from annotations.durable_files import SaveError
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools, write_tool
from annotations.interchange.split import split_rule
from annotations.interchange.training_file import ExportOptions, export_targets
from tests.annotations.interchange.conftest import read_csv, read_hdf5

ROOT = Path(__file__).parents[3]
FORCEPS = shipped_tools()["magnetic-forceps"]
MakeStudy = Callable[..., Any]


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_hdf5_gives_back_what_the_documents_say(make_study: MakeStudy, tmp_path: Path, method: Any) -> None:
    study = make_study(3, methods=(method,))
    paths = [study.add(number, method=method) for number in (1, 2, 3)]
    exported = export_targets(study.folder, tmp_path / "targets.h5")

    data, attributes = read_hdf5(tmp_path / "targets.h5")
    assert (exported.rows, exported.method, exported.left_out) == (3, method, ())
    assert data["volume_id"].tolist() == ["v001", "v002", "v003"]
    assert data["path"][1] == "volumes/v002.npy"
    assert data["shape"].tolist() == [[1096, 1936, 1152]] * 3
    assert data["keypoint_names"].tolist() == list(FORCEPS.keypoint_names)
    assert data["has_position"].all()
    for row, number in enumerate((1, 2, 3)):
        document = study.document(number, method=method)
        targets = document_targets(document, FORCEPS)
        positions_um = [keypoint.position_um for keypoint in keypoints_of(document, FORCEPS)]
        assert np.array_equal(data["keypoints_um"][row], positions_um)
        assert np.array_equal(data["targets/position_um"][row], targets.position_um)
        assert np.array_equal(data["targets/orientation"][row], targets.orientation)
        assert data["targets/theta1_deg"][row] == targets.angles_deg["theta1"]
        assert data["targets/theta2_deg"][row] == targets.angles_deg["theta2"]
        assert data["fingerprint"][row] == document.volume.fingerprint
        assert data["document/path"][row] == f"annotations/anna/v{number:03d}.{method}.json"
        assert data["document/sha256"][row] == hashlib.sha256(paths[row].read_bytes()).hexdigest()
    assert attributes["schema"] == "oct-targets/1"
    assert attributes["program"] == f"oct-annotator {__version__}"
    assert (attributes["tool"], attributes["tool_fingerprint"]) == (FORCEPS.name, FORCEPS.fingerprint)
    assert (attributes["split_seed"], attributes["split_shares"].tolist()) == (0, [0.8, 0.2, 0.0])


def test_voxels_times_spacing_are_micrometres(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(1)
    study.save(place_keypoint(study.document(1), "k0", (159.0, 27.0, -4.7), "clicked"))
    export_targets(study.folder, tmp_path / "t.h5")

    data, _ = read_hdf5(tmp_path / "t.h5")
    assert data["keypoints_voxel"][0, 0] == pytest.approx([10.0, 2.0, -0.5])
    assert data["keypoints_voxel"] * data["spacing_um"][:, None] == pytest.approx(data["keypoints_um"])


def test_every_number_says_its_unit(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(1, methods=("boxes",))
    study.add(1, method="boxes")
    export_targets(study.folder, tmp_path / "t.h5")

    with h5py.File(tmp_path / "t.h5") as file:
        units = {
            name: item.attrs["units"]
            for group in (file, file["targets"])
            for name, item in group.items()
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "fi"
        }
    assert units == {
        "keypoints_um": "um",
        "keypoints_voxel": "voxel",
        "shape": "voxel",
        "spacing_um": "um",
        "position_um": "um",
        "orientation": "1 (unit vector)",
        "theta1_deg": "degree",
        "theta1_signed_deg": "degree",
        "theta2_deg": "degree",
        "theta2_signed_deg": "degree",
    }


def test_signed_angles_are_there_for_boxes_alone(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(1, methods=("keypoints", "boxes"))
    study.add(1)
    study.add(1, method="boxes")
    export_targets(study.folder, tmp_path / "k.h5")
    export_targets(study.folder, tmp_path / "b.h5", ExportOptions(method="boxes"))

    by_keypoints, by_boxes = read_hdf5(tmp_path / "k.h5")[0], read_hdf5(tmp_path / "b.h5")[0]
    signed = document_targets(study.document(1, method="boxes"), FORCEPS).signed_angles_deg
    assert not any("signed" in name for name in by_keypoints)
    assert by_boxes["targets/theta1_signed_deg"].tolist() == [signed["theta1"]]
    assert signed["theta1"] < 0
    assert by_boxes["targets/theta1_deg"] == pytest.approx(by_keypoints["targets/theta1_deg"])
    export_targets(study.folder, tmp_path / "k.csv")
    assert not any("signed" in name for name in read_csv(tmp_path / "k.csv")[0])


def test_what_is_absent_is_masked_and_what_was_said_is_kept(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    document = set_status(clear(study.document(1), "k1"), "done")
    document = set_certainty(set_state(document, "k3", "occluded"), "k3", "unsure")
    study.save(set_state(place_keypoint(document, "k5", (-50.0, 1.0, 2.0), "typed"), "k5", "out_of_view"))
    study.add(2)
    for name in ("t.h5", "t.csv"):
        export_targets(study.folder, tmp_path / name)

    data, _ = read_hdf5(tmp_path / "t.h5")
    assert data["has_position"].tolist() == [[True, False, True, True, True, True], [True] * 6]
    assert np.isnan(data["keypoints_um"][0, 1]).all()
    assert np.isfinite(data["keypoints_um"][data["has_position"]]).all()
    assert data["state"][0].tolist() == ["placed", "unplaced", "placed", "occluded", "placed", "out_of_view"]
    assert data["certainty"][0].tolist() == ["sure", "", "sure", "unsure", "sure", "sure"]
    assert data["source"][0, 5] == "typed"
    assert data["keypoints_um"][0, 5].tolist() == [-50.0, 1.0, 2.0]
    for name in ("position_um", "orientation", "theta1_deg"):
        assert data[f"targets/has_{name}"].tolist() == [False, True]
        assert np.isnan(data[f"targets/{name}"][0]).all()
    assert data["targets/has_theta2_deg"].all()
    first, second = read_csv(tmp_path / "t.csv")
    absent = {name for name in first if first[name] == "" and second[name] != ""}
    assert absent == {
        *(f"k1_{axis}_{unit}" for axis in "xyz" for unit in ("um", "voxel")),
        *("k1_certainty", "k1_source", "theta1_deg"),
        *(f"position_{axis}_um" for axis in "xyz"),
        *(f"orientation_{axis}" for axis in "xyz"),
    }


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_csv_says_the_same_as_hdf5_to_the_last_digit(
    make_study: MakeStudy, tmp_path: Path, method: Any
) -> None:
    study = make_study(3, methods=(method,))
    for number in (1, 2):
        study.add(number, method=method)
    third = study.document(3, method=method)
    study.save(set_status(clear(third, third.parts[0].name), "done"))
    for name in ("t.h5", "t.csv"):
        export_targets(study.folder, tmp_path / name)

    data, attributes = read_hdf5(tmp_path / "t.h5")
    columns: dict[str, Any] = {
        name: data[name] for name in ("volume_id", "path", "dataset", "fingerprint", "split")
    }
    columns |= {name: [attributes[name]] * 3 for name in ("schema", "method", "tool", "tool_fingerprint")}
    columns |= {f"document_{name}": data[f"document/{name}"] for name in ("path", "sha256")}
    columns |= {name: data[f"document/{name}"] for name in ("annotator", "repeat", "status")}
    columns["consensus_is_stale"] = data["document/consensus_is_stale"]
    for axis, letter in enumerate("xyz"):
        columns[f"shape_{letter}_voxel"] = data["shape"][:, axis]
        columns[f"spacing_{letter}_um"] = data["spacing_um"][:, axis]
        columns[f"position_{letter}_um"] = data["targets/position_um"][:, axis]
        columns[f"orientation_{letter}"] = data["targets/orientation"][:, axis]
        for k, name in enumerate(data["keypoint_names"]):
            columns[f"{name}_{letter}_um"] = data["keypoints_um"][:, k, axis]
            columns[f"{name}_{letter}_voxel"] = data["keypoints_voxel"][:, k, axis]
    for k, name in enumerate(data["keypoint_names"]):
        columns |= {f"{name}_{what}": data[what][:, k] for what in ("state", "certainty", "source")}
    for name in data:
        if name.startswith("targets/") and name.endswith("_deg") and "/has_" not in name:
            columns[name.removeprefix("targets/")] = data[name]
    rows = read_csv(tmp_path / "t.csv")
    assert set(rows[0]) == {*columns, "split_shares", "split_seed", "created", "program"}
    for name, values in columns.items():
        for row, value in zip(rows, values, strict=True):
            if isinstance(value, str):
                assert row[name] == value
            else:
                assert row[name] == "" if np.isnan(value) else float(row[name]) == value, name


def test_a_tool_of_other_keypoints_and_fewer_targets(make_study: MakeStudy, tmp_path: Path) -> None:
    needle = shipped_tools()["needle"]
    study = make_study(1, tool=needle)
    study.add(1)
    for name in ("t.h5", "t.csv"):
        export_targets(study.folder, tmp_path / name)

    data, _ = read_hdf5(tmp_path / "t.h5")
    assert data["keypoint_names"].tolist() == ["tip", "shaft"]
    assert data["keypoints_um"].shape == (1, 2, 3)
    assert sorted(name for name in data if name.startswith("targets/")) == [
        "targets/has_orientation",
        "targets/has_position_um",
        "targets/orientation",
        "targets/position_um",
    ]
    [row] = read_csv(tmp_path / "t.csv")
    assert "tip_x_um" in row
    assert not any(name.endswith("_deg") for name in row)


def test_a_tool_whose_names_collide_with_columns_is_refused(make_study: MakeStudy, tmp_path: Path) -> None:
    fields = shipped_tools()["needle"].model_dump(mode="json", by_alias=True)
    fields |= {"name": "pointer", "links": [], "targets": {"position": ["position"]}}
    fields["keypoints"] = [{"name": "position"}]
    own = ToolSpecification.model_validate(fields)
    study = make_study(1, tool=own)
    write_tool(own, study.folder / "tools" / "pointer.toml")
    document = place_keypoint(study.document(1), "position", (1.0, 2.0, 3.0), "clicked")
    study.save(set_status(document, "done"))

    with pytest.raises(UserError, match="two columns"):
        export_targets(study.folder, tmp_path / "t.h5")


def test_a_part_of_the_split_that_stays_empty_is_said(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    study.add(1)
    alone = export_targets(study.folder, tmp_path / "one.h5")
    study.add(2)
    both = export_targets(study.folder, tmp_path / "two.h5")

    assert alone.volumes == {"train": 1, "validation": 0, "test": 0}
    assert alone.remarks == (
        "no volume is in validation: there are too few of different data for this split",
    )
    assert both.volumes == {"train": 1, "validation": 1, "test": 0}
    assert both.remarks == ()


def test_every_annotation_gives_a_row_each_in_the_split_of_its_volume(
    make_study: MakeStudy, tmp_path: Path
) -> None:
    study = make_study(6)
    for number in range(1, 7):
        for annotator in ("anna", "ben"):
            study.add(number, annotator)
    study.add(1, "anna", repeat=1)
    wanted = ExportOptions(every_annotation=True, rule=split_rule([0.5, 0.5], 3))
    exported = export_targets(study.folder, tmp_path / "t.h5", wanted)

    data, _ = read_hdf5(tmp_path / "t.h5")
    assert exported.rows == 13
    assert exported.volumes == {"train": 3, "validation": 3, "test": 0}
    assert data["document/repeat"].tolist() == [0, 1] + [0] * 11
    split_by_volume = set(zip(data["volume_id"], data["split"], strict=True))
    assert len(split_by_volume) == 6


def test_volumes_of_one_fingerprint_share_a_split(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(8)
    for number in range(1, 9):
        document = study.document(number)
        study.save(changed(document, volume=changed(document.volume, fingerprint=f"{number % 2:064x}")))
    wanted = ExportOptions(rule=split_rule([0.5, 0.5], 0))
    export_targets(study.folder, tmp_path / "t.h5", wanted)

    data, _ = read_hdf5(tmp_path / "t.h5")
    assert len(set(zip(data["fingerprint"], data["split"], strict=True))) == 2
    assert set(data["split"]) == {"train", "validation"}


def test_a_dataset_in_a_file_of_several_is_named(make_study: MakeStudy, tmp_path: Path) -> None:
    volume = StudyVolume(id="v001", path="volumes/all.h5", dataset="scan/intensity")
    study = make_study(1, volumes=(volume,))
    document = study.document(1)
    study.save(changed(document, volume=changed(document.volume, dataset="scan/intensity")))
    export_targets(study.folder, tmp_path / "t.csv")

    [row] = read_csv(tmp_path / "t.csv")
    assert (row["path"], row["dataset"]) == ("volumes/all.h5", "scan/intensity")


def test_with_nothing_to_export_no_file_is_written(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(1)
    study.add(1, "anna")
    study.add(1, "ben")

    with pytest.raises(UserError, match=r"no volume has an annotation by keypoints.*anna, ben"):
        export_targets(study.folder, tmp_path / "t.h5")
    assert not (tmp_path / "t.h5").exists()


def test_a_name_without_a_known_ending_is_refused(make_study: MakeStudy, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no format"):
        export_targets(make_study(1).folder, tmp_path / "targets.npz")


@pytest.mark.parametrize("name", ["t.h5", "t.csv"])
def test_an_earlier_export_is_replaced_on_demand_and_nothing_else_ever(
    make_study: MakeStudy, tmp_path: Path, name: str
) -> None:
    study = make_study(1)
    study.add(1)
    output = tmp_path / name
    export_targets(study.folder, output)
    before = output.read_bytes()

    with pytest.raises(UserError, match="not overwritten"):
        export_targets(study.folder, output)
    assert output.read_bytes() == before
    wanted = ExportOptions(overwrite=True, rule=split_rule([0.0, 1.0], 7))
    export_targets(study.folder, output, wanted)
    assert output.read_bytes() != before

    with h5py.File(tmp_path / "volume.h5", "w") as volume:
        volume["data"] = np.zeros((2, 3, 4))
    (tmp_path / "list.csv").write_text("name,value\na,1\n")
    (tmp_path / "folder.h5").mkdir()
    for other in ("volume.h5", "list.csv", "folder.h5"):
        with pytest.raises(UserError, match="no training file"):
            export_targets(study.folder, tmp_path / other, wanted)
    assert (tmp_path / "list.csv").read_text() == "name,value\na,1\n"


def test_a_full_disk_leaves_the_old_file_whole(
    make_study: MakeStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = make_study(1)
    study.add(1)
    folder = tmp_path / "out"
    output = folder / "t.h5"
    export_targets(study.folder, output)
    before = output.read_bytes()

    def refuse(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(SaveError, match="No space left"):
        export_targets(study.folder, output, ExportOptions(overwrite=True))

    assert output.read_bytes() == before
    assert list(folder.iterdir()) == [output]


def test_a_cancelled_export_writes_nothing(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(3)
    shares: list[float] = []

    with pytest.raises(Cancelled):
        export_targets(
            study.folder, tmp_path / "t.h5", progress=shares.append, cancelled=lambda: len(shares) == 2
        )

    assert shares == [0, 1 / 3]
    assert not (tmp_path / "t.h5").exists()


def test_progress_ends_at_one(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    study.add(1)
    shares: list[float] = []
    export_targets(study.folder, tmp_path / "t.h5", progress=shares.append)

    assert shares == [0, 0.5, 1]


def test_a_killed_export_leaves_the_old_file_whole(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    for number in (1, 2):
        study.add(number)
    output = tmp_path / "t.h5"
    export_targets(study.folder, output)
    before = output.read_bytes()
    # The killed process is about to give the new content the file's name.
    program = (
        "import os, sys, time; from pathlib import Path\n"
        "from annotations.interchange.training_file import ExportOptions, export_targets\n"
        "def wait(*_args, **_kwargs): print('ready', flush=True); time.sleep(60)\n"
        "os.replace = os.rename = wait; Path.replace = wait\n"
        "export_targets(Path(sys.argv[1]), Path(sys.argv[2]), ExportOptions(overwrite=True))\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, str(study.folder), str(output)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.kill()

    assert output.read_bytes() == before
    export_targets(study.folder, output, ExportOptions(overwrite=True))


def test_a_name_that_no_text_file_can_hold_is_refused(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(1)
    document = study.document(1)
    study.save(changed(document, volume=changed(document.volume, fingerprint="\udc80")))

    for name in ("t.h5", "t.csv"):
        with pytest.raises(UserError, match="cannot be written"):
            export_targets(study.folder, tmp_path / name)


def test_the_example_in_the_documentation_reads_the_file(
    make_study: MakeStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = make_study(5)
    for number in range(1, 6):
        study.add(number)
    export_targets(study.folder, tmp_path / "targets.h5")
    page = (ROOT / "docs" / "training-files.md").read_text(encoding="utf-8")
    example = page.split("```python\n")[1].split("```")[0]
    monkeypatch.chdir(tmp_path)
    found: dict[str, Any] = {}
    exec(compile(example, "training-files.md", "exec"), found)

    assert sum(bool(line) for line in example.splitlines()) == 5
    assert found["keypoints_um"].shape == (4, 6, 3)
    assert len(found["paths"]) == 4
