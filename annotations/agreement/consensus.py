"""A proposed consensus: of each part the robust mean of what several annotators placed, and their spread."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from annotations.documents.annotation import Annotation, BoxAnnotation, KeypointAnnotation, Part, State
from annotations.documents.provenance import Contribution
from annotations.documents.record import changed
from annotations.documents.standing import standing
from annotations.documents.visibility import box_extent_um
from annotations.documents.volume_link import relative_path
from annotations.geometry.boxes import Box, box_between
from annotations.geometry.frames import Vector, vector

Array = NDArray[np.float64]

# In median distances, pooled over the parts of a volume: whoever is further away counts for nothing.
_CUTOFF = 5.0
# In voxel diagonals: differences of this size are never set aside, however well everything else agrees.
_LEAST_CUTOFF = 3.0
_ROUNDS = 30
# Length of the mean of unit vectors below which they have no mean direction.
_LEAST_AGREEMENT = 0.1
_SETTLED_UM = 1e-6


@dataclass(frozen=True)
class Opinion:
    """One annotation of the volume, as it was read.

    Attributes
    ----------
    path : Path
    sha256 : str
        Of the file's bytes.
    document : Annotation
    """

    path: Path
    sha256: str
    document: Annotation

    @property
    def has_placed(self) -> bool:
        """Whether any part of it counts."""
        return any(standing(part) == "counted" for part in self.document.parts)

    @property
    def checkpoint(self) -> str | None:
        """Name of the checkpoint whose prediction it was begun from; None for an opinion of its own."""
        origin = self.document.predicted_from
        return None if origin is None else origin.checkpoint


@dataclass(frozen=True)
class PartConsensus:
    """What several annotators say of one keypoint or box.

    Attributes
    ----------
    proposed : KeypointAnnotation or BoxAnnotation
        With the source ``consensus``; unplaced where nobody placed it.
    spread_um : float or None
        Mean distance of those who were used from the proposal (of a box: root mean square over its centre,
        its ends and a point at the side to which its hinge's axis runs); None with fewer than two.
    used, set_aside : tuple of str
        The annotators who placed it: those in the mean, and those who were too far from the others.
    turned : tuple of str
        Those whose box has the hinge's axis in the sense that the majority does not have.
    """

    proposed: Part
    spread_um: float | None
    used: tuple[str, ...]
    set_aside: tuple[str, ...] = ()
    turned: tuple[str, ...] = ()


@dataclass(frozen=True)
class Consensus:
    """A proposal for one volume, of one method.

    Attributes
    ----------
    parts : mapping of str to PartConsensus
        In the order of the documents' parts.
    opinions : tuple of Opinion
        What it was made from.
    """

    parts: Mapping[str, PartConsensus]
    opinions: tuple[Opinion, ...]

    def contributions(self, path: Path) -> tuple[Contribution, ...]:
        """Return what a document that is kept at a path says it was made from: who placed anything."""
        return tuple(
            Contribution(
                path=relative_path(opinion.path, path),
                annotator=opinion.document.annotator,
                repeat=opinion.document.repeat,
                sha256=opinion.sha256,
                predicted_from=opinion.checkpoint,
            )
            for opinion in self.opinions
            if opinion.has_placed
        )


def propose(opinions: Sequence[Opinion]) -> Consensus:
    """Return the proposed consensus of several documents of one volume, method and tool.

    The mean of each part is weighted by Tukey's biweight of the distances (Beaton and Tukey, *Technometrics*
    16, 1974), begun at the median, with one cutoff for all parts of the volume, so that three annotators are
    enough to tell one who stands apart. Of two nobody can be set aside: the proposal lies midway. A box is
    averaged as centre, size and axes; one that is turned by 180° about its own x is turned back first, to the
    sense of the majority. Parts that nobody placed where they are (`standing`) do not count.

    Parameters
    ----------
    opinions : sequence of Opinion
        With every part of the tool (`annotations.documents.files.completed`).
    """
    names = [part.name for part in opinions[0].document.parts] if opinions else []
    placed = {
        name: [opinion for opinion in opinions if standing(opinion.document.part(name)) == "counted"]
        for name in names
    }
    turned = {name: _turned(placed[name], name) for name in names}
    points_um = {
        name: np.array([_opinion_points_um(opinion, name, turned[name]) for opinion in placed[name]])
        for name in names
        if placed[name]
    }
    cutoff_um = _cutoff_um(points_um.values(), opinions)
    return Consensus(
        {
            name: _agreed(name, placed[name], points_um[name], turned[name], cutoff_um)
            if placed[name]
            else PartConsensus(_unplaced(opinions, name), None, ())
            for name in names
        },
        tuple(opinions),
    )


def changed_since(document: Annotation, contributions: Sequence[Contribution]) -> tuple[str, ...]:
    """Return, by name, whose annotation is another than that from which a consensus was made.

    Parameters
    ----------
    contributions : sequence of Contribution
        What it would be made from by now.
    """
    if not document.consensus_of:
        # Placed by a reviewer from the beginning.
        return ()
    before = {each.annotator: each for each in document.consensus_of}
    now = {each.annotator: each for each in contributions}
    return tuple(name for name in sorted({*before, *now}) if before.get(name) != now.get(name))


def distance_um(first: Part, second: Part) -> float | None:
    """Return how far one keypoint or box is from another, in µm, as in a spread; None where one is unplaced.

    A box that is turned by 180° about its own x is turned back first.
    """
    if first.anchor_um is None or second.anchor_um is None:
        return None
    is_turned = (
        isinstance(first, BoxAnnotation)
        and isinstance(second, BoxAnnotation)
        and bool(_box(first, False).axes[:, 1] @ _box(second, False).axes[:, 1] < 0)
    )
    return float(_distances_um(_points_um(first, is_turned)[None], _points_um(second, False))[0])


def _opinion_points_um(opinion: Opinion, name: str, turned: Sequence[str]) -> Array:
    return _points_um(opinion.document.part(name), opinion.document.annotator in turned)


def _points_um(part: Part, is_turned: bool) -> Array:
    """Return the points, (m, 3) in µm, by whose distances two annotators' parts are compared."""
    if isinstance(part, BoxAnnotation):
        box = _box(part, is_turned)
        return np.array([box.center_um, box.base_um, box.tip_um, box.position_um((0.0, 0.5, 0.0))])
    return np.array([part.position_um])


