import os
import tempfile
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from annotations.volumes import (
    OMES_SPACING_UM,
    DatasetChoiceNeeded,
    VolumeError,
    open_volume,
    strided_preview,
    volume_paths,
    write_sidecar,
)

REAL_TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8", "?"]
WHOLE = (slice(None), slice(None), slice(None))


@st.composite
def arrays(draw: st.DrawFn) -> np.ndarray:
    dtype = np.dtype(draw(st.sampled_from("<>")) + draw(st.sampled_from(REAL_TYPES)))
    array = draw(hnp.arrays(dtype, hnp.array_shapes(min_dims=3, max_dims=3, max_side=5)))
    return np.asfortranarray(array) if draw(st.booleans()) else array


@st.composite
def regions(draw: st.DrawFn) -> tuple[slice, slice, slice]:
    bound = st.none() | st.integers(-6, 6)
    first, second, third = (slice(draw(bound), draw(bound), draw(st.integers(1, 3))) for _ in range(3))
    return (first, second, third)


@given(array=arrays(), region=regions(), data=st.data())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_every_format_type_and_order_reads_back(write, array, region, data) -> None:
    # A single page without any metadata is a picture, not a stack.
    assume(write.__name__ != "write_tiff_pages" or len(array) > 1)
    expected = (
        array.astype(np.uint8) if array.dtype.kind == "b" else array.astype(array.dtype.newbyteorder("="))
    )
    axis = data.draw(st.integers(0, 2))
    index = data.draw(st.integers(0, array.shape[axis] - 1))
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder), array)
        with open_volume(path) as volume:
            assert volume.shape == array.shape
            assert volume.dtype == expected.dtype
            assert volume.dtype.isnative
            whole = volume.read(WHOLE)
            assert whole.dtype == expected.dtype
            np.testing.assert_array_equal(whole, expected)
            np.testing.assert_array_equal(volume.read(region), expected[region])
            np.testing.assert_array_equal(volume.load(region), expected[region])
            plane = volume.slice_plane(axis, index)
            np.testing.assert_array_equal(plane, np.take(expected, index, axis))
            assert plane.flags.c_contiguous
            del whole


@pytest.mark.parametrize("name", ["volume.npy", "volume.npz"])
def test_extended_precision_reads_back(tmp_path: Path, name: str) -> None:
    array = np.linspace(0, 1, 24, dtype=np.longdouble).reshape(2, 3, 4)
    (np.save if name.endswith("npy") else np.savez)(tmp_path / name, array)
    np.testing.assert_array_equal(open_volume(tmp_path / name).read(WHOLE), array)


def test_a_file_says_how_it_is_stored(tmp_path: Path, ramp: np.ndarray) -> None:
    np.save(tmp_path / "big.npy", np.asfortranarray(ramp.astype(">u2")))
    volume = open_volume(tmp_path / "big.npy")
    assert volume.file_dtype == ">u2"
    assert volume.format == "npy"
    assert volume.fortran_order
    assert volume.path == tmp_path / "big.npy"
    assert volume.dataset is None
    assert (volume.spacing_um, volume.spacing_source, volume.depth_axis) == (None, None, 2)


