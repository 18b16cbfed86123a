import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from annotations.volumes import DatasetChoiceNeeded, VolumeError, open_volume

WHOLE = (slice(None), slice(None), slice(None))
UNITS = {"z": "micrometer", "y": "millimeter", "x": "nanometer"}
SCALE = [15.9, 0.0135, 9400.0]


def axis(name: str) -> dict[str, str]:
    if name in UNITS:
        return {"name": name, "type": "space", "unit": UNITS[name]}
    return {"name": name, "type": "time" if name == "t" else "channel"}


def write_image(
    path: Path,
    levels: list[np.ndarray],
    *,
    version: str = "0.4",
    axes: str = "zyx",
    scale: list[float] | None = None,
    overall: list[float] | None = None,
) -> Path:
    """Write an OME-Zarr image, its levels named 0, 1, …, each twice as coarse as the one before."""
    group = zarr.open_group(str(path), mode="w", zarr_format=2 if version == "0.4" else 3)
    datasets = []
    for number, level in enumerate(levels):
        stored = group.create_array(str(number), shape=level.shape, dtype=level.dtype, chunks=level.shape)
        stored[...] = level
        sizes = [each * 2**number for each in scale or SCALE]
        datasets.append(
            {"path": str(number), "coordinateTransformations": [{"type": "scale", "scale": sizes}]}
        )
    image: dict[str, Any] = {"axes": [axis(name) for name in axes], "datasets": datasets}
    if overall is not None:
        image["coordinateTransformations"] = [{"type": "scale", "scale": overall}]
    if version == "0.4":
        group.attrs["multiscales"] = [image | {"version": version}]
    else:
        group.attrs["ome"] = {"version": version, "multiscales": [image]}
    return path


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_the_finest_level_of_an_image_is_opened_with_its_spacing(
    tmp_path: Path, ramp: np.ndarray, version: str
) -> None:
    path = write_image(tmp_path / "v.zarr", [ramp, ramp[::2, ::2, ::2]], version=version)
    volume = open_volume(path)
    assert (volume.format, volume.dataset) == ("zarr", "0")
    assert volume.spacing_um == pytest.approx((15.9, 13.5, 9.4))
    assert volume.spacing_source == "file"
    np.testing.assert_array_equal(volume.read(WHOLE), ramp)
    coarse = open_volume(path, dataset="1")
    assert coarse.spacing_um == pytest.approx((31.8, 27.0, 18.8))
    np.testing.assert_array_equal(coarse.read(WHOLE), ramp[::2, ::2, ::2])


def test_a_scale_of_the_whole_image_multiplies(tmp_path: Path, ramp: np.ndarray) -> None:
    path = write_image(tmp_path / "v.zarr", [ramp], scale=[1.0, 1.0, 1.0], overall=[2.0, 0.003, 4000.0])
    assert open_volume(path).spacing_um == pytest.approx((2.0, 3.0, 4.0))


def test_single_times_and_channels_are_left_out(tmp_path: Path, ramp: np.ndarray) -> None:
    path = write_image(
        tmp_path / "v.zarr", [ramp[None, None]], axes="tczyx", scale=[1.0, 1.0, *SCALE], version="0.5"
    )
    volume = open_volume(path)
    assert volume.shape == ramp.shape
    assert volume.chunks == ramp.shape
    assert volume.spacing_um == pytest.approx((15.9, 13.5, 9.4))
    np.testing.assert_array_equal(volume.read((slice(1, 3), slice(None), slice(0, 7, 3))), ramp[1:3, :, ::3])


def test_several_channels_are_refused_with_the_shape(tmp_path: Path, ramp: np.ndarray) -> None:
    path = write_image(tmp_path / "v.zarr", [np.stack([ramp, ramp])], axes="czyx", scale=[1.0, *SCALE])
    with pytest.raises(VolumeError, match="2 × 5 × 6 × 7"):
        open_volume(path)


def test_an_image_without_units_or_scale_has_no_spacing(tmp_path: Path, ramp: np.ndarray) -> None:
    path = write_image(tmp_path / "v.zarr", [ramp])
    attributes = json.loads((path / ".zattrs").read_text())
    image = attributes["multiscales"][0]
    units = [each.pop("unit") for each in image["axes"]]
    (path / ".zattrs").write_text(json.dumps(attributes))
    assert open_volume(path).spacing_um is None
    for each, unit in zip(image["axes"], units, strict=True):
        each["unit"] = unit
    del image["datasets"][0]["coordinateTransformations"]
    (path / ".zattrs").write_text(json.dumps(attributes))
    assert open_volume(path).spacing_um is None


