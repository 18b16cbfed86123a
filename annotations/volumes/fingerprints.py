"""What a volume is recognised by, wherever its file lies."""

import hashlib
import math

import numpy as np

from annotations.volumes.volume import Array, Region, Shape, Volume

_BLOCKS = 64
_BLOCK_BYTES = 64 << 10


def fingerprint(volume: Volume) -> str:
    """Return the SHA-256 over a volume's shape, dtype, size in bytes and 64 evenly spaced 64-KiB blocks.

    The blocks are runs of the voxel values, written little-endian, in the order in which the file keeps them:
    C order, or Fortran order for a file in that order (reading across it would touch the whole file). The
    first block starts at the first voxel and the last one ends at the last; of a volume no larger than the
    blocks together every voxel counts. So copying, moving or renaming a file, its metadata, and a lossless
    change of compression or byte order leave the fingerprint as it is.

    Parameters
    ----------
    volume : Volume

    Returns
    -------
    str
        64 hexadecimal digits.

    Raises
    ------
    VolumeError
        The file can no longer be read.
    """
    dtype = volume.dtype
    # The padding bytes of extended precision hold whatever was there: such values count as float64.
    hashed = np.dtype(np.float64) if dtype.itemsize > 8 else dtype
    total = math.prod(volume.shape)
    run = _BLOCK_BYTES // hashed.itemsize
    digest = hashlib.sha256(f"{volume.shape} {hashed.name} {total * hashed.itemsize}".encode())
    if total <= _BLOCKS * run:
        starts = list(range(0, total, run))
    else:
        starts = [block * (total - run) // (_BLOCKS - 1) for block in range(_BLOCKS)]
    for start in starts:
        values = _run(volume, start, min(start + run, total))
        digest.update(np.ascontiguousarray(values, hashed.newbyteorder("<")).tobytes())
    return digest.hexdigest()


def _run(volume: Volume, start: int, stop: int) -> Array:
    """Return the voxels from one place to another in the file's own order, shape (stop - start,)."""
    if volume.fortran_order:
        shape: Shape = (volume.shape[2], volume.shape[1], volume.shape[0])
    else:
        shape = volume.shape
    plane = shape[1] * shape[2]
    first, last = start // plane, (stop - 1) // plane
    parts = []
    skipped = 0
    if last - first > 1:
        # Planes smaller than the run: whole ones are read at once, and no more than two too many.
        parts.append(_read(volume, (slice(first, last + 1), slice(None), slice(None))))
        skipped = start - first * plane
    else:
        for index in range(first, last + 1):
            low = max(start - index * plane, 0) // shape[2]
            high = (min(stop - index * plane, plane) - 1) // shape[2] + 1
            if index == first:
                skipped = start - index * plane - low * shape[2]
            parts.append(_read(volume, (slice(index, index + 1), slice(low, high), slice(None))))
    return np.concatenate(parts)[skipped : skipped + stop - start]


def _read(volume: Volume, region: Region) -> Array:
    if volume.fortran_order:
        return volume.read((region[2], region[1], region[0])).transpose().ravel()
    return volume.read(region).ravel()
