"""Where a slice cuts the bodies that are drawn into the volume, in pixels. No painting here."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from annotations.geometry.frames import Vector, vector
from annotator.session.editing.solids import Solid
from annotator.slices.projection import Plane
from annotator.slices.viewport import Viewport

Point = tuple[float, float]

# Between the handles at a box's centre and at its base.
_HINGE_SHARE = (-0.25, 0.0, 0.0)
# Corners nearer to each other, or to the line between their neighbours, are one.
_SAME_UM = 1e-3


@dataclass(frozen=True)
class HingeSense:
    """Which way the own +y of a box runs on a slice.

    Attributes
    ----------
    inner : (float, float)
        A pixel within the outline.
    outer : (float, float)
        Where the outline is met from there along +y.
    right, down, away : float
        The unit vector along +y: to the right and downwards on the screen, and away from the person.
    """

    inner: Point
    outer: Point
    right: float
    down: float
    away: float


@dataclass(frozen=True)
class SolidOutline:
    """A body where a slice cuts it.

    Attributes
    ----------
    solid : Solid
    points : tuple of (float, float)
        Corners of a convex polygon in pixels of the widget, all the way round.
    hinge : HingeSense or None
        None for what is no box of the document.
    """

    solid: Solid
    points: tuple[Point, ...]
    hinge: HingeSense | None = None


def solid_outlines(solids: Iterable[Solid], viewport: Viewport, index: int) -> tuple[SolidOutline, ...]:
    """Return the outlines of those bodies that the plane with an index cuts, in the order of the bodies."""
    plane, made = viewport.plane, []
    for solid in solids:
        points = tuple(viewport.pixel(corner) for corner in section_um(solid, plane, index))
        if points:
            hinge = _hinge_sense(solid, viewport, points) if solid.kind == "box" else None
            made.append(SolidOutline(solid, points, hinge))
    return tuple(made)


def section_um(solid: Solid, plane: Plane, index: int) -> tuple[Vector, ...]:
    """Return the corners of the convex polygon in which a plane cuts a body, all the way round; else ()."""
    return _section_um(solid, plane.axis, plane.depth_um(index))


# Each view asks for a body's section several times for every plane that it shows.
@lru_cache(maxsize=256)
def _section_um(solid: Solid, axis: int, through_um: float) -> tuple[Vector, ...]:
    corners_um = solid.mesh.cut_um(axis, through_um).reshape(-1, 3)
    if not len(corners_um):
        return ()
    # Of a convex body the corners stand around their middle in the order of the outline.
    first, second = np.delete(corners_um - corners_um.mean(axis=0), axis, axis=1).T
    order = np.argsort(np.arctan2(second, first))
    around_um, flat_um = corners_um[order], np.column_stack([first, second])[order]
    # Each comes at the end of two segments, and where a flat face is made of triangles there are more.
    is_first = np.hypot(*(flat_um - np.roll(flat_um, 1, axis=0)).T) > _SAME_UM
    around_um, flat_um = around_um[is_first], flat_um[is_first]
    before, after = flat_um - np.roll(flat_um, 1, axis=0), np.roll(flat_um, -1, axis=0) - flat_um
    across_um2 = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    is_corner = across_um2 > _SAME_UM * np.hypot(*(before + after).T)
    return tuple(vector(corner) for corner in around_um[is_corner])


def _hinge_sense(solid: Solid, viewport: Viewport, points: Sequence[Point]) -> HingeSense:
    plane, hinge = viewport.plane, solid.box.axes[:, 1]
    screen = np.eye(3)[[plane.horizontal, plane.vertical]]
    right, down, away = (float(hinge @ each) for each in (*screen, np.cross(*screen)))
    beside = viewport.pixel(solid.box.position_um(_HINGE_SHARE))
    middle = (sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points))
    inner = beside if _is_within(points, beside) else middle
    return HingeSense(inner, _way_out(points, inner, (right, down)), right, down, away)


def _is_within(points: Sequence[Point], at: Point) -> bool:
    """Say whether a pixel lies in a convex polygon."""
    turns = [_turn(first, last, at) for first, last in _edges(points)]
    return min(turns) >= 0 or max(turns) <= 0


def _way_out(points: Sequence[Point], inner: Point, way: Point) -> Point:
    """Return where a ray from inside a convex polygon leaves it."""
    farthest = 0.0
    for first, last in _edges(points):
        across = (last[0] - first[0]) * way[1] - (last[1] - first[1]) * way[0]
        if across:
            share = ((inner[0] - first[0]) * way[1] - (inner[1] - first[1]) * way[0]) / across
            along = _turn(first, last, inner) / across
            if 0 <= share <= 1 and math.isfinite(along):
                farthest = max(farthest, -along)
    return (inner[0] + farthest * way[0], inner[1] + farthest * way[1])


def _edges(points: Sequence[Point]) -> Iterable[tuple[Point, Point]]:
    return zip(points, (*points[1:], points[0]), strict=True)


def _turn(first: Point, last: Point, at: Point) -> float:
    """Return on which side of a line a pixel lies: the sign of twice a triangle's area."""
    return (last[0] - first[0]) * (at[1] - first[1]) - (last[1] - first[1]) * (at[0] - first[0])
