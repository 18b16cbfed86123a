"""Where columns along depth cross a closed surface of triangles: what shadow and occupancy are made of.

A scanline method: the columns with one x are a line across the surface, and each triangle that this line
crosses takes up an interval of it. A vertex counts as beyond a line only if its x is truly larger, an
interval holds its lower end and not its upper, and an edge is cut from the same end for both of its
triangles. So each column crosses a closed surface an even number of times, through edges and vertices too.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.meshes import Mesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_AT_ONCE = 1 << 20
"""Most pairs of triangle and line, and most crossings, that are worked on together: some 100 MB."""


@dataclass(frozen=True, eq=False)
class Crossings:
    """Some crossings of columns with a surface.

    Attributes
    ----------
    column : ndarray of int64, shape (n,)
        Which of the columns.
    depth_um : ndarray of float64, shape (n,)
    triangle : ndarray of int64, shape (n,)
        Which of the mesh's triangles.
    """

    column: Indices
    depth_um: Array
    triangle: Indices


def crossings(mesh: Mesh, x_um: Array, y_um: Array) -> Iterator[Crossings]:
    """Yield all crossings of columns along depth with a surface, in no order, in parts of bounded size.

    Parameters
    ----------
    mesh : Mesh
    x_um, y_um : ndarray of float64, shapes (n,)
        Where the columns are, in any order; fastest where many share their x, as those over a grid do.
    """
    columns = _Columns(x_um, y_um)
    # How many lines lie before each vertex; line i crosses an edge whose ends have i on different sides.
    passed = np.searchsorted(columns.lines_um, mesh.vertices_um[:, 0], side="left")[mesh.triangles]
    first_line, after_line = passed.min(axis=1), passed.max(axis=1)
    crossed = np.flatnonzero(after_line > first_line)
    lines = (after_line - first_line)[crossed]
    for part in _parts(lines):
        triangle, line = _unrolled(crossed[part], first_line[crossed[part]], lines[part])
        alone, *others = _alone_first(mesh.triangles[triangle], passed[triangle] > line[:, None]).T
        line_um = columns.lines_um[line]
        ends = [_cut_edge(mesh.vertices_um, alone, other, line_um) for other in others]
        (y_start, z_start), (y_end, z_end) = ends
        first = columns.count_before(line, np.minimum(y_start, y_end))
        met = columns.count_before(line, np.maximum(y_start, y_end)) - first
        for piece in _parts(met):
            pair, place = _unrolled(np.arange(len(met))[piece], first[piece], met[piece])
            share = (columns.y_um[place] - y_start[pair]) / (y_end - y_start)[pair]
            depth_um = z_start[pair] + share * (z_end - z_start)[pair]
            yield Crossings(columns.order[place], depth_um, triangle[pair])


class _Columns:
    """Columns in the order of their lines, and of y on each line.

    Attributes
    ----------
    order : ndarray of int64, shape (n,)
        Indices of the columns as they were given.
    y_um : ndarray, shape (n,)
        In this order.
    lines_um : ndarray, shape (k,)
        The lines' x, ascending.
    """

    def __init__(self, x_um: Array, y_um: Array) -> None:
        self.order = np.lexsort((y_um, x_um))
        self.y_um = y_um[self.order]
        self.lines_um, line = np.unique(x_um[self.order], return_inverse=True)
        self._levels_um = np.unique(y_um)
        self._keys = self._key(line, self.y_um)

    def count_before(self, line: Indices, y_um: Array) -> Indices:
        """Return how many columns come before those that lie on a line at some y or beyond."""
        return np.asarray(np.searchsorted(self._keys, self._key(line, y_um), side="left"), dtype=np.int64)

    def _key(self, line: Indices, y_um: Array) -> Indices:
        """Return a number that orders places by line and then by y, as finely as there are columns."""
        level = np.searchsorted(self._levels_um, y_um, side="left")
        return np.asarray(line * (len(self._levels_um) + 1) + level, dtype=np.int64)


def _parts(counts: Indices) -> Iterator[slice]:
    """Yield slices of consecutive counts whose sum is bounded, or that are one count alone."""
    total = np.cumsum(counts)
    start = 0
    while start < len(counts):
        done = total[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(total, done + _AT_ONCE, side="right")))
        yield slice(start, stop)
        start = stop


def _unrolled(owner: Indices, first: Indices, count: Indices) -> tuple[Indices, Indices]:
    """Return for each owner the numbers from its first on, ``count`` of them: owners and numbers, flat."""
    before = np.cumsum(count) - count
    return np.repeat(owner, count), np.arange(int(count.sum())) + np.repeat(first - before, count)


def _alone_first(triangles: Indices, beyond: NDArray[np.bool_]) -> Indices:
    """Return triangles, (n, 3), turned so that the corner alone on its side of the line comes first."""
    alone = np.where(beyond.sum(axis=1, keepdims=True) == 1, beyond, ~beyond).argmax(axis=1)
    return np.take_along_axis(triangles, (alone[:, None] + np.arange(3)) % 3, axis=1)


def _cut_edge(vertices_um: Array, one: Indices, other: Indices, x_um: Array) -> tuple[Array, Array]:
    """Return y and z where edges between vertices on different sides of x cross it."""
    start, end = vertices_um[np.minimum(one, other)], vertices_um[np.maximum(one, other)]
    share = (x_um - start[:, 0]) / (end[:, 0] - start[:, 0])
    y_um = start[:, 1] + share * (end[:, 1] - start[:, 1])
    z_um = start[:, 2] + share * (end[:, 2] - start[:, 2])
    return y_um, z_um
