from pathlib import Path

import numpy as np
import pytest
import tifffile

from annotations.volumes import DatasetChoiceNeeded, VolumeError, open_volume
from annotations.volumes.mapping import MappedStorage
from annotations.volumes.readers.tiff import PagedStorage

WHOLE = (slice(None), slice(None), slice(None))
GREY = {"photometric": "minisblack"}


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_an_ome_tiff_says_its_spacing(tmp_path: Path, ramp: np.ndarray, compression: str | None) -> None:
    tifffile.imwrite(
        tmp_path / "v.ome.tif",
        ramp,
        compression=compression,
        metadata={
            "axes": "ZYX",
            "PhysicalSizeX": 9.4,
            "PhysicalSizeY": 0.0135,
            "PhysicalSizeYUnit": "mm",
            "PhysicalSizeZ": 15_900.0,
            "PhysicalSizeZUnit": "nm",
        },
        **GREY,
    )
    with open_volume(tmp_path / "v.ome.tif") as volume:
        assert volume.spacing_um == pytest.approx((15.9, 13.5, 9.4))
        assert volume.spacing_source == "file"
        np.testing.assert_array_equal(volume.read(WHOLE), ramp)


def test_an_ome_tiff_without_a_depth_spacing_has_none(tmp_path: Path, ramp: np.ndarray) -> None:
    metadata = {"axes": "ZYX", "PhysicalSizeX": 9.4, "PhysicalSizeY": 13.5}
    tifffile.imwrite(tmp_path / "v.ome.tif", ramp, metadata=metadata, **GREY)
    assert open_volume(tmp_path / "v.ome.tif").spacing_um is None


@pytest.mark.parametrize(
    ("unit", "spacing_um"), [("um", (15.9, 13.5, 9.4)), ("mm", (15_900, 13_500, 9_400)), ("pixel", None)]
)
def test_imagej_says_its_spacing(
    tmp_path: Path, ramp: np.ndarray, unit: str, spacing_um: tuple[float, ...] | None
) -> None:
    tifffile.imwrite(
        tmp_path / "v.tif",
        ramp,
        imagej=True,
        resolution=(1 / 9.4, 1 / 13.5),
        metadata={"axes": "ZYX", "spacing": 15.9, "unit": unit},
    )
    found = open_volume(tmp_path / "v.tif").spacing_um
    assert found == (None if spacing_um is None else pytest.approx(spacing_um, rel=1e-6))


def test_a_resolution_for_printing_is_no_spacing(tmp_path: Path, ramp: np.ndarray) -> None:
    tifffile.imwrite(tmp_path / "v.tif", ramp, resolution=(300, 300), resolutionunit="inch", **GREY)
    assert open_volume(tmp_path / "v.tif").spacing_um is None


def test_metadata_of_a_plain_array_count(tmp_path: Path, ramp: np.ndarray) -> None:
    tifffile.imwrite(
        tmp_path / "v.tif", ramp, metadata={"spacing_um": [1.0, 2.0, 3.0], "depth_axis": 0}, **GREY
    )
    volume = open_volume(tmp_path / "v.tif")
    assert (volume.spacing_um, volume.depth_axis) == ((1.0, 2.0, 3.0), 0)


@pytest.mark.parametrize("shape", [(1, 1, 4, 5, 6), (1, 4, 1, 5, 6), (1, 1, 1, 5, 6)])
def test_single_times_and_channels_are_left_out(tmp_path: Path, shape: tuple[int, ...]) -> None:
    array = np.arange(np.prod(shape), dtype=np.uint8).reshape(shape)
    tifffile.imwrite(tmp_path / "v.ome.tif", array, metadata={"axes": "TZCYX"}, **GREY)
    with open_volume(tmp_path / "v.ome.tif") as volume:
        assert volume.shape == (max(shape[1], shape[2]), 5, 6)
        np.testing.assert_array_equal(volume.read(WHOLE).ravel(), array.ravel())


@pytest.mark.parametrize("axes", ["CZYX", "TZYX"])
def test_several_times_or_channels_are_refused_with_the_shape(tmp_path: Path, axes: str) -> None:
    array = np.zeros((2, 4, 5, 6), np.uint8)
    tifffile.imwrite(tmp_path / "v.ome.tif", array, metadata={"axes": axes}, **GREY)
    with pytest.raises(VolumeError, match=r"4 axes.*5 × 6"):
        open_volume(tmp_path / "v.ome.tif")


