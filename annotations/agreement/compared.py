"""What is compared: the annotations of one method as arrays, volumes by annotators."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.results import Input, LeftOut
from annotations.documents.record import Method
from annotations.geometry.tool import ToolSpecification


@dataclass(frozen=True)
class Compared:
    """One pass over the volumes by one method; V volumes, A annotators, K keypoints, L links.

    Attributes
    ----------
    method : str
    volumes, annotators : tuple of str
        What the first two axes stand for.
    positions_um : (V, A, K, 3) array of float64
        In the tool's order of keypoints, in each volume's frame; NaN where a keypoint does not count.
    standing : (V, A, K) array of uint8
        Index into `STANDINGS` of `annotations.documents.standing` for each keypoint; ``no_position`` also
        where there is no document.
    doubtful : (V, A, K) array of bool
        Counted, and said by a person to be occluded, out of view or unsure.
    rotations_wxyz : (V, A, L, 4) array of float64 or None
        Unit quaternions of the boxes, NaN where a box does not count; None for keypoints.
    has_document, is_done, is_blind, is_flagged : (V, A) array of bool
        Whether there is an annotation, and what it says of itself (`Annotation.is_blind`).
    is_from_prediction : (V, A) array of bool
        Whether it was begun from a network's prediction: whoever corrects one stays near it, and people who
        correct the same one are near each other, however good it is.
    active_seconds : (V, A) array of float64
        NaN where there is no document.
    """

    method: Method
    volumes: tuple[str, ...]
    annotators: tuple[str, ...]
    positions_um: NDArray[np.float64]
    standing: NDArray[np.uint8]
    doubtful: NDArray[np.bool_]
    rotations_wxyz: NDArray[np.float64] | None
    has_document: NDArray[np.bool_]
    is_done: NDArray[np.bool_]
    is_blind: NDArray[np.bool_]
    is_flagged: NDArray[np.bool_]
    is_from_prediction: NDArray[np.bool_]
    active_seconds: NDArray[np.float64]

    @property
    def is_independent(self) -> NDArray[np.bool_]:
        """Where an annotation is an opinion of its own, (V, A), shaped neither by others nor by a network."""
        independent: NDArray[np.bool_] = self.has_document & self.is_blind & ~self.is_from_prediction
        return independent

    def without_doubtful(self) -> "Compared":
        """Return the same without the points that a person placed as occluded, out of view or unsure."""
        return replace(self, positions_um=np.where(self.doubtful[..., np.newaxis], np.nan, self.positions_um))

    def only(self, documents: NDArray[np.bool_]) -> "Compared":
        """Return the same without some documents; what else ``standing`` says of these stays.

        Parameters
        ----------
        documents : (V, A) array of bool
            Those that stay.
        """
        kept = documents[..., np.newaxis, np.newaxis]
        rotations_wxyz = self.rotations_wxyz
        return replace(
            self,
            positions_um=np.where(kept, self.positions_um, np.nan),
            rotations_wxyz=None if rotations_wxyz is None else np.where(kept, rotations_wxyz, np.nan),
            has_document=self.has_document & documents,
            active_seconds=np.where(documents, self.active_seconds, np.nan),
        )


@dataclass(frozen=True)
class Material:
    """Everything that is compared.

    Attributes
    ----------
    title : str
        The study's, or the folder's name.
    folder : Path
        What paths in ``inputs`` and ``left_out`` are relative to.
    tool : ToolSpecification or None
        Of all the documents; None where none can be compared, and there is no study to say it.
    passes : mapping of str to tuple of Compared
        For each method the first pass over the volumes, then the repeats in their order; all with the same
        annotators, each with the volumes of which it has a document. Where nothing can be compared, the first
        passes of the methods that there are, with no volumes.
    inputs : tuple of Input
        The documents that were read.
    left_out : tuple of LeftOut
        The files, or all files of a person, that could not be compared, and why.
    """

    title: str
    folder: Path
    tool: ToolSpecification | None
    passes: Mapping[Method, tuple[Compared, ...]]
    inputs: tuple[Input, ...]
    left_out: tuple[LeftOut, ...]
