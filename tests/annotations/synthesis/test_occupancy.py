import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry import rotations
from annotations.geometry.body import LinkBody
from annotations.geometry.frames import voxel_to_um
from annotations.geometry.meshes import Mesh
from annotations.synthesis.grid import Grid
from annotations.synthesis.occupancy import Axes, body_occupancy, occupancy
from tests.annotations.synthesis.stl_files import mesh_of

# What stands straight in its middle ends halfway between voxels: the lengths below are even numbers of them.
FINE = Grid((110, 100, 120), (97.0, 103.0, 89.0))
MIDDLE_UM = np.array(FINE.extent_um) / 2

turns = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda values: np.linalg.norm(values) > 0.1)


def axes_of(grid: Grid) -> Axes:
    return grid.axis_um(0), grid.axis_um(1), grid.axis_um(2)


def placed(shape: trimesh.Trimesh, turn: tuple[float, ...], at_um: np.ndarray = MIDDLE_UM) -> Mesh:
    mesh = mesh_of(shape)
    return Mesh(mesh.vertices_um @ rotations.matrix(turn).T + at_um, mesh.triangles)


@pytest.mark.parametrize(
    ("shape", "volume_um3"),
    [
        (trimesh.creation.box((5044, 4120, 3204)), 5044 * 4120 * 3204),
        (trimesh.creation.cylinder(2100, 6408, sections=128), np.pi * 2100**2 * 6408),
        (trimesh.creation.icosphere(4, 3000), 4 / 3 * np.pi * 3000**3),
        # A hole through it stays empty.
        (trimesh.creation.annulus(1200, 3000, 3916, sections=128), np.pi * (3000**2 - 1200**2) * 3916),
    ],
    ids=["box", "cylinder", "sphere", "ring"],
)
@pytest.mark.parametrize("turn", [(1, 0, 0, 0), (0.9, 0.3, -0.2, 0.5)], ids=["straight", "turned"])
def test_the_voxels_volume_is_that_of_the_formula(
    shape: trimesh.Trimesh, volume_um3: float, turn: tuple[float, ...]
) -> None:
    filled = occupancy(placed(shape, turn), axes_of(FINE))

    assert filled.shape == FINE.shape
    assert filled.dtype == np.bool_
    assert filled.sum() * np.prod(FINE.spacing_um) == pytest.approx(volume_um3, rel=0.01)


@given(turns, st.booleans(), st.tuples(*[st.floats(0, 1)] * 3))
def test_inside_is_where_the_analytic_bodys_distance_is_negative(
    turn: tuple[float, ...], is_round: bool, at: tuple[float, ...]
) -> None:
    grid = Grid((24, 31, 27), (420.0, 330.0, 370.0))
    center_um = np.array(at) * grid.extent_um
    half_um = np.array([4000.0, 1500.0, 1500.0 if is_round else 900.0])
    body = LinkBody(center_um, rotations.matrix(turn), half_um, is_round=is_round)
    # Cylinders of trimesh lie along z, links along x; edges are sharp in the mesh, and rounded in the body.
    shape = trimesh.creation.box(2 * half_um)
    if is_round:
        shape = trimesh.creation.cylinder(half_um[1], 2 * half_um[0], sections=256)
        shape.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0)))

    filled = occupancy(placed(shape, turn, center_um), axes_of(grid))

    distance_um = body.distance_um(voxel_to_um(np.moveaxis(np.indices(grid.shape), 0, -1), grid.spacing_um))
    rounding_um = (np.sqrt(3) - 1) * body.edge_um
    assert filled[distance_um < -1].all()
    assert not filled[distance_um > rounding_um + 1].any()
    np.testing.assert_array_equal(body_occupancy(body, axes_of(grid)), distance_um <= 0)


@given(
    st.tuples(*[st.integers(-2, 9)] * 3),
    st.tuples(*[st.integers(1, 9)] * 3),
)
def test_a_box_with_faces_on_the_voxels_holds_those_from_its_low_faces_to_before_its_high_ones(
    low: tuple[int, int, int], size: tuple[int, int, int]
) -> None:
    grid = Grid((8, 9, 7), (1.0, 1.0, 1.0))
    box = mesh_of(trimesh.creation.box(bounds=[low, np.add(low, size)]))
    expected = np.zeros(grid.shape, dtype=bool)
    expected[
        tuple(slice(max(start, 0), max(start + count, 0)) for start, count in zip(low, size, strict=True))
    ] = True

    np.testing.assert_array_equal(occupancy(box, axes_of(grid)), expected)


def test_solids_that_touch_share_no_voxel_and_leave_none_out() -> None:
    grid = Grid((8, 8, 8), (1.0, 1.0, 1.0))
    octahedron = np.array([[4, 0, 0], [-4, 0, 0], [0, 4, 0], [0, -4, 0], [0, 0, 4], [0, 0, -4]]) + 4.0
    corners = np.array(
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    )
    # The floor of the upper half is the roof of the lower: its edges run right through columns.
    floor = np.array([[0, 2, 1], [0, 1, 3]])
    upper = Mesh(octahedron, np.concatenate([corners[4:], floor]))
    lower = Mesh(octahedron, np.concatenate([corners[:4], floor]))

    parts = [occupancy(mesh, axes_of(grid)) for mesh in (upper, lower)]

    assert parts[0].any()
    assert not np.any(parts[0] & parts[1])
    np.testing.assert_array_equal(parts[0] | parts[1], occupancy(Mesh(octahedron, corners), axes_of(grid)))


def test_a_mesh_beside_the_grid_fills_nothing() -> None:
    beside = placed(trimesh.creation.box((500, 500, 500)), (1, 0, 0, 0), -MIDDLE_UM)

    assert not occupancy(beside, axes_of(FINE)).any()


def test_a_mesh_around_the_grid_fills_it() -> None:
    grid = Grid((5, 6, 7), (1.0, 1.0, 1.0))

    assert occupancy(mesh_of(trimesh.creation.icosphere(2, 50)), axes_of(grid)).all()


def test_a_block_of_voxels_is_filled_as_in_the_whole_volume() -> None:
    mesh = placed(trimesh.creation.icosphere(3, 3000), (0.9, 0.3, -0.2, 0.5))
    block = slice(31, 47), slice(28, 90), slice(50, 81)
    x_um, y_um, z_um = axes_of(FINE)

    filled = occupancy(mesh, (x_um[block[0]], y_um[block[1]], z_um[block[2]]))

    assert filled.any()
    assert not filled.all()
    np.testing.assert_array_equal(filled, occupancy(mesh, axes_of(FINE))[block])
