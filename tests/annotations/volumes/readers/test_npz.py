import gc
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest

from annotations.app_folders import cache_folder
from annotations.volumes import VolumeError, fingerprint, open_volume
from annotations.volumes.readers import npz

WHOLE = (slice(None), slice(None), slice(None))


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_the_single_volume_among_other_members_is_found(tmp_path: Path, save, ramp: np.ndarray) -> None:
    save(tmp_path / "v.npz", pos=np.zeros(6), data=np.asfortranarray(ramp), name=np.array("x"), flat=ramp[0])
    with open_volume(tmp_path / "v.npz") as volume:
        assert volume.dataset == "data"
        assert volume.fortran_order
        np.testing.assert_array_equal(volume.read(WHOLE), ramp)
    with open_volume(tmp_path / "v.npz", dataset="data.npy") as volume:
        assert volume.dataset == "data"


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_members_describe_the_volume(tmp_path: Path, save, ramp: np.ndarray) -> None:
    save(tmp_path / "v.npz", data=ramp, voxel_size_mm=[0.1, 0.2, 0.3], depth_axis=0)
    volume = open_volume(tmp_path / "v.npz")
    assert volume.spacing_um == pytest.approx((100, 200, 300))
    assert (volume.spacing_source, volume.depth_axis) == ("file", 0)


def test_a_large_member_with_the_name_of_a_description_is_no_description(
    tmp_path: Path, ramp: np.ndarray
) -> None:
    np.savez(tmp_path / "v.npz", data=ramp, spacing_um=np.ones(10_000))
    assert open_volume(tmp_path / "v.npz").spacing_um is None


def test_an_archive_without_a_volume_says_what_it_holds(tmp_path: Path) -> None:
    np.savez(tmp_path / "v.npz", pos=np.zeros(6), words=np.array(["a"]))
    with pytest.raises(VolumeError, match=r"pos \(6,\) float64") as caught:
        open_volume(tmp_path / "v.npz")
    assert str(tmp_path / "v.npz") in str(caught.value)


def test_an_empty_archive_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "v.npz", "w") as archive:
        archive.writestr("readme.txt", "nothing here")
    with pytest.raises(VolumeError, match="no arrays"):
        open_volume(tmp_path / "v.npz")


def test_an_absent_member_is_refused(tmp_path: Path, ramp: np.ndarray) -> None:
    np.savez(tmp_path / "v.npz", data=ramp)
    with pytest.raises(VolumeError, match="absent") as caught:
        open_volume(tmp_path / "v.npz", dataset="absent")
    assert "data" in caught.value.remedy


def test_opening_a_compressed_member_does_not_inflate_it(
    tmp_path: Path, ramp: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez_compressed(tmp_path / "v.npz", data=ramp)
    inflated: list[object] = []
    make = npz._temporary_file
    monkeypatch.setattr(npz, "_temporary_file", lambda: inflated.append(1) or make())
    with open_volume(tmp_path / "v.npz") as volume:
        assert inflated == []
        volume.read(WHOLE)
        fingerprint(volume)
        assert inflated == [1]


def test_an_inflated_member_leaves_nothing_behind(tmp_path: Path, ramp: np.ndarray) -> None:
    np.savez_compressed(tmp_path / "v.npz", data=ramp)
    volume = open_volume(tmp_path / "v.npz")
    view = volume.read(WHOLE)
    assert cache_folder().is_dir()
    if os.name == "posix":
        # Nameless from the start: also a process that is killed leaves nothing.
        assert list(cache_folder().iterdir()) == []
    volume.close()
    np.testing.assert_array_equal(view, ramp)
    del view
    gc.collect()
    assert list(cache_folder().iterdir()) == []


def test_a_home_that_cannot_be_written_does_not_matter(
    tmp_path: Path, ramp: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez_compressed(tmp_path / "v.npz", data=ramp)
    monkeypatch.setattr(Path, "mkdir", lambda *_, **__: (_ for _ in ()).throw(PermissionError(13, "denied")))
    with open_volume(tmp_path / "v.npz") as volume:
        np.testing.assert_array_equal(volume.read(WHOLE), ramp)


def test_a_full_disk_is_reported_with_the_room_needed(
    tmp_path: Path, ramp: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez_compressed(tmp_path / "v.npz", data=ramp)

    def fail(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryFile", fail)
    volume = open_volume(tmp_path / "v.npz")
    with pytest.raises(VolumeError, match="No space left") as caught:
        volume.read(WHOLE)
    assert str(tmp_path / "v.npz") in str(caught.value)
    assert "room" in caught.value.remedy
    monkeypatch.undo()
    np.testing.assert_array_equal(volume.read(WHOLE), ramp)
    volume.close()


def test_a_damaged_member_is_reported_when_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "v.npz"
    np.savez_compressed(path, data=np.random.default_rng(0).integers(0, 255, (30, 30, 30), np.uint8))
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    volume = open_volume(path)
    with pytest.raises(VolumeError, match="damaged") as caught:
        volume.read(WHOLE)
    assert str(path) in str(caught.value)


def test_a_member_shorter_than_its_header_says_is_refused(tmp_path: Path, ramp: np.ndarray) -> None:
    np.save(tmp_path / "v.npy", ramp)
    content = (tmp_path / "v.npy").read_bytes()[:-1]
    for kind in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        with zipfile.ZipFile(tmp_path / "v.npz", "w", kind) as archive:
            archive.writestr("v.npy", content)
        with pytest.raises(VolumeError, match="cut short"):
            open_volume(tmp_path / "v.npz")


def test_an_archive_with_a_password_is_refused(tmp_path: Path, ramp: np.ndarray) -> None:
    path = tmp_path / "v.npz"
    np.savez(path, data=ramp)
    content = bytearray(path.read_bytes())
    for signature, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(signature) + flags] |= 1
    path.write_bytes(content)
    with pytest.raises(VolumeError, match="password"):
        open_volume(path)