def test_a_relative_path_becomes_absolute(
    tmp_path: Path, ramp: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.save(tmp_path / "v.npy", ramp)
    monkeypatch.chdir(tmp_path)
    assert open_volume(Path("v.npy")).path == tmp_path / "v.npy"


def test_the_content_tells_the_format_not_the_name(tmp_path: Path, ramp: np.ndarray) -> None:
    with h5py.File(tmp_path / "volume.npy", "w", userblock_size=1024) as file:
        file["v"] = ramp
    volume = open_volume(tmp_path / "volume.npy")
    assert volume.format == "hdf5"
    np.testing.assert_array_equal(volume.read(WHOLE), ramp)


@pytest.mark.parametrize("values", [[np.nan, np.inf, -np.inf, 1.0], [7.0, 7.0, 7.0, 7.0]])
def test_strange_values_are_handed_out_as_they_are(write, tmp_path: Path, values: list[float]) -> None:
    array = np.array(values, np.float32).reshape(1, 2, 2).repeat(2, axis=0)
    np.testing.assert_array_equal(open_volume(write(tmp_path, array)).read(WHOLE), array)


def refuse(path: Path, *said: str, dataset: str | None = None) -> VolumeError:
    """Expect an error that names the file, says all of this, and what to do."""
    before = path.read_bytes() if path.is_file() else None
    with pytest.raises(VolumeError) as caught:
        open_volume(path, dataset=dataset)
    text = str(caught.value)
    for each in (str(path), *said):
        assert each in text
    assert caught.value.remedy
    assert before is None or path.read_bytes() == before
    return caught.value


@pytest.mark.parametrize("suffix", ["npy", "npz", "h5", "tif"])
def test_an_empty_file_is_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"empty.{suffix}"
    path.touch()
    refuse(path, "empty")


@pytest.mark.parametrize("kept", [0.5, 0.999])
def test_a_truncated_npy_is_refused_at_once(tmp_path: Path, kept: float) -> None:
    path = tmp_path / "cut.npy"
    np.save(path, np.ones((20, 20, 20)))
    os.truncate(path, int(path.stat().st_size * kept))
    refuse(path, "cut short")


def test_a_truncated_header_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cut.npy"
    np.save(path, np.ones((2, 2, 2)))
    os.truncate(path, 40)
    refuse(path, "header")


@pytest.mark.parametrize(
    "kind", ["npz", "npz compressed", "hdf5", "hdf5 compressed", "tiff", "tiff compressed"]
)
def test_a_truncated_file_of_another_format_is_refused(
    writers, tmp_path: Path, kind: str, ramp: np.ndarray
) -> None:
    path = writers[kind](tmp_path, ramp)
    os.truncate(path, path.stat().st_size // 2)
    refuse(path)


@pytest.mark.parametrize("shape", [(), (5,), (4, 5), (2, 3, 4, 5)])
def test_other_than_three_axes_are_refused_with_the_shape(tmp_path: Path, shape: tuple[int, ...]) -> None:
    path = tmp_path / "array.npy"
    np.save(path, np.zeros(shape))
    refuse(path, f"{len(shape)} axes", *map(str, shape))


@pytest.mark.parametrize("shape", [(4, 5), (2, 3, 4, 5)])
@pytest.mark.parametrize("kind", ["npz", "hdf5", "tiff", "tiff compressed", "zarr 2", "zarr 3"])
def test_every_format_refuses_other_than_three_axes(
    writers, tmp_path: Path, kind: str, shape: tuple[int, ...]
) -> None:
    refuse(writers[kind](tmp_path, np.zeros(shape, np.uint8)), f"{len(shape)} axes", *map(str, shape))


@pytest.mark.parametrize("shape", [(0, 5, 6), (5, 0, 6), (5, 6, 0)])
def test_a_zero_size_axis_is_refused(tmp_path: Path, shape: tuple[int, int, int]) -> None:
    np.save(tmp_path / "nothing.npy", np.zeros(shape))
    refuse(tmp_path / "nothing.npy", "empty", " × ".join(map(str, shape)))


class Exploding:
    def __reduce__(self) -> tuple[object, ...]:
        return (os.mkdir, ("unpickled",))


@pytest.mark.parametrize("name", ["objects.npy", "objects.npz"])
def test_an_array_of_objects_is_refused_and_never_unpickled(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    array = np.empty((1, 1, 1), object)
    array[0, 0, 0] = Exploding()
    (np.save if name.endswith("npy") else np.savez)(tmp_path / name, array)
    refuse(tmp_path / name, "Python objects")
    assert not (tmp_path / "unpickled").exists()


@pytest.mark.parametrize(
    ("dtype", "kind"),
    [("c8", "complex"), ("U3", "text"), ("S3", "text"), ("M8[s]", "dates"), ([("a", "u1")], "records")],
)
def test_what_is_no_real_number_is_refused(tmp_path: Path, dtype: object, kind: str) -> None:
    np.save(tmp_path / "array.npy", np.zeros((2, 2, 2), np.dtype(dtype)))
    refuse(tmp_path / "array.npy", kind)


def test_an_unreadable_file_is_refused(
    tmp_path: Path, ramp: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.save(tmp_path / "v.npy", ramp)
    # Root may read everything, so the system's answer is injected.
    monkeypatch.setattr(Path, "open", lambda *_, **__: (_ for _ in ()).throw(PermissionError(13, "denied")))
    with pytest.raises(VolumeError, match="may not read") as caught:
        open_volume(tmp_path / "v.npy")
    assert caught.value.remedy


def test_a_folder_that_may_not_be_listed_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "iterdir", lambda _: (_ for _ in ()).throw(PermissionError(13, "denied")))
    with pytest.raises(VolumeError, match="may not read"):
        volume_paths(tmp_path)


def test_a_closed_folder_does_not_hide_the_volumes_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "v.npy").touch()
    (tmp_path / "closed").mkdir()
    is_file = Path.is_file

    def look(path: Path) -> bool:
        if path.parent.name == "closed":
            raise PermissionError(13, "denied")
        return is_file(path)

    monkeypatch.setattr(Path, "is_file", look)
    assert volume_paths(tmp_path) == [tmp_path / "v.npy"]


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    refuse(tmp_path / "missing.npy", "does not exist")


def test_a_folder_is_refused(tmp_path: Path) -> None:
    refuse(tmp_path, "folder")


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    (tmp_path / "volume.npy").write_text("x y z\n1 2 3\n")
    refuse(tmp_path / "volume.npy", "no format")


def test_a_dataset_of_a_plain_array_is_refused(tmp_path: Path, ramp: np.ndarray) -> None:
    np.save(tmp_path / "v.npy", ramp)
    refuse(tmp_path / "v.npy", "other", dataset="other")


def test_several_volumes_in_one_file_are_a_question(tmp_path: Path, ramp: np.ndarray) -> None:
    np.savez(tmp_path / "v.npz", first=ramp, second=ramp[:2].astype(np.float32), flat=ramp[0])
    with pytest.raises(DatasetChoiceNeeded) as caught:
        open_volume(tmp_path / "v.npz")
    assert [(each.name, each.shape, each.dtype) for each in caught.value.choices] == [
        ("first", (5, 6, 7), "<u2"),
        ("second", (2, 6, 7), "<f4"),
    ]
    volume = open_volume(tmp_path / "v.npz", dataset="second")
    assert (volume.dataset, volume.shape) == ("second", (2, 6, 7))


def test_a_sidecar_answers_and_wins(tmp_path: Path, ramp: np.ndarray) -> None:
    path = tmp_path / "v.npz"
    np.savez(path, volume=ramp, spacing_um=[1.0, 2.0, 3.0], depth_axis=1)
    volume = open_volume(path)
    assert (volume.spacing_um, volume.spacing_source, volume.depth_axis) == ((1.0, 2.0, 3.0), "file", 1)
    write_sidecar(path, (4.0, 5.0, 6.0), 0)
    volume = open_volume(path)
    assert (volume.spacing_um, volume.spacing_source, volume.depth_axis) == ((4.0, 5.0, 6.0), "sidecar", 0)


def test_a_sidecar_with_one_answer_leaves_the_other_to_the_file(tmp_path: Path, ramp: np.ndarray) -> None:
    path = tmp_path / "v.npz"
    np.savez(path, volume=ramp, spacing_um=[1.0, 2.0, 3.0], depth_axis=1)
    (tmp_path / "v.npz.volume.toml").write_text("depth_axis = 0\n")
    volume = open_volume(path)
    assert (volume.spacing_um, volume.spacing_source, volume.depth_axis) == ((1.0, 2.0, 3.0), "file", 0)


def test_a_folder_lists_its_volumes_in_natural_order(writers, tmp_path: Path, ramp: np.ndarray) -> None:
    for name in ("v10.npy", "v9.NPY", "v2.tif", "a.h5", "notes.txt", ".hidden.npy"):
        (tmp_path / name).touch()
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "inner.npy").touch()
    writers["zarr 3"](tmp_path, ramp)
    write_sidecar(tmp_path / "v10.npy", (1, 1, 1), 2)
    assert [path.name for path in volume_paths(tmp_path)] == [
        "a.h5",
        "three.zarr",
        "v2.tif",
        "v9.NPY",
        "v10.npy",
    ]


def test_a_training_file_is_no_volume_and_says_what_it_is(tmp_path: Path, ramp: np.ndarray) -> None:
    for name, schema in (("targets.h5", "oct-targets/1"), ("other.hdf5", "another/1"), ("scan.h5", None)):
        with h5py.File(tmp_path / name, "w") as file:
            file["volume"] = ramp
            if schema is not None:
                file.attrs["schema"] = schema
    assert [path.name for path in volume_paths(tmp_path)] == ["other.hdf5", "scan.h5"]
    refuse(tmp_path / "targets.h5", "training file")
    open_volume(tmp_path / "other.hdf5").close()


def anonymous_bytes() -> int:
    status = Path("/proc/self/status").read_text()
    return next(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith("RssAnon"))


@pytest.mark.skipif(
    not Path("/proc/self/status").exists(), reason="the kernel says how much memory is anonymous"
)
@pytest.mark.parametrize("fortran_order", [False, True])
def test_a_full_size_volume_opens_and_previews_in_little_memory(tmp_path: Path, fortran_order: bool) -> None:
    path = tmp_path / "full.npy"
    shape = (1096, 1936, 1152)
    with path.open("wb") as stream:
        header = {"descr": "|u1", "fortran_order": fortran_order, "shape": shape}
        np.lib.format.write_array_header_1_0(stream, header)
        stream.truncate(stream.tell() + int(np.prod(shape)))
    before = anonymous_bytes()
    volume = open_volume(path)
    preview = strided_preview(volume, OMES_SPACING_UM)
    assert 500_000 < preview.data.size <= 1_000_000
    assert anonymous_bytes() - before < 100 << 20
