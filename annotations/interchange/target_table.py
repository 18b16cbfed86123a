"""What a training file says, before it takes a format: a row per annotation, and what holds for all rows."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from annotations.documents.annotation import KeypointAnnotation
from annotations.documents.record import Method
from annotations.documents.representations import document_targets, keypoints_of
from annotations.errors import UserError
from annotations.geometry.frames import um_to_voxel
from annotations.geometry.targets import PoseTargets
from annotations.geometry.tool import ToolSpecification
from annotations.interchange.speaking_documents import SpeakingDocument
from annotations.interchange.split import SplitRule, split_of
from annotations.volumes.readers.hdf5 import TRAINING_SCHEMA

SCHEMA = f"{TRAINING_SCHEMA}1"


@dataclass(frozen=True)
class TargetRow:
    """One annotation of a volume, as a network is to learn it.

    Attributes
    ----------
    document : SpeakingDocument
        Where it comes from.
    document_path : str
        Relative to the study's folder, with forward slashes.
    keypoints : tuple of KeypointAnnotation
        Every keypoint of the tool, in its order; those of boxes follow from the boxes.
    targets : PoseTargets
        Signed angles where boxes give the hinges.
    split : str
        ``train``, ``validation`` or ``test``.
    """

    document: SpeakingDocument
    document_path: str
    keypoints: tuple[KeypointAnnotation, ...]
    targets: PoseTargets
    split: str

    @property
    def position_um(self) -> NDArray[np.float64]:
        """Positions of the keypoints in µm, shape (K, 3); NaN where there is none."""
        return np.array([keypoint.position_um or (np.nan,) * 3 for keypoint in self.keypoints])

    @property
    def index_voxel(self) -> NDArray[np.float64]:
        """Positions of the keypoints in voxels, with fractions, shape (K, 3); NaN where there is none."""
        return um_to_voxel(self.position_um, self.document.annotation.volume.spacing_um)


@dataclass(frozen=True)
class TargetTable:
    """All rows of a training file.

    Attributes
    ----------
    tool : ToolSpecification
        The study's.
    method : str
        By which the volumes were annotated.
    rule : SplitRule
    created : datetime
        UTC.
    rows : tuple of TargetRow
    """

    tool: ToolSpecification
    method: Method
    rule: SplitRule
    created: datetime
    rows: tuple[TargetRow, ...]

    @property
    def angle_names(self) -> tuple[str, ...]:
        """The tool's angles, in its order."""
        return tuple(angle.name for angle in self.tool.targets.angles)

    @property
    def signed_angle_names(self) -> tuple[str, ...]:
        """The angles that have a sign: of boxes, those with a hinge; keypoints alone give none."""
        hinged = {joint.name for joint in self.tool.joints} if self.method == "boxes" else set()
        return tuple(name for name in self.angle_names if name in hinged)


def target_table(
    folder: Path,
    documents: Sequence[SpeakingDocument],
    tool: ToolSpecification,
    method: Method,
    rule: SplitRule,
    created: datetime,
) -> TargetTable:
    """Make the table of the annotations that speak for a study's volumes.

    Raises
    ------
    UserError
        The tool's names would give two columns the same name.
    """
    splits = split_of([(one.volume.id, one.annotation.volume.fingerprint) for one in documents], rule)
    rows = tuple(
        TargetRow(
            document=document,
            document_path=document.path.relative_to(folder).as_posix(),
            keypoints=keypoints_of(document.annotation, document.tool),
            targets=document_targets(document.annotation, document.tool),
            split=split,
        )
        for document, split in zip(documents, splits, strict=True)
    )
    _refuse_double_names(tool)
    return TargetTable(tool, method, rule, created, rows)


def _refuse_double_names(tool: ToolSpecification) -> None:
    names = list(_target_names(tool))
    for name in names:
        if names.count(name) > 1:
            raise UserError(
                f"the tool {tool.name!r} gives two columns of the training file the name {name!r}",
                remedy="Give one of its keypoints or angles another name",
            )


def _target_names(tool: ToolSpecification) -> Iterator[str]:
    yield from ("position", "orientation", *tool.keypoint_names)
    for angle in tool.targets.angles:
        yield from (f"{angle.name}_deg", f"{angle.name}_signed_deg")
