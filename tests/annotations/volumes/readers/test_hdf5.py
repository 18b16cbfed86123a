import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from annotations.volumes import DatasetChoiceNeeded, VolumeError, open_volume
from annotations.volumes.mapping import MappedStorage
from annotations.volumes.readers.hdf5 import Hdf5Storage

WHOLE = (slice(None), slice(None), slice(None))


def test_a_file_without_datasets_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file.create_group("empty")
    with pytest.raises(VolumeError, match="no arrays") as caught:
        open_volume(tmp_path / "v.h5")
    assert str(tmp_path / "v.h5") in str(caught.value)


def test_a_file_without_a_volume_says_what_it_holds(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file["plane"] = np.zeros((4, 5))
        for number in range(20):
            file[f"words{number:02}"] = "text"
    with pytest.raises(VolumeError, match=r"plane \(4, 5\).*and 9 more"):
        open_volume(tmp_path / "v.h5")


def test_one_of_several_datasets_is_chosen(tmp_path: Path, ramp: np.ndarray) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file["scans/a"] = ramp
        file["scans/b"] = ramp[:3].astype(">f4")
        file["notes"] = np.zeros(7)
    with pytest.raises(DatasetChoiceNeeded) as caught:
        open_volume(tmp_path / "v.h5")
    assert [(each.name, each.shape, each.dtype) for each in caught.value.choices] == [
        ("scans/a", (5, 6, 7), "<u2"),
        ("scans/b", (3, 6, 7), ">f4"),
    ]
    for name in ("scans/b", "/scans/b"):
        with open_volume(tmp_path / "v.h5", dataset=name) as volume:
            assert volume.dataset == "scans/b"
            np.testing.assert_array_equal(volume.read(WHOLE), ramp[:3])
    for name in ("scans/c", "scans"):
        with pytest.raises(VolumeError, match="no array") as refused:
            open_volume(tmp_path / "v.h5", dataset=name)
        assert "scans/a" in refused.value.remedy


def test_attributes_of_the_dataset_come_before_those_of_its_groups(tmp_path: Path, ramp: np.ndarray) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file.attrs["spacing_um"] = [9.0, 9.0, 9.0]
        file["scans/a"] = ramp
        file["scans"].attrs["element_size_um"] = [1.0, 2.0, 3.0]
        file["scans"].attrs["depth_axis"] = 1
        file["b"] = ramp
        file["c"] = ramp
        file["c"].attrs["resolution"] = [1.0, 2.0, 3.0]
        file["c"].attrs["units"] = "mm"
    found = {name: open_volume(tmp_path / "v.h5", dataset=name) for name in ("scans/a", "b", "c")}
    assert found["scans/a"].spacing_um == (1.0, 2.0, 3.0)
    assert found["scans/a"].depth_axis == 1
    assert found["b"].spacing_um == (9.0, 9.0, 9.0)
    assert found["c"].spacing_um == (1000.0, 2000.0, 3000.0)
    assert found["c"].spacing_source == "file"


@pytest.mark.parametrize(("options", "storage"), [({}, MappedStorage), ({"chunks": (2, 2, 2)}, Hdf5Storage)])
@pytest.mark.parametrize("userblock", [0, 512, 2048])
def test_contiguous_datasets_are_mapped(
    tmp_path: Path, ramp: np.ndarray, options: dict[str, object], storage: type, userblock: int
) -> None:
    with h5py.File(tmp_path / "v.h5", "w", userblock_size=userblock) as file:
        file.create_dataset("v", data=ramp, **options)
    with open_volume(tmp_path / "v.h5") as volume:
        assert isinstance(volume._storage, storage)
        np.testing.assert_array_equal(volume.read(WHOLE), ramp)


def test_a_dataset_of_bits_packed_otherwise_is_converted(tmp_path: Path) -> None:
    packed = h5py.h5t.STD_U16LE.copy()
    packed.set_precision(12)
    packed.set_offset(4)
    values = np.arange(24, dtype=np.uint16).reshape(2, 3, 4)
    with h5py.File(tmp_path / "v.h5", "w") as file:
        dataset = h5py.h5d.create(file.id, b"v", packed, h5py.h5s.create_simple((2, 3, 4)))
        dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, values)
    with open_volume(tmp_path / "v.h5") as volume:
        np.testing.assert_array_equal(volume.read(WHOLE), values)


def test_a_dataset_that_was_never_written_reads_its_fill_value(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file.create_dataset("v", (3, 4, 5), "u1", fillvalue=7)
    with open_volume(tmp_path / "v.h5") as volume:
        assert (volume.read(WHOLE) == 7).all()


def test_a_compact_and_a_virtual_dataset_are_read(tmp_path: Path, ramp: np.ndarray) -> None:
    with h5py.File(tmp_path / "source.h5", "w") as file:
        file["v"] = ramp
    layout = h5py.VirtualLayout(ramp.shape, ramp.dtype)
    layout[...] = h5py.VirtualSource(tmp_path / "source.h5", "v", ramp.shape)
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file.create_virtual_dataset("virtual", layout)
        properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        properties.set_layout(h5py.h5d.COMPACT)
        compact = h5py.h5d.create(
            file.id, b"compact", h5py.h5t.STD_U16LE, h5py.h5s.create_simple(ramp.shape), properties
        )
        compact.write(h5py.h5s.ALL, h5py.h5s.ALL, ramp)
    for name in ("virtual", "compact"):
        with open_volume(tmp_path / "v.h5", dataset=name) as volume:
            np.testing.assert_array_equal(volume.read(WHOLE), ramp)


def test_a_missing_compression_is_refused_at_once(tmp_path: Path, ramp: np.ndarray) -> None:
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_chunk(ramp.shape)
    properties.set_filter(32_015, h5py.h5z.FLAG_OPTIONAL, (1,))
    with h5py.File(tmp_path / "v.h5", "w") as file:
        h5py.h5d.create(file.id, b"v", h5py.h5t.STD_U16LE, h5py.h5s.create_simple(ramp.shape), properties)
    with pytest.raises(VolumeError, match="32015") as caught:
        open_volume(tmp_path / "v.h5")
    assert "hdf5plugin" in caught.value.remedy


def test_a_damaged_block_is_reported_when_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "v.h5"
    with h5py.File(path, "w") as file:
        noise = np.random.default_rng(0).integers(0, 255, (30, 30, 30), np.uint8)
        block = file.create_dataset(
            "v", data=noise, chunks=(30, 30, 30), compression="gzip"
        ).id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[block.byte_offset + 100 : block.byte_offset + 200] = bytes(100)
    path.write_bytes(content)
    with open_volume(path) as volume, pytest.raises(VolumeError) as caught:
        volume.read(WHOLE)
    assert str(path) in str(caught.value)


HOLDER = """
import sys
import h5py
with h5py.File(sys.argv[1], "r+") as file:
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_file_that_another_process_has_locked_is_read(tmp_path: Path, ramp: np.ndarray) -> None:
    with h5py.File(tmp_path / "v.h5", "w") as file:
        file["v"] = ramp
    command = [sys.executable, "-c", HOLDER, str(tmp_path / "v.h5")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with open_volume(tmp_path / "v.h5") as volume:
            np.testing.assert_array_equal(volume.read(WHOLE), ramp)
        holder.communicate()
