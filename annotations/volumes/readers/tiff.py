"""TIFF stacks: mapped where they lie in one uncompressed piece, else decoded page by page."""

import threading
import xml.etree.ElementTree as ET
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import tifffile

from annotations.volumes.dataset_choice import no_such_dataset, only_volume
from annotations.volumes.file_metadata import (
    depth_axis_from_attributes,
    scaled_spacing,
    spacing_from_attributes,
    um_per_unit,
)
from annotations.volumes.mapping import MappedStorage
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

_NAME = "series {}"


class PagedStorage(Storage):
    """A stack of compressed or scattered pages along axis 0; only the wanted ones are decoded."""

    def __init__(self, file: tifffile.TiffFile, series: tifffile.TiffPageSeries, shape: Shape) -> None:
        self._file = file
        self._series: tifffile.TiffPageSeries | None = series
        # One plane a page, but for a volume that its writer took for the samples of one picture.
        self._page_shape = (shape[0] // len(series.pages), shape[1], shape[2])
        self._decoded: tuple[int, Array] | None = None
        self._lock = threading.Lock()

    def read(self, region: Region) -> Array:
        """Return a copy of the region."""
        with self._lock:
            series = self._series
            if series is None:
                raise closed()
            planes = range(region[0].start, region[0].stop, region[0].step)
            sizes = [len(range(part.start, part.stop, part.step)) for part in region]
            result = np.empty(sizes, series.dtype)
            for row, plane in enumerate(planes):
                number, inside = divmod(plane, self._page_shape[0])
                if self._decoded is None or self._decoded[0] != number:
                    self._decoded = (number, self._decode(series, number))
                result[row] = self._decoded[1][inside, region[1], region[2]]
            return result

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            if self._series is not None:
                self._series = None
                self._decoded = None
                self._file.close()

    def _decode(self, series: tifffile.TiffPageSeries, number: int) -> Array:
        page = series.pages[number]
        if page is None:
            # An OME-TIFF may leave out planes that nobody recorded.
            return np.zeros(self._page_shape, series.dtype)
        try:
            return np.asarray(page.asarray()).reshape(self._page_shape)
        except (ValueError, IndexError, zlib.error, tifffile.TiffFileError) as error:
            # Also what a compression without its decoder says: the text names the package.
            raise VolumeError(
                f"page {number} cannot be decoded ({error})",
                remedy="Install the Python package imagecodecs, or save the stack without compression",
            ) from error


def open_tiff(path: Path, dataset: str | None) -> StoredArray:
    """Open a TIFF stack. Its pages are planes along axis 0, and axes of one plane keep their order (y, x).

    Axes of length one beyond three (a single time, a single channel) are left out: see
    `annotations.volumes.readers.axes`.

    Raises
    ------
    VolumeError
        The file is damaged, cut short, or holds no volume.
    DatasetChoiceNeeded
        It holds several series of three dimensions, and `dataset` is None.
    """
    try:
        file = tifffile.TiffFile(path)
    except tifffile.TiffFileError as error:
        raise unreadable(path, error) from error
    try:
        return _open(path, file, dataset)
    except BaseException:
        file.close()
        raise


def _open(path: Path, file: tifffile.TiffFile, dataset: str | None) -> StoredArray:
    index = _choose(path, file, dataset)
    series = file.series[index]
    if _is_colour(series):
        raise VolumeError(
            f"it holds colour pictures (shape {series.shape}, axes {series.axes})",
            where=path,
            remedy="Save the intensities as a stack of grey pictures",
        )
    found, axes = _squeezed(series)
    shape = check_array(path, None, found, series.dtype)
    declared = file.shaped_metadata or ()
    attributes = declared[index] if index < len(declared) else {}
    spacing_um = _spacing(file, series, index, axes, path) or spacing_from_attributes(attributes, path)
    stored_dtype = np.dtype(file.byteorder + series.dtype.char)
    storage: Storage
    chunks: Shape | None = None
    if series.dataoffset is not None:
        with path.open("rb") as stream:
            storage = MappedStorage.of_stream(
                stream, where=path, dtype=stored_dtype, shape=shape, offset=series.dataoffset
            )
        file.close()
    elif shape[0] % len(series.pages) == 0:
        storage = PagedStorage(file, series, shape)
        chunks = (shape[0] // len(series.pages), shape[1], shape[2])
    else:
        raise VolumeError(
            f"its {len(series.pages)} pages do not share {shape[0]} planes evenly",
            where=path,
            remedy="Save the stack again with one page a plane",
        )
    return StoredArray(
        storage=storage,
        shape=shape,
        dtype=stored_dtype,
        dataset=None if len(file.series) == 1 else _NAME.format(index),
        chunks=chunks,
        spacing_um=spacing_um,
        depth_axis=depth_axis_from_attributes(attributes),
    )


def _choose(path: Path, file: tifffile.TiffFile, dataset: str | None) -> int:
    names = [_NAME.format(index) for index in range(len(file.series))]
    if dataset is not None:
        if dataset not in names:
            raise no_such_dataset(path, dataset, names)
        return names.index(dataset)
    if not file.series:
        raise VolumeError("it holds no pictures", where=path, remedy="Export it again")
    grey = {
        name: (_squeezed(series)[0], series.dtype.newbyteorder(file.byteorder))
        for name, series in zip(names, file.series, strict=True)
        if not _is_colour(series)
    }
    # Where all are coloured, the first is refused for that.
    return names.index(only_volume(path, grey)) if grey else 0


def _is_colour(series: tifffile.TiffPageSeries) -> bool:
    """Say whether samples are colours: not where the file itself declares a plain array of that shape."""
    return series.kind != "shaped" and dict(zip(series.axes, series.shape, strict=True)).get("S", 1) > 1


def _squeezed(series: tifffile.TiffPageSeries) -> tuple[tuple[int, ...], str]:
    """Return shape and axes without those that `kept_axes` leaves out."""
    shape = series.get_shape(squeeze=False)
    axes = series.get_axes(squeeze=False)
    # A plain array that the file declares has no named axes: tifffile guessed the letters.
    kept = kept_axes(shape, [axis in "ZYX" or series.kind == "shaped" for axis in axes])
    return tuple(shape[place] for place in kept), "".join(axes[place] for place in kept)


def _spacing(
    file: tifffile.TiffFile, series: tifffile.TiffPageSeries, index: int, axes: str, path: Path
) -> SpacingUm | None:
    if sorted(axes) != ["X", "Y", "Z"]:
        return None
    if file.is_ome and file.ome_metadata:
        sizes = _ome_sizes(file.ome_metadata, index)
    elif file.is_imagej and file.imagej_metadata:
        sizes = _imagej_sizes(series.keyframe, file.imagej_metadata)
    else:
        return None
    values, factors = zip(*(sizes.get(axis, (0.0, None)) for axis in axes), strict=True)
    return scaled_spacing(values, factors, path)


def _ome_sizes(xml: str, index: int) -> dict[str, tuple[float, float | None]]:
    """Return length and µm per unit by axis, from an OME-XML Pixels element; its units default to µm."""
    try:
        pixels = [each for each in ET.fromstring(xml).iter() if each.tag.endswith("}Pixels")]
        if index >= len(pixels):
            return {}
        said = pixels[index].attrib
        return {
            axis: (float(said[f"PhysicalSize{axis}"]), um_per_unit(said.get(f"PhysicalSize{axis}Unit", "µm")))
            for axis in "XYZ"
            if f"PhysicalSize{axis}" in said
        }
    except (ET.ParseError, ValueError):
        return {}


def _imagej_sizes(page: Any, metadata: dict[str, Any]) -> dict[str, tuple[float, float | None]]:
    """Return length and µm per unit by axis; ImageJ keeps x and y as pixels per unit in TIFF's tags."""
    um = um_per_unit(metadata.get("unit", ""))
    sizes: dict[str, tuple[float, float | None]] = {}
    if isinstance(metadata.get("spacing"), (int, float)):
        sizes["Z"] = (abs(float(metadata["spacing"])), um)
    for axis in "XY":
        tag = page.tags.get(f"{axis}Resolution")
        if tag is not None and tag.value[0]:
            sizes[axis] = (tag.value[1] / tag.value[0], um)
    return sizes
