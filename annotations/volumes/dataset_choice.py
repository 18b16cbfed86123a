"""Which of the arrays in a file is the volume, and what is said where that is not clear."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from annotations.volumes.volume import Shape, VolumeError, is_real

_LISTED_AT_MOST = 12

HeldArrays = Mapping[str, tuple[Sequence[int], np.dtype[Any]]]
"""Shape, and data type as stored, of each array in a file by its name."""


@dataclass(frozen=True)
class DatasetChoice:
    """One of several three-dimensional arrays in a file.

    Attributes
    ----------
    name : str
        What `open_volume` takes as its ``dataset``.
    shape : tuple of int
    dtype : str
        As stored, with the byte order: ``">u2"``.
    """

    name: str
    shape: Shape
    dtype: str

    def __str__(self) -> str:
        return f"{self.name} ({' × '.join(map(str, self.shape))}, {self.dtype})"


class DatasetChoiceNeeded(VolumeError):  # noqa: N818 - a question rather than an error
    """The file holds several three-dimensional arrays, and nobody has said which.

    Attributes
    ----------
    choices : tuple of DatasetChoice
    """

    def __init__(self, path: Path, choices: Sequence[DatasetChoice]) -> None:
        self.choices = tuple(choices)
        super().__init__(
            f"there are {len(self.choices)} volumes in this file: {'; '.join(map(str, self.choices))}",
            where=path,
            remedy="Choose one of them by its name",
        )


def only_volume(path: Path, arrays: HeldArrays) -> str:
    """Return the name of the one array that can be a volume, or of the only array there is.

    An only array that can be no volume is for `annotations.volumes.volume.check_array` to refuse, which says
    what is wrong with it.

    Raises
    ------
    DatasetChoiceNeeded
        Several arrays can be volumes.
    VolumeError
        None of them can, or there are none.
    """
    choices = [
        DatasetChoice(name, (shape[0], shape[1], shape[2]), dtype.str)
        for name, (shape, dtype) in arrays.items()
        if len(shape) == 3 and 0 not in shape and is_real(dtype)
    ]
    if len(choices) > 1:
        raise DatasetChoiceNeeded(path, choices)
    if choices:
        return choices[0].name
    if len(arrays) == 1:
        return next(iter(arrays))
    described = [f"{name} {tuple(shape)} {dtype}" for name, (shape, dtype) in arrays.items()]
    raise VolumeError(
        f"it holds no three-dimensional array of real numbers; it holds: {_listing(described)}",
        where=path,
        remedy="Save one three-dimensional array, axes x, y, z",
    )


def no_such_dataset(path: Path, dataset: str, names: Collection[str]) -> VolumeError:
    """Return what a user is told who asks a file for an array that it does not hold."""
    return VolumeError(f"it has no array “{dataset}”", where=path, remedy=f"It holds: {_listing(names)}")


def _listing(entries: Collection[str]) -> str:
    listed = list(entries)[:_LISTED_AT_MOST]
    if len(entries) > _LISTED_AT_MOST:
        listed.append(f"and {len(entries) - _LISTED_AT_MOST} more")
    return ", ".join(listed) or "no arrays"
