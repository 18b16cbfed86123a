"""A volume with what each annotator placed in it, read again from the files for a picture."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from annotations.agreement.results import Agreement, VolumeResult
from annotations.app_folders import tool_folder
from annotations.documents.annotation import Annotation, VolumeReference
from annotations.documents.files import completed, load_annotation, tool_of
from annotations.documents.record import Method
from annotations.documents.representations import keypoint_positions_um
from annotations.documents.volume_link import referenced_path
from annotations.errors import UserError
from annotations.geometry.frames import Vector, extent_um
from annotations.volumes import Level, open_volume, strided_preview

_LOG = logging.getLogger(__name__)

Placed = Mapping[str, Vector]
"""Positions in µm, in the volume's frame, by keypoint."""


@dataclass(frozen=True)
class Scene:
    """A volume and the keypoints of its annotators.

    Attributes
    ----------
    placed : mapping of str to Placed
        By annotator.
    worst : str
        The keypoint at which somebody is furthest from the mean of all.
    size_um : (float, float, float)
        Of the volume.
    level : Level or None
        A coarse copy of the volume; None where it is not at hand.
    """

    placed: Mapping[str, Placed]
    worst: str
    size_um: Vector
    level: Level | None


def read_scene(agreement: Agreement, method: Method, volume: VolumeResult, folder: Path) -> Scene | None:
    """Read what the annotators placed by one method in a volume, and the volume where it is at hand.

    An annotation that is gone, or no longer what was compared, is passed over.

    Parameters
    ----------
    folder : Path
        What paths in ``agreement.inputs`` are relative to.

    Returns
    -------
    Scene or None
        None where no annotation is left.
    """
    placed: dict[str, Placed] = {}
    documents: list[tuple[Annotation, Path]] = []
    for each in agreement.inputs:
        if (each.volume, each.method, each.repeat) != (volume.volume, method, 0):
            continue
        path = folder / each.path
        try:
            document, identity = load_annotation(path)
            tool = tool_of(document, (folder / "tools", tool_folder()))
            positions_um = keypoint_positions_um(completed(document, tool), tool)
        except UserError as error:
            _LOG.info("not drawn: %s", error)
            continue
        if identity == each.sha256 and positions_um:
            placed[each.annotator] = positions_um
            documents.append((document, path))
    if not documents:
        return None
    reference = documents[0][0].volume
    size_um = extent_um(reference.shape, reference.spacing_um)
    previews = (volume_preview(document.volume, path) for document, path in documents)
    level = next((each for each in previews if each is not None), None)
    return Scene(placed, _worst_keypoint(placed), size_um, level)


def _worst_keypoint(placed: Mapping[str, Placed]) -> str:
    positions_um: dict[str, list[Vector]] = {}
    for each in placed.values():
        for name, position_um in each.items():
            positions_um.setdefault(name, []).append(position_um)

    def furthest_um(name: str) -> float:
        apart_um = np.asarray(positions_um[name]) - np.mean(positions_um[name], axis=0)
        return float(np.linalg.norm(apart_um, axis=1).max())

    return max(positions_um, key=furthest_um)


def volume_preview(reference: VolumeReference, path: Path) -> Level | None:
    """Return single voxels of the volume of a document at a path, a few apart; None where it is not at hand.

    Never whole slices: across axis 2 one touches the whole file.
    """
    try:
        with open_volume(referenced_path(reference, path), dataset=reference.dataset) as volume:
            if volume.shape == reference.shape:
                return strided_preview(volume, reference.spacing_um)
    except UserError as error:
        _LOG.info("drawn without its volume: %s", error)
    return None
