"""A look at a few blocks of a file, by which is noticed what its times do not tell."""

import os
import zlib
from dataclasses import dataclass
from pathlib import Path

_BLOCKS = 32
_BLOCK_BYTES = 4096


@dataclass(frozen=True)
class Probe:
    """What a few blocks of a file hold.

    Attributes
    ----------
    checksum : int
        Over blocks spread evenly from the first value to the last.
    is_blank_at_an_end : bool
        Whether the first block or the last holds zeros only, as in space that is reserved and not filled yet.
    has_holes : bool or None
        Whether fewer bytes are stored than the file is long; None where the system does not say.
    """

    checksum: int
    is_blank_at_an_end: bool
    has_holes: bool | None


def probe_of(path: Path, begin: int, end: int) -> Probe:
    """Read blocks between two offsets of a file, in bytes.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    last = max(begin, end - _BLOCK_BYTES)
    offsets = sorted({begin + (last - begin) * number // (_BLOCKS - 1) for number in range(_BLOCKS)})
    checksum, blanks = 0, []
    with path.open("rb", buffering=0) as stream:
        for offset in offsets:
            stream.seek(offset)
            block = stream.read(min(_BLOCK_BYTES, end - offset))
            checksum = zlib.crc32(block, checksum)
            blanks.append(block.count(0) == len(block))
        found = os.fstat(stream.fileno())
    stored = getattr(found, "st_blocks", None)
    has_holes = None if stored is None else 512 * stored < found.st_size
    return Probe(checksum, blanks[0] or blanks[-1], has_holes)
