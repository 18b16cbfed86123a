"""Landmarks that several people placed on one object, several times each, and how far apart they are."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from annotations.errors import UserError
from annotations.interchange.fcsv import read_fcsv
from annotations.interchange.landmark_labels import common_landmarks, match_labels, repair_doubled

FILE_PATTERN = r"Rater(?P<rater>[^_]+)_(?P<session>[^_.]+)"
"""What tells rater and session from a file's name, where nothing else is said."""


@dataclass(frozen=True)
class LandmarkSets:
    """What people placed, by rater, session and landmark.

    Attributes
    ----------
    raters, sessions, landmarks : tuple of str
    position_ras_mm : (raters, sessions, landmarks, 3) array of float64
        In mm, in the patient's frame RAS; NaN where a landmark was not placed or was set aside.
    remarks : tuple of str
        Every doubt about a label, with its file's name.
    """

    raters: tuple[str, ...]
    sessions: tuple[str, ...]
    landmarks: tuple[str, ...]
    position_ras_mm: NDArray[np.float64]
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class DistanceFigure:
    """Distances to the mean point, summed up; None for what too few distances give.

    Attributes
    ----------
    n : int
        How many distances.
    mean_mm, sd_mm, largest_mm : float or None
        ``sd_mm`` with n − 1.
    """

    n: int
    mean_mm: float | None
    sd_mm: float | None
    largest_mm: float | None


def fcsv_files(places: Iterable[Path]) -> list[Path]:
    """Return the ``.fcsv`` files among files and folders, those of a folder in the order of their names."""
    return [
        path for place in places for path in (sorted(place.glob("*.fcsv")) if place.is_dir() else [place])
    ]


def read_landmark_sets(
    paths: Sequence[Path], landmarks: Sequence[str] = (), pattern: str = FILE_PATTERN
) -> LandmarkSets:
    """Read ``.fcsv`` files about one object; labels are matched, set aside or repaired, and that is said.

    Parameters
    ----------
    paths : sequence of Path
        One file per rater and session.
    landmarks : sequence of str, optional
        Their labels; those that stand in at least half of the files by default.
    pattern : str
        Regular expression that finds the groups ``rater`` and ``session`` in a file's name.

    Raises
    ------
    UserError
        There is no file, a name does not say whose it is, two files are of one session, or a file is
        broken.
    """
    if not paths:
        raise UserError("there are no .fcsv files", remedy="Name files, or a folder that holds some")
    places: dict[tuple[str, str], Path] = {}
    for path in paths:
        place = _place(path, pattern)
        if place in places:
            raise UserError(
                f"rater {place[0]}, session {place[1]}, has another file: {places[place].name}",
                where=path,
                remedy="Leave one of the two out",
            )
        places[place] = path
    files = [read_fcsv(path) for path in places.values()]
    names = tuple(landmarks) or common_landmarks(files)
    labelled = repair_doubled([match_labels(points, names) for points in files])
    raters = tuple(sorted({rater for rater, _ in places}))
    sessions = tuple(sorted({session for _, session in places}))
    position_ras_mm = np.full((len(raters), len(sessions), len(names), 3), np.nan)
    for (rater, session), points in zip(places, labelled, strict=True):
        for name, position in points.position_ras_mm.items():
            position_ras_mm[raters.index(rater), sessions.index(session), names.index(name)] = position
    remarks = tuple(
        f"{path.name}: {remark}"
        for path, points in zip(places.values(), labelled, strict=True)
        for remark in points.remarks
    )
    return LandmarkSets(raters, sessions, names, position_ras_mm, remarks)


def _place(path: Path, pattern: str) -> tuple[str, str]:
    try:
        match = re.search(pattern, path.name)
        if match is not None:
            return match["rater"], match["session"]
    except (re.error, IndexError) as error:
        raise UserError(
            f"the pattern {pattern!r} does not find a rater and a session ({error})",
            remedy="Write a regular expression with the groups (?P<rater>…) and (?P<session>…)",
        ) from error
    raise UserError(
        f"its name does not say whose it is: the pattern {pattern!r} is not found in it",
        where=path,
        remedy="Rename the file, or give a pattern with the groups (?P<rater>…) and (?P<session>…)",
    )


def distance_to_mean_point(position_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far each position is from the mean of all positions of its landmark.

    Parameters
    ----------
    position_mm : (..., landmarks, 3) array of float64
        NaN where there is none; that counts nowhere. Every position weighs the same.

    Returns
    -------
    (..., landmarks) array of float64
        NaN where there is no position.
    """
    pooled = position_mm.reshape(-1, *position_mm.shape[-2:])
    is_there = np.isfinite(pooled).all(axis=-1, keepdims=True)
    count = np.maximum(is_there.sum(axis=0), 1)
    mean_point_mm = np.where(is_there, pooled, 0.0).sum(axis=0) / count
    distance_mm: NDArray[np.float64] = np.linalg.norm(position_mm - mean_point_mm, axis=-1)
    return distance_mm


def session_distances(sets: LandmarkSets, tutorial: str | None = None) -> NDArray[np.float64]:
    """Return the distances to the mean point, without those of a tutorial session.

    The mean point of a landmark is the mean over all raters' positions in all sessions, the tutorial's
    included; the distances are those of the other sessions. So defined, the mean over all distances is what
    Lau et al. (2019) give for the MNI2009bAsym template: 0.99 mm. (With their files, session 0 as the
    tutorial and the three doubled labels repaired: 0.993 mm; with these set aside instead 0.987 mm, with the
    labels as they stand 1.027 mm.)

    Returns
    -------
    (raters, sessions − 1 or sessions, landmarks) array of float64
        In mm; NaN where there is no position.

    Raises
    ------
    UserError
        There is no session of the tutorial's name.
    """
    distance_mm = distance_to_mean_point(sets.position_ras_mm)
    if tutorial is None:
        return distance_mm
    if tutorial not in sets.sessions:
        raise UserError(
            f"there is no session {tutorial!r}; there are {', '.join(sets.sessions)}",
            remedy="Name one of these as the tutorial",
        )
    kept = [session != tutorial for session in sets.sessions]
    return distance_mm[:, kept]


def distance_figure(distance_mm: NDArray[np.float64]) -> DistanceFigure:
    """Sum up distances in mm, of any shape; NaN is passed over."""
    known = distance_mm[np.isfinite(distance_mm)]
    if not known.size:
        return DistanceFigure(0, None, None, None)
    return DistanceFigure(
        n=int(known.size),
        mean_mm=float(known.mean()),
        sd_mm=float(known.std(ddof=1)) if known.size > 1 else None,
        largest_mm=float(known.max()),
    )