def test_a_single_picture_is_refused(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "v.tif", np.zeros((40, 50), np.uint8))
    with pytest.raises(VolumeError, match="2 axes"):
        open_volume(tmp_path / "v.tif")


@pytest.mark.parametrize("shape", [(40, 50, 3), (7, 40, 50, 3)])
def test_colours_are_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    tifffile.imwrite(tmp_path / "v.tif", np.zeros(shape, np.uint8), photometric="rgb", metadata=None)
    with pytest.raises(VolumeError, match="colour"):
        open_volume(tmp_path / "v.tif")


def test_one_of_several_series_is_chosen(tmp_path: Path, ramp: np.ndarray) -> None:
    with tifffile.TiffWriter(tmp_path / "v.tif") as writer:
        writer.write(ramp, metadata={"spacing_um": [1, 1, 1]}, **GREY)
        writer.write(ramp[:2] + 1, metadata={"spacing_um": [1, 2, 3]}, **GREY)
        writer.write(ramp[0], **GREY)
    with pytest.raises(DatasetChoiceNeeded) as caught:
        open_volume(tmp_path / "v.tif")
    assert [(each.name, each.shape) for each in caught.value.choices] == [
        ("series 0", (5, 6, 7)),
        ("series 1", (2, 6, 7)),
    ]
    with open_volume(tmp_path / "v.tif", dataset="series 1") as volume:
        assert volume.dataset == "series 1"
        assert volume.spacing_um == (1.0, 2.0, 3.0)
        np.testing.assert_array_equal(volume.read(WHOLE), ramp[:2] + 1)
    with pytest.raises(VolumeError, match="series 9"):
        open_volume(tmp_path / "v.tif", dataset="series 9")


@pytest.mark.parametrize(
    ("kind", "storage"),
    [("tiff", MappedStorage), ("tiff compressed", PagedStorage), ("tiff pages", PagedStorage)],
)
def test_one_uncompressed_piece_is_mapped(
    writers, tmp_path: Path, ramp: np.ndarray, kind: str, storage: type
) -> None:
    with open_volume(writers[kind](tmp_path, ramp)) as volume:
        assert isinstance(volume._storage, storage)


def test_only_the_wanted_pages_are_decoded(
    writers, tmp_path: Path, ramp: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded: list[int] = []
    decode = PagedStorage._decode
    monkeypatch.setattr(
        PagedStorage,
        "_decode",
        lambda self, series, number: decoded.append(number) or decode(self, series, number),
    )
    with open_volume(writers["tiff compressed"](tmp_path, ramp)) as volume:
        assert decoded == []
        np.testing.assert_array_equal(volume.read((slice(1, 5, 2), slice(2), slice(3))), ramp[1:5:2, :2, :3])
        assert decoded == [1, 3]


def test_a_compression_without_its_decoder_names_the_package(
    writers, tmp_path: Path, ramp: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    volume = open_volume(writers["tiff compressed"](tmp_path, ramp))

    def fail(*_: object, **__: object) -> None:
        raise ValueError("<COMPRESSION.LZW: 5> requires the 'imagecodecs' package")

    monkeypatch.setattr(tifffile.TiffPage, "asarray", fail)
    monkeypatch.setattr(tifffile.TiffFrame, "asarray", fail)
    with pytest.raises(VolumeError, match="imagecodecs") as caught:
        volume.read(WHOLE)
    assert str(volume.path) in str(caught.value)
    volume.close()


def test_a_stack_of_bits_becomes_zero_and_one(tmp_path: Path) -> None:
    array = np.random.default_rng(0).random((3, 5, 6)) > 0.5
    tifffile.imwrite(tmp_path / "v.tif", array, **GREY)
    with open_volume(tmp_path / "v.tif") as volume:
        assert volume.dtype == np.uint8
        np.testing.assert_array_equal(volume.read(WHOLE), array)


def test_a_big_tiff_is_opened(tmp_path: Path, ramp: np.ndarray) -> None:
    tifffile.imwrite(tmp_path / "v.btf", ramp, bigtiff=True, **GREY)
    with open_volume(tmp_path / "v.btf") as volume:
        np.testing.assert_array_equal(volume.read(WHOLE), ramp)
