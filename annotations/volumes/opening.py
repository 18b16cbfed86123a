"""From a path to a volume: which format it is, what its file says, and what a person said."""

import re
from pathlib import Path

import numpy as np

from annotations.volumes.readers import npy, npz
from annotations.volumes.spacing import Sidecar, SpacingUm, read_folder_answer, read_sidecar
from annotations.volumes.volume import SpacingSource, StoredArray, Volume, VolumeError, unreadable

SUFFIXES = (".npy", ".npz", ".h5", ".hdf5", ".hdf", ".tif", ".tiff", ".btf")
"""Of the files that a volume can be in; a Zarr volume is a folder."""

_TIFF_MAGICS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
_HDF5_PLACES = (0, 512, 1024, 2048)
_HDF5_SUFFIXES = (".h5", ".hdf5", ".hdf")
_ZARR_METADATA = ("zarr.json", ".zarray", ".zgroup")


def open_volume(path: Path, *, dataset: str | None = None) -> Volume:
    """Open a volume without reading its voxels.

    The format is told by the content, not by the name: ``.npy``, ``.npz``, HDF5, TIFF stacks, and folders
    in Zarr or OME-Zarr. Spacing and depth axis come from the sidecar, else from the file itself, else from
    what a person said of all volumes of this shape in the folder.

    Parameters
    ----------
    path : pathlib.Path
    dataset : str, optional
        The member, dataset, series or array inside the file, needed where several can be meant.

    Returns
    -------
    Volume

    Raises
    ------
    VolumeError
        There is no such file, it may not be read, it is empty, cut short or damaged, or it holds no
        three-dimensional array of real numbers.
    DatasetChoiceNeeded
        It holds several, and `dataset` is None.
    """
    path = Path(path).absolute()
    try:
        kind, stored = _open(path, dataset)
    except OSError as error:
        raise unreadable(path, error) from error
    try:
        sidecar = read_sidecar(path) or Sidecar()
        folder = read_folder_answer(path.parent, stored.shape) or Sidecar()
    except BaseException:
        stored.storage.close()
        raise
    # What was said of this very volume, then what its file says, then what was said of all its folder.
    spacings: tuple[tuple[SpacingUm | None, SpacingSource], ...] = (
        (sidecar.spacing_um, "sidecar"),
        (stored.spacing_um, "file"),
        (folder.spacing_um, "folder"),
    )
    spacing_um, source = next(((um, said) for um, said in spacings if um is not None), (None, None))
    depth_axes = (sidecar.depth_axis, stored.depth_axis, folder.depth_axis, 2)
    return Volume(
        path=path,
        dataset=stored.dataset,
        format=kind,
        shape=stored.shape,
        dtype=np.dtype(np.uint8) if stored.dtype.kind == "b" else stored.dtype.newbyteorder("="),
        file_dtype=stored.dtype.str,
        spacing_um=spacing_um,
        spacing_source=source,
        depth_axis=next(axis for axis in depth_axes if axis is not None),
        chunks=stored.chunks,
        fortran_order=stored.fortran_order,
        _storage=stored.storage,
    )


def volume_paths(folder: Path) -> list[Path]:
    """Return what `open_volume` could open in a folder, judged by names, in natural order.

    Volume 10 comes after volume 9. Hidden files and the folders' own content are left out, and so are
    training files, for which HDF5 files, and no others, are looked into.

    Raises
    ------
    VolumeError
        The folder does not exist or may not be read.
    """
    try:
        entries = [entry for entry in Path(folder).iterdir() if not entry.name.startswith(".")]
        found = [entry for entry in entries if _could_be_volume(entry)]
    except OSError as error:
        raise unreadable(Path(folder), error) from error
    return sorted(found, key=_natural_order)


def _open(path: Path, dataset: str | None) -> tuple[str, StoredArray]:
    # The libraries of the larger formats are imported when a file needs them: together they take a second.
    if path.is_dir():
        if not is_zarr(path):
            raise VolumeError("it is a folder", where=path, remedy="Open a volume inside it")
        from annotations.volumes.readers.ome_zarr import open_zarr

        return "zarr", open_zarr(path, dataset)
    heads = _heads(path)
    head = heads[0]
    if not head:
        raise VolumeError("the file is empty (0 bytes)", where=path, remedy="Copy or export it again")
    if head.startswith(npy.MAGIC):
        _refuse_dataset(path, dataset)
        return "npy", npy.open_npy(path)
    if head.startswith(npz.MAGIC):
        return "npz", npz.open_npz(path, dataset)
    if head.startswith(_TIFF_MAGICS):
        from annotations.volumes.readers.tiff import open_tiff

        return "tiff", open_tiff(path, dataset)
    if _HDF5_MAGIC in heads:
        from annotations.volumes.readers.hdf5 import is_training_file, open_hdf5

        if is_training_file(path):
            raise VolumeError(
                "it is a training file: it holds what was annotated in volumes, and no volume",
                where=path,
                remedy="Open a volume, or the study that it was exported from",
            )
        return "hdf5", open_hdf5(path, dataset)
    raise VolumeError(
        "its content is of no format that can be opened",
        where=path,
        remedy="The formats are .npy, .npz, HDF5, TIFF and Zarr; if it is one of them, it is damaged",
    )


def _heads(path: Path) -> list[bytes]:
    """Return the eight bytes at each place where the signature of a format can stand."""
    heads = []
    with path.open("rb") as stream:
        for place in _HDF5_PLACES:
            stream.seek(place)
            heads.append(stream.read(len(_HDF5_MAGIC)))
    return heads


def _refuse_dataset(path: Path, dataset: str | None) -> None:
    if dataset is not None:
        raise VolumeError(
            f"it has no “{dataset}”", where=path, remedy="A .npy file holds one array: leave the name out"
        )


def _could_be_volume(entry: Path) -> bool:
    try:
        if entry.is_dir():
            return is_zarr(entry)
    except PermissionError:
        # One folder that is someone else's does not hide the volumes beside it.
        return False
    suffix = entry.suffix.lower()
    if suffix in _HDF5_SUFFIXES:
        from annotations.volumes.readers.hdf5 import is_training_file

        return not is_training_file(entry)
    return suffix in SUFFIXES


def is_zarr(folder: Path) -> bool:
    """Say whether a folder is a volume in Zarr or OME-Zarr, by the files that name their contents."""
    return any((folder / name).is_file() for name in _ZARR_METADATA)


def _natural_order(path: Path) -> list[tuple[int, int, str]]:
    parts = re.split(r"(\d+)", path.name.casefold())
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part) for part in parts if part]
