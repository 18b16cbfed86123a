"""NumPy's archive of arrays: stored members are mapped, compressed ones inflated into a temporary file."""

import shutil
import struct
import tempfile
import threading
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from annotations.app_folders import cache_folder
from annotations.volumes.dataset_choice import no_such_dataset, only_volume
from annotations.volumes.file_metadata import NAMES, depth_axis_from_attributes, spacing_from_attributes
from annotations.volumes.mapping import MappedStorage
from annotations.volumes.readers.npy import NpyHeader, read_npy_header
from annotations.volumes.volume import (
    Array,
    Region,
    Shape,
    Storage,
    StoredArray,
    VolumeError,
    check_array,
    closed,
)

MAGIC = b"PK\x03\x04"

_LOCAL_HEADER = struct.Struct("<4s22xHH")
_SUFFIX = ".npy"
_SMALL = 4096


class InflatedStorage(Storage):
    """A compressed member, inflated on the first read into a nameless file that vanishes with the volume.

    A file rather than memory, so that a volume larger than the memory can be looked at; nameless, so that
    a process that is killed leaves nothing behind.
    """

    def __init__(self, path: Path, member: zipfile.ZipInfo, header: NpyHeader, shape: Shape) -> None:
        self._path = path
        self._member = member
        self._header = header
        self._shape = shape
        self._lock = threading.Lock()
        self._mapped: MappedStorage | None = None
        self._closed = False

    def read(self, region: Region) -> Array:
        """Return a view of the inflated array."""
        return self._inflated().read(region)

    def prefetch(self, region: Region) -> None:
        """Ask for the pages of the region, once there are any."""
        mapped = self._mapped
        if mapped is not None:
            mapped.prefetch(region)

    def _inflated(self) -> MappedStorage:
        with self._lock:
            if self._closed:
                raise closed()
            if self._mapped is None:
                self._mapped = self._inflate()
            return self._mapped

    def close(self) -> None:
        """Let go of the inflated file."""
        with self._lock:
            self._closed = True
            self._mapped = None

    def _inflate(self) -> MappedStorage:
        try:
            with (
                _temporary_file() as target,
                zipfile.ZipFile(self._path) as archive,
                archive.open(self._member) as source,
            ):
                shutil.copyfileobj(source, target, 1 << 20)
                target.flush()
                return MappedStorage.of_stream(
                    target,
                    where=self._path,
                    dtype=self._header.dtype,
                    shape=self._shape,
                    offset=self._header.length,
                    fortran_order=self._header.fortran_order,
                )
        except (zipfile.BadZipFile, zlib.error, EOFError) as error:
            raise VolumeError(
                f"“{self._member.filename}” is damaged ({error})",
                where=self._path,
                remedy="Copy or export the file again",
            ) from error
        except OSError as error:
            raise VolumeError(
                f"the compressed volume could not be unpacked ({error.strerror or error})",
                where=self._path,
                remedy=f"Make {self._member.file_size:,} bytes of room in {cache_folder()}, "
                "or save the volume as .npy",
            ) from error


def open_npz(path: Path, dataset: str | None) -> StoredArray:
    """Open the three-dimensional member of an ``.npz`` archive; members of other shapes are left alone.

    Members named as in `annotations.volumes.file_metadata` (``spacing_um``, ``depth_axis`` …) describe it.

    Raises
    ------
    VolumeError
        The archive is damaged or encrypted, or holds no volume.
    DatasetChoiceNeeded
        It holds several, and `dataset` is None.
    """
    try:
        archive = zipfile.ZipFile(path)
    except zipfile.BadZipFile as error:
        raise VolumeError(
            f"the archive is damaged or cut short ({error})", where=path, remedy="Copy or export it again"
        ) from error
    with archive:
        members = {
            info.filename.removesuffix(_SUFFIX): info for info in archive.infolist() if not info.is_dir()
        }
        headers = {
            name: _member_header(archive, info, path)
            for name, info in members.items()
            if info.filename.endswith(_SUFFIX)
        }
        name = _choose(path, headers, dataset)
        header, member = headers[name], members[name]
        shape = check_array(path, name, header.shape, header.dtype)
        attributes = {
            other: value
            for other in NAMES
            if other in headers
            and (value := _small_value(archive, members[other], headers[other])) is not None
        }
    promised = header.length + int(np.prod(shape, dtype=object)) * header.dtype.itemsize
    if member.file_size < promised:
        raise VolumeError(
            f"“{name}” is cut short: {promised:,} bytes are promised and there are {member.file_size:,}",
            where=path,
            remedy="Copy or export it again",
        )
    storage: Storage
    if member.compress_type == zipfile.ZIP_STORED:
        with path.open("rb") as stream:
            storage = MappedStorage.of_stream(
                stream,
                where=path,
                dtype=header.dtype,
                shape=shape,
                offset=_content_offset(stream, path, member) + header.length,
                fortran_order=header.fortran_order,
            )
    else:
        storage = InflatedStorage(path, member, header, shape)
    return StoredArray(
        storage=storage,
        shape=shape,
        dtype=header.dtype,
        dataset=name,
        fortran_order=header.fortran_order,
        spacing_um=spacing_from_attributes(attributes, path),
        depth_axis=depth_axis_from_attributes(attributes),
    )


def _choose(path: Path, headers: Mapping[str, NpyHeader], dataset: str | None) -> str:
    if dataset is None:
        return only_volume(path, {name: (header.shape, header.dtype) for name, header in headers.items()})
    name = dataset.removesuffix(_SUFFIX)
    if name not in headers:
        raise no_such_dataset(path, dataset, headers)
    return name


def _member_header(archive: zipfile.ZipFile, member: zipfile.ZipInfo, path: Path) -> NpyHeader:
    try:
        with archive.open(member) as stream:
            return read_npy_header(stream, path)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise VolumeError(
            f"“{member.filename}” cannot be unpacked ({error})",
            where=path,
            remedy="Save it again with numpy.savez, without a password",
        ) from error


def _small_value(archive: zipfile.ZipFile, member: zipfile.ZipInfo, header: NpyHeader) -> Any:
    if member.file_size > _SMALL or header.dtype.kind not in "iufSU":
        return None
    with archive.open(member) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)


def _content_offset(stream: IO[bytes], path: Path, member: zipfile.ZipInfo) -> int:
    # The archive's directory does not say how long the header before the content is: that header does.
    stream.seek(member.header_offset)
    head = stream.read(_LOCAL_HEADER.size)
    if len(head) < _LOCAL_HEADER.size or not head.startswith(MAGIC):
        raise VolumeError("the archive is damaged", where=path, remedy="Copy or export it again")
    _, name_length, extra_length = _LOCAL_HEADER.unpack(head)
    return member.header_offset + _LOCAL_HEADER.size + int(name_length) + int(extra_length)


def _temporary_file() -> IO[bytes]:
    try:
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        return tempfile.TemporaryFile(dir=folder)
    except OSError:
        # A home that cannot be written to: the system's own place for temporary files will do.
        return tempfile.TemporaryFile()
