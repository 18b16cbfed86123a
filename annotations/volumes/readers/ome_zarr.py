"""Zarr arrays, and OME-Zarr images (0.4, 0.5), of which the finest level is the volume."""

import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from annotations.volumes.dataset_choice import no_such_dataset, only_volume
from annotations.volumes.file_metadata import (
    depth_axis_from_attributes,
    scaled_spacing,
    spacing_from_attributes,
    um_per_unit,
)
from annotations.volumes.readers.axes import kept_axes
from annotations.volumes.spacing import SpacingUm
from annotations.volumes.volume import (
    Array,
    Region,
    Shape,
    Storage,
    StoredArray,
    VolumeError,
    check_array,
    closed,
    unreadable,
)

_NO_SPACE = ("time", "channel")
_LABELS = "labels"


@dataclass(frozen=True)
class _Image:
    """What OME-Zarr says about an array's axes: which are spatial, their scales and their units in µm."""

    spatial: tuple[bool, ...]
    scale: tuple[float, ...]
    um: tuple[float | None, ...]


class ZarrStorage(Storage):
    """An array in a Zarr hierarchy; the library unpacks the blocks concerned in threads of its own."""

    def __init__(self, array: Any, kept: tuple[int, ...]) -> None:
        self._array: Any = array
        self._kept = kept

    def read(self, region: Region) -> Array:
        """Return a copy of the region."""
        array = self._array
        if array is None:
            raise closed()
        index: list[int | slice] = [0] * array.ndim
        for axis, part in zip(self._kept, region, strict=True):
            index[axis] = part
        try:
            return np.asarray(array[tuple(index)])
        except (ValueError, TypeError, KeyError, EOFError, zlib.error) as error:
            raise VolumeError(
                f"a block of it is damaged ({error})", remedy="Copy or export it again"
            ) from error

    def close(self) -> None:
        """Forget the array: its files are never kept open."""
        self._array = None


def open_zarr(path: Path, dataset: str | None) -> StoredArray:
    """Open a three-dimensional array of a Zarr folder, the finest level where it is an OME-Zarr image.

    The order of the axes is kept as it stands (OME-Zarr's own is z, y, x). Axes of length one beyond three
    are left out: see `annotations.volumes.readers.axes`. Label images are opened by name only.

    Raises
    ------
    VolumeError
        The folder is damaged or holds no volume.
    DatasetChoiceNeeded
        It holds several images, and `dataset` is None.
    """
    try:
        root = zarr.open(str(path), mode="r")
        arrays = dict(_arrays(root, "")) if dataset is None else {dataset: _named(path, root, dataset)}
        images = {name: _image(root, name, array) for name, array in arrays.items()}
    except (ValueError, TypeError, KeyError, AttributeError, RuntimeError) as error:
        # Metadata of another structure than the library expects come out as any of these.
        raise unreadable(path, error) from error
    kept_of = {name: _kept(array, images[name]) for name, array in arrays.items()}
    shapes = {name: [arrays[name].shape[axis] for axis in kept] for name, kept in kept_of.items()}
    name = only_volume(path, {each: (shapes[each], array.dtype) for each, array in arrays.items()})
    array, image, kept = arrays[name], images[name], kept_of[name]
    shape = check_array(path, name or None, shapes[name], array.dtype)
    attributes = array.attrs.asdict()
    spacing_um: SpacingUm | None = None
    if image is not None:
        spacing_um = scaled_spacing(
            [image.scale[axis] for axis in kept], [image.um[axis] for axis in kept], path
        )
    chunks: Shape = (array.chunks[kept[0]], array.chunks[kept[1]], array.chunks[kept[2]])
    return StoredArray(
        storage=ZarrStorage(array, kept),
        shape=shape,
        dtype=array.dtype,
        dataset=name or None,
        chunks=chunks,
        spacing_um=spacing_um or spacing_from_attributes(attributes, path),
        depth_axis=depth_axis_from_attributes(attributes),
    )


def _named(path: Path, root: Any, dataset: str) -> Any:
    found = root.get(dataset) if isinstance(root, zarr.Group) else None
    if not isinstance(found, zarr.Array):
        names = [name or "one array without a name" for name, _ in _arrays(root, "")]
        raise no_such_dataset(path, dataset, names)
    return found


def _arrays(item: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Find the arrays that can be meant: of an image only its finest level, and no labels."""
    if isinstance(item, zarr.Array):
        yield name, item
        return
    finest = [image["datasets"][0]["path"] for image in _multiscales(item)]
    if finest:
        members = [(each, item[each]) for each in finest]
    else:
        members = [(each, member) for each, member in item.members() if each != _LABELS]
    for each, member in members:
        yield from _arrays(member, f"{name}/{each}".lstrip("/"))


def _multiscales(group: Any) -> list[Mapping[str, Any]]:
    attributes = group.attrs.asdict()
    # Version 0.5 moved them from the attributes themselves to one called “ome”.
    return list(attributes.get("ome", attributes).get("multiscales", []))


def _image(root: Any, name: str, array: Any) -> _Image | None:
    """Return what the nearest OME-Zarr image above an array says about it, or None."""
    parts = name.split("/") if name else []
    for depth in range(len(parts) - 1, -1, -1):
        group = root["/".join(parts[:depth])] if depth else root
        inside = "/".join(parts[depth:])
        for image in _multiscales(group):
            for level in image["datasets"]:
                if level["path"].strip("/") == inside:
                    return _described(image, level, array.ndim)
    return None


def _described(image: Mapping[str, Any], level: Mapping[str, Any], count: int) -> _Image | None:
    axes = image.get("axes", [])
    if len(axes) != count or not all(isinstance(axis, Mapping) for axis in axes):
        return None
    scale = np.ones(count)
    scaled = False
    for transformation in (
        *level.get("coordinateTransformations", []),
        *image.get("coordinateTransformations", []),
    ):
        if transformation.get("type") == "scale" and len(transformation.get("scale", [])) == count:
            scale *= transformation["scale"]
            scaled = True
    return _Image(
        spatial=tuple(axis.get("type") not in _NO_SPACE for axis in axes),
        scale=tuple(scale.tolist()),
        um=tuple(um_per_unit(axis.get("unit", "")) if scaled else None for axis in axes),
    )


def _kept(array: Any, image: _Image | None) -> tuple[int, ...]:
    return kept_axes(array.shape, image.spatial if image is not None else [True] * array.ndim)
