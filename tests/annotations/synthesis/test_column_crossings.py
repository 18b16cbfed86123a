import itertools

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from annotations.geometry import rotations
from annotations.geometry.meshes import Mesh
from annotations.synthesis import column_crossings
from annotations.synthesis.column_crossings import crossings
from tests.annotations.synthesis.stl_files import mesh_of

SHAPES = {
    "box": trimesh.creation.box((4, 6, 8)),
    "cylinder": trimesh.creation.cylinder(4, 8, sections=12),
    "sphere": trimesh.creation.icosphere(2, 5),
    "ring": trimesh.creation.annulus(2, 5, 4, sections=8),
}


def counts(mesh: Mesh, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    found = np.zeros(len(x), dtype=int)
    for part in crossings(mesh, x, y):
        np.add.at(found, part.column, 1)
    return found


@given(st.sampled_from(sorted(SHAPES)), st.tuples(*[st.integers(-5, 5)] * 4).filter(any), st.booleans())
def test_each_column_crosses_a_closed_surface_an_even_number_of_times(
    shape: str, turn: tuple[int, ...], onto_grid: bool
) -> None:
    vertices = np.array(SHAPES[shape].vertices) @ rotations.matrix(turn).T
    if onto_grid:
        # Vertices and many an edge lie right on columns, and some triangles stand upright or collapse.
        vertices = np.rint(vertices)
    x, y = np.meshgrid(np.arange(-12.0, 13), np.arange(-12.0, 13), indexing="ij")

    found = counts(Mesh(vertices, np.array(SHAPES[shape].faces)), x.ravel(), y.ravel())

    assert found.any()
    assert np.all(found % 2 == 0)


@given(st.sampled_from(sorted(SHAPES)), st.integers(0, 1000))
def test_columns_anywhere_cross_where_rays_do(shape: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = Mesh(np.array(SHAPES[shape].vertices) + rng.normal(size=3), np.array(SHAPES[shape].faces))
    x, y = rng.uniform(-6, 6, (2, 20))
    first = np.full(20, np.inf)
    for part in crossings(mesh, x, y):
        np.minimum.at(first, part.column, part.depth_um)
        # Each lies on the plane of its triangle.
        corner, second, third = np.moveaxis(mesh.vertices_um[mesh.triangles[part.triangle]], 1, 0)
        places = np.column_stack([x[part.column], y[part.column], part.depth_um])
        normal = np.cross(second - corner, third - corner)
        assert np.einsum("ij,ij->i", places - corner, normal) == pytest.approx(0, abs=1e-9)

    rays = [mesh.first_hit_um((a, b, -20), (0, 0, 1)) for a, b in zip(x, y, strict=True)]
    assert first == pytest.approx([np.inf if ray is None else ray - 20 for ray in rays])


@given(st.integers(0, 1000))
def test_the_order_of_the_columns_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-6.0, 7), np.arange(-7.0, 8)))
    mesh = mesh_of(SHAPES["ring"])
    shuffled = rng.permutation(len(x))

    np.testing.assert_array_equal(counts(mesh, x, y)[shuffled], counts(mesh, x[shuffled], y[shuffled]))


@settings(max_examples=20)
@given(at_once=st.integers(1, 50))
def test_parts_of_any_size_hold_the_same_crossings(at_once: int) -> None:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-6.0, 7), np.arange(-7.0, 8)))
    mesh = mesh_of(SHAPES["sphere"])

    def all_of() -> list[tuple[int, float, int]]:
        parts = crossings(mesh, x, y)
        return sorted(
            itertools.chain.from_iterable(
                zip(part.column.tolist(), part.depth_um.tolist(), part.triangle.tolist(), strict=True)
                for part in parts
            )
        )

    whole = all_of()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(column_crossings, "_AT_ONCE", at_once)
        assert all_of() == whole
    assert len(whole) > 100


def test_without_columns_nothing_is_crossed() -> None:
    assert list(crossings(mesh_of(SHAPES["box"]), np.empty(0), np.empty(0))) == []