def test_one_of_several_images_is_chosen(tmp_path: Path, ramp: np.ndarray) -> None:
    path = tmp_path / "v.zarr"
    zarr.open_group(str(path), mode="w", zarr_format=2)
    write_image(path / "0", [ramp, ramp[::2]])
    write_image(path / "1", [ramp[:2]])
    write_image(path / "labels" / "tool", [ramp])
    with pytest.raises(DatasetChoiceNeeded) as caught:
        open_volume(path)
    assert sorted((each.name, each.shape) for each in caught.value.choices) == [
        ("0/0", (5, 6, 7)),
        ("1/0", (2, 6, 7)),
    ]
    volume = open_volume(path, dataset="1/0")
    assert (volume.shape, volume.spacing_um) == ((2, 6, 7), pytest.approx((15.9, 13.5, 9.4)))
    assert open_volume(path, dataset="labels/tool/0").shape == ramp.shape


@pytest.mark.parametrize("version", [2, 3])
def test_attributes_of_a_plain_array_count(tmp_path: Path, ramp: np.ndarray, version: int) -> None:
    array = zarr.create_array(
        str(tmp_path / "v.zarr"), shape=ramp.shape, dtype=ramp.dtype, zarr_format=version
    )
    array.attrs["spacing_um"] = [1.0, 2.0, 3.0]
    array.attrs["depth_axis"] = 0
    volume = open_volume(tmp_path / "v.zarr")
    assert (volume.spacing_um, volume.depth_axis, volume.dataset) == ((1.0, 2.0, 3.0), 0, None)


def test_arrays_of_a_plain_group_are_found(tmp_path: Path, ramp: np.ndarray) -> None:
    group = zarr.open_group(str(tmp_path / "v.zarr"), mode="w")
    group.create_array("scans/volume", shape=ramp.shape, dtype=ramp.dtype)[...] = ramp
    group.create_array("times", shape=(5,), dtype="f8")
    volume = open_volume(tmp_path / "v.zarr")
    assert volume.dataset == "scans/volume"
    np.testing.assert_array_equal(volume.read(WHOLE), ramp)
    with pytest.raises(VolumeError, match="absent") as caught:
        open_volume(tmp_path / "v.zarr", dataset="absent")
    assert "scans/volume" in caught.value.remedy


def test_a_group_without_arrays_is_refused(tmp_path: Path) -> None:
    zarr.open_group(str(tmp_path / "v.zarr"), mode="w")
    with pytest.raises(VolumeError, match="no arrays"):
        open_volume(tmp_path / "v.zarr")


def test_an_array_that_has_no_name_is_refused_under_one(tmp_path: Path, ramp: np.ndarray) -> None:
    zarr.create_array(str(tmp_path / "v.zarr"), shape=ramp.shape, dtype=ramp.dtype)
    with pytest.raises(VolumeError, match="other"):
        open_volume(tmp_path / "v.zarr", dataset="other")


@pytest.mark.parametrize("name", ["zarr.json", ".zarray", ".zgroup"])
@pytest.mark.parametrize("text", ["", "{", "[]", '{"zarr_format": 3}', '{"zarr_format": 2, "shape": 5}'])
def test_damaged_metadata_are_refused(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / "v.zarr"
    path.mkdir()
    (path / name).write_text(text)
    with pytest.raises(VolumeError) as caught:
        open_volume(path)
    assert str(path) in str(caught.value)


def test_an_image_whose_level_is_missing_is_refused(tmp_path: Path, ramp: np.ndarray) -> None:
    path = write_image(tmp_path / "v.zarr", [ramp])
    for inner in sorted((path / "0").rglob("*"), reverse=True):
        inner.unlink()
    (path / "0").rmdir()
    with pytest.raises(VolumeError) as caught:
        open_volume(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("kind", ["zarr 2", "zarr 3"])
def test_a_damaged_block_is_reported_when_it_is_read(writers, tmp_path: Path, kind: str) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (3, 3, 3)).astype(np.uint32)
    path = writers[kind](tmp_path, noise)
    block = next(
        each for each in path.rglob("*") if each.is_file() and not each.name.startswith((".", "zarr"))
    )
    block.write_bytes(b"damaged")
    volume = open_volume(path)
    with pytest.raises(VolumeError) as caught:
        volume.read(WHOLE)
    assert str(path) in str(caught.value)