def _box(part: BoxAnnotation, is_turned: bool) -> Box:
    if part.box is None:
        raise ValueError(f"{part.link} has no box")
    return part.box.turned_over if is_turned else part.box


def _turned(opinions: Sequence[Opinion], name: str) -> tuple[str, ...]:
    """Return whose box has its hinge's axis the other way round than most; where half do, than the first."""
    parts = [opinion.document.part(name) for opinion in opinions]
    hinges = [part.box.axes[:, 1] for part in parts if isinstance(part, BoxAnnotation) and part.box]
    if not hinges:
        return ()
    against = [bool(hinge @ hinges[0] < 0) for hinge in hinges]
    if 2 * sum(against) > len(against):
        against = [not each for each in against]
    return tuple(opinion.document.annotator for opinion, each in zip(opinions, against, strict=True) if each)


def _cutoff_um(points_um: Iterable[Array], opinions: Sequence[Opinion]) -> float:
    """Return the distance in µm from which an annotator counts for nothing, in every part of the volume."""
    distances = [_distances_um(points, np.median(points, axis=0)) for points in points_um if len(points) > 2]
    diagonals_um = [float(np.linalg.norm(opinion.document.volume.spacing_um)) for opinion in opinions]
    voxel_um = max(diagonals_um, default=0.0)
    usual_um = float(np.median(np.concatenate(distances))) if distances else 0.0
    return max(_CUTOFF * usual_um, _LEAST_CUTOFF * voxel_um)


def _distances_um(points_um: Array, mean_um: Array) -> Array:
    """Return how far each annotator's points, (n, m, 3), are from the mean ones, (m, 3): root mean square."""
    squares = np.sum((points_um - mean_um) ** 2, axis=2)
    roots: Array = np.sqrt(np.mean(squares, axis=1))
    return roots


