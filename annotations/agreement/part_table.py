"""What the documents of one method and one tool say of their parts, a row a document, in arrays."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from annotations.documents.annotation import (
    Annotation,
    BoxAnnotation,
    Certainty,
    Part,
    Source,
    State,
)
from annotations.documents.files import completed
from annotations.documents.record import Method
from annotations.documents.standing import STANDINGS, is_doubtful, standing
from annotations.geometry.boxes import box_ends_um
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]
N = TypeVar("N", bound=np.generic)

_COUNTED = STANDINGS.index("counted")
_NO_POSITION = STANDINGS.index("no_position")
# Centre, length and rotation of a box; position of a keypoint.
_NUMBERS = {"boxes": 8, "keypoints": 3}


@dataclass(frozen=True)
class KeypointRows:
    """The keypoints of N documents, K of each, in the tool's order; see `Compared` for what is in the arrays.

    Attributes
    ----------
    positions_um : (N, K, 3) array of float64
    standing : (N, K) array of uint8
    doubtful : (N, K) array of bool
    rotations_wxyz : (N, L, 4) array of float64 or None
    """

    positions_um: Array
    standing: NDArray[np.uint8]
    doubtful: NDArray[np.bool_]
    rotations_wxyz: Array | None


class PartTable:
    """Grows by a row a document, so that no document need be kept.

    Parameters
    ----------
    method : str
    tool : ToolSpecification
        Of all its documents.
    """

    def __init__(self, method: Method, tool: ToolSpecification) -> None:
        self._method = method
        self._tool = tool
        self._names = (
            tool.keypoint_names if method == "keypoints" else tuple(link.name for link in tool.links)
        )
        self._numbers = array("d")
        self._standing = array("B")
        self._doubtful = array("B")
        self._no_numbers = (np.nan,) * _NUMBERS[method]
        # Few kinds of parts stand in many documents.
        self._codes: dict[tuple[Source | None, State, Certainty], tuple[int, bool]] = {}
        self._length = 0

    def add(self, document: Annotation) -> int:
        """Append a document, and return its row.

        DocumentError where it has a part that the tool does not.
        """
        parts = document.parts
        if tuple(part.name for part in parts) != self._names:
            parts = completed(document, self._tool).parts
        for part in parts:
            kind = (part.source, part.state, part.certainty)
            if kind not in self._codes:
                self._codes[kind] = STANDINGS.index(standing(part)), is_doubtful(part)
            code, doubtful = self._codes[kind]
            self._standing.append(code)
            self._doubtful.append(doubtful)
            self._numbers.extend(_numbers_of(part) or self._no_numbers)
        self._length += 1
        return self._length - 1

    def standings(self, rows: Sequence[int]) -> NDArray[np.uint8]:
        """Return how the parts of some documents stand, (N, parts), as indices into `STANDINGS`."""
        return self._by_row(np.frombuffer(self._standing, np.uint8))[rows]

    def keypoints(self, rows: Sequence[int]) -> KeypointRows:
        """Return the keypoints of some documents; those of boxes are the centres of their x faces.

        Of two boxes that end at one keypoint, it is that of the first link, as in `box_keypoints_um`; it
        stands as its box does.
        """
        numbers = self._by_row(np.frombuffer(self._numbers, np.float64), _NUMBERS[self._method])[rows]
        part_standing = self.standings(rows)
        part_doubtful = self._by_row(np.frombuffer(self._doubtful, np.uint8).astype(np.bool_))[rows]
        numbers[part_standing != _COUNTED] = np.nan
        if self._method == "keypoints":
            return KeypointRows(numbers, part_standing, part_doubtful, None)
        base_um, tip_um = box_ends_um(numbers[..., :3], numbers[..., 3], numbers[..., 4:])
        names = self._tool.keypoint_names
        positions_um = np.full((len(rows), len(names), 3), np.nan)
        keypoint_standing = np.full((len(rows), len(names)), _NO_POSITION, dtype=np.uint8)
        keypoint_doubtful = np.zeros((len(rows), len(names)), dtype=np.bool_)
        for index, link in reversed(list(enumerate(self._tool.links))):
            is_placed = part_standing[:, index] != _NO_POSITION
            for name, ends_um in ((link.base, base_um), (link.tip, tip_um)):
                keypoint = names.index(name)
                positions_um[is_placed, keypoint] = ends_um[is_placed, index]
                keypoint_standing[is_placed, keypoint] = part_standing[is_placed, index]
                keypoint_doubtful[is_placed, keypoint] = part_doubtful[is_placed, index]
        return KeypointRows(positions_um, keypoint_standing, keypoint_doubtful, numbers[..., 4:])

    def _by_row(self, flat: NDArray[N], *of_each: int) -> NDArray[N]:
        return flat.reshape(self._length, len(self._names), *of_each)


def _numbers_of(part: Part) -> Sequence[float] | None:
    if not isinstance(part, BoxAnnotation):
        return part.position_um
    if part.center_um is None or part.size_um is None or part.rotation_wxyz is None:
        return None
    return (*part.center_um, part.size_um[0], *part.rotation_wxyz)
