"""Labels that people typed, matched to a list of landmarks where that is sound, and set aside where not."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from annotations.interchange.fcsv import Fiducial, PatientVector

_FEWEST_OTHERS = 3
_CLEAR_RATIO = 3.0
"""How many times nearer a point lies to the one landmark than to the other where there is no doubt."""


@dataclass(frozen=True)
class LabelledPoints:
    """The points of one file, by landmark.

    Attributes
    ----------
    position_ras_mm : mapping of str to (float, float, float)
        Of the landmarks whose label stands exactly once.
    doubled : mapping of str to tuple of Fiducial
        Points that share a landmark's label: none of them is taken for it.
    missing : tuple of str
        Landmarks that no point with a position is labelled as.
    notes : tuple of str
        What else was set aside, repaired or read with good will, each as a sentence without its full stop.
    """

    position_ras_mm: dict[str, PatientVector]
    doubled: Mapping[str, tuple[Fiducial, ...]] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """Every doubt about a label, each as a sentence without its full stop."""
        doubled = (
            f"the label {landmark!r} stands {len(same)} times; its points are set aside"
            for landmark, same in self.doubled.items()
        )
        missing = (f"no point is labelled {', '.join(map(repr, self.missing))}",) if self.missing else ()
        return (*self.notes, *doubled, *missing)


def plain_label(label: str) -> str:
    """Return a label without the spaces and quotation marks around it."""
    return label.strip(" \t\"'")


def common_landmarks(files: Sequence[Iterable[Fiducial]]) -> tuple[str, ...]:
    """Return the labels that stand in at least half of the files: numbers in their order, then words."""
    holders = Counter(
        label for points in files for label in {plain_label(point.label) for point in points} if label
    )
    spelt: dict[str, str] = {}
    for label, _ in sorted(holders.items(), key=lambda one: (-one[1], one[0])):
        spelt.setdefault(label.casefold(), label)
    common = [label for label in spelt.values() if 2 * holders[label] >= len(files)]
    return tuple(
        sorted(common, key=lambda label: (0, int(label), "") if label.isdecimal() else (1, 0, label))
    )


def match_labels(points: Iterable[Fiducial], landmarks: Sequence[str]) -> LabelledPoints:
    """Match the points of one file to landmarks by label.

    A label counts without the spaces and quotation marks around it, and capitals do not count. Points with
    another label, or with one that stands more than once, are set aside.
    """
    known = {landmark.casefold(): landmark for landmark in landmarks}
    found: dict[str, list[Fiducial]] = {landmark: [] for landmark in landmarks}
    notes: list[str] = []
    for point in points:
        landmark = known.get(plain_label(point.label).casefold())
        if landmark is None:
            notes.append(f"the label {point.label!r} is none of the landmarks'; its point is set aside")
            continue
        if point.label != landmark:
            notes.append(f"the label {point.label!r} is read as {landmark!r}")
        if point.position_ras_mm is None:
            notes.append(f"{landmark!r} is listed, but was not placed")
        else:
            found[landmark].append(point)
    return LabelledPoints(
        position_ras_mm={
            landmark: same[0].position_ras_mm
            for landmark, same in found.items()
            if len(same) == 1 and same[0].position_ras_mm is not None
        },
        doubled={landmark: tuple(same) for landmark, same in found.items() if len(same) > 1},
        missing=tuple(landmark for landmark, same in found.items() if not same),
        notes=tuple(notes),
    )


def repair_doubled(files: Sequence[LabelledPoints]) -> tuple[LabelledPoints, ...]:
    """Tell apart two points with one label, in files of the same object, where nothing leaves a doubt.

    That is so where exactly one label stands twice and one is missing, and of the two points one lies at
    least three times as near to the median of the one landmark in the other files (three at least) as to that
    of the other landmark, and the second point the reverse. Everything else stays set aside.
    """
    return tuple(
        _repaired(labelled, [other for other in files if other is not labelled]) for labelled in files
    )


def _repaired(labelled: LabelledPoints, others: Sequence[LabelledPoints]) -> LabelledPoints:
    if len(labelled.doubled) != 1 or len(labelled.missing) != 1:
        return labelled
    [(label, same)], [missing] = labelled.doubled.items(), labelled.missing
    label_ras_mm, missing_ras_mm = (_median_ras_mm(others, name) for name in (label, missing))
    if len(same) != 2 or label_ras_mm is None or missing_ras_mm is None:
        return labelled
    for kept, moved in (same, same[::-1]):
        if kept.position_ras_mm is None or moved.position_ras_mm is None:
            continue
        stay_mm = math.dist(moved.position_ras_mm, label_ras_mm)
        move_mm = math.dist(moved.position_ras_mm, missing_ras_mm)
        if _CLEAR_RATIO * move_mm <= stay_mm and _CLEAR_RATIO * math.dist(
            kept.position_ras_mm, label_ras_mm
        ) <= math.dist(kept.position_ras_mm, missing_ras_mm):
            called = f" ({moved.description.strip()!r})" if moved.description.strip() else ""
            note = (
                f"two points are labelled {label!r} and none {missing!r}: one of them{called} is taken for "
                f"{missing!r}, {move_mm:.1f} mm from that of the other files; their {label!r} is "
                f"{stay_mm:.1f} mm away"
            )
            told = {label: kept.position_ras_mm, missing: moved.position_ras_mm}
            return LabelledPoints(labelled.position_ras_mm | told, notes=(*labelled.notes, note))
    return labelled


def _median_ras_mm(files: Sequence[LabelledPoints], landmark: str) -> PatientVector | None:
    """Return the median of a landmark per axis; None where too few files have it."""
    positions = [
        labelled.position_ras_mm[landmark] for labelled in files if landmark in labelled.position_ras_mm
    ]
    if len(positions) < _FEWEST_OTHERS:
        return None
    right, anterior, superior = np.median(positions, axis=0)
    return (float(right), float(anterior), float(superior))