def _weights(points_um: Array, cutoff_um: float) -> Array:
    """Return the weight of each annotator, (n,), in the robust mean."""
    if len(points_um) < 3:
        return np.ones(len(points_um))
    center_um = np.median(points_um, axis=0)
    weights = np.zeros(len(points_um))
    for _ in range(_ROUNDS):
        shares = np.minimum(_distances_um(points_um, center_um) / cutoff_um, 1.0)
        weights = (1 - shares**2) ** 2
        if not weights.any():
            # Nobody is near the middle of them: there is no majority to go by.
            return np.ones(len(points_um))
        following_um = np.average(points_um, axis=0, weights=weights)
        moved_um = float(np.abs(following_um - center_um).max())
        center_um = following_um
        if moved_um < _SETTLED_UM:
            break
    return weights


def _agreed(
    name: str, opinions: Sequence[Opinion], points_um: Array, turned: tuple[str, ...], cutoff_um: float
) -> PartConsensus:
    weights = _weights(points_um, cutoff_um)
    names = [opinion.document.annotator for opinion in opinions]
    is_used = weights > 0
    used = [opinion for opinion, each in zip(opinions, is_used, strict=True) if each]
    parts = [opinion.document.part(name) for opinion in used]
    mean_um = np.average(points_um, axis=0, weights=weights)
    spread_um = float(_distances_um(points_um[is_used], mean_um).mean()) if len(used) > 1 else None
    certainty = "unsure" if 2 * sum(part.certainty == "unsure" for part in parts) >= len(parts) else "sure"
    fields = {"certainty": certainty, "source": "consensus", "locked": False, "adopted_from": None}
    first = parts[0]
    if isinstance(first, BoxAnnotation):
        boxes = [
            _box(part, opinion.document.annotator in turned)
            for part, opinion in zip(parts, used, strict=True)
            if isinstance(part, BoxAnnotation)
        ]
        box = _mean_box(boxes, weights[is_used])
        fields |= {
            "center_um": box.center_um,
            "size_um": box.size_um,
            "rotation_wxyz": box.rotation_wxyz,
            "state": _state(parts, box_extent_um(box), used),
        }
    else:
        position_um = vector(mean_um[0])
        fields |= {"position_um": position_um, "state": _state(parts, (position_um,), used)}
    return PartConsensus(
        changed(first, **fields),
        spread_um,
        tuple(opinion.document.annotator for opinion in used),
        tuple(each for each, is_in in zip(names, is_used, strict=True) if not is_in),
        turned,
    )


def _mean_box(boxes: Sequence[Box], weights: Array) -> Box:
    center_um = np.average([box.center_um for box in boxes], axis=0, weights=weights)
    size_um = np.average([box.size_um for box in boxes], axis=0, weights=weights)
    axes = np.average([box.axes for box in boxes], axis=0, weights=weights)
    if np.linalg.norm(axes[:, :2], axis=0).min() < _LEAST_AGREEMENT:
        # They point in opposite directions: there is no mean of them, and one of them is at least a box.
        axes = boxes[int(np.argmax(weights))].axes
    half_um = axes[:, 0] / np.linalg.norm(axes[:, 0]) * size_um[0] / 2
    cross_section_um = (float(size_um[1]), float(size_um[2]))
    return box_between(center_um - half_um, center_um + half_um, cross_section_um, axes[:, 1])


def _state(parts: Sequence[Part], extent_um: Sequence[Vector], used: Sequence[Opinion]) -> State:
    """Return how most of them saw it, but never against where it now lies."""
    inside = [used[0].document.volume.contains(position_um) for position_um in extent_um]
    if not any(inside):
        return "out_of_view"
    counts = Counter(part.state for part in parts)
    seen: tuple[State, ...] = ("placed", "occluded", "out_of_view")
    most = max(seen, key=lambda state: counts[state])
    if most == "out_of_view":
        return "occluded" if all(inside) else "out_of_view"
    return "placed" if most == "placed" else "occluded"


def _unplaced(opinions: Sequence[Opinion], name: str) -> Part:
    part = opinions[0].document.part(name)
    if isinstance(part, BoxAnnotation):
        return BoxAnnotation(link=part.link)
    return KeypointAnnotation(name=part.name)
