"""Outlines of bodies seen along an axis."""

import hypothesis.strategies as st
import numpy as np
from hypothesis import given
from scipy.spatial import ConvexHull

from annotations.geometry.boxes import Box
from annotations.geometry.meshes import box_mesh
from annotations.geometry.rotations import quaternion
from annotations.geometry.silhouette import silhouette_um

parts = st.floats(-1, 1)
turns = st.tuples(parts, parts, parts, parts).filter(lambda turn: np.linalg.norm(turn) > 0.1).map(quaternion)
lengths = st.floats(100.0, 10_000.0)


@given(turns, st.tuples(lengths, lengths, lengths), st.booleans(), st.permutations([0, 1, 2]))
def test_it_is_the_convex_hull_of_the_corners(
    rotation: tuple, size_um: tuple, is_round: bool, order: list[int]
) -> None:
    mesh = box_mesh(Box((500.0, -300.0, 100.0), size_um, rotation), is_round=is_round)
    axes = (order[0], order[1])

    outline_um = silhouette_um(mesh, axes)

    hull = ConvexHull(mesh.vertices_um[:, list(axes)])
    following = np.roll(outline_um, -1, axis=0)
    area_um2 = 0.5 * np.sum(outline_um[:, 0] * following[:, 1] - following[:, 0] * outline_um[:, 1])
    # The volume of two dimensions is an area.
    np.testing.assert_allclose(abs(area_um2), hull.volume, rtol=1e-6)


def test_of_a_box_that_lies_along_the_axes_it_is_a_rectangle() -> None:
    mesh = box_mesh(Box((0.0, 0.0, 0.0), (8.0, 4.0, 2.0), (1.0, 0.0, 0.0, 0.0)), is_round=False)

    corners = {tuple(corner) for corner in np.round(silhouette_um(mesh, (0, 2)), 6).tolist()}

    assert corners == {(-4.0, -1.0), (4.0, -1.0), (4.0, 1.0), (-4.0, 1.0)}
