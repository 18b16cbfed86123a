import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry import rotations
from annotations.geometry.body import LinkBody, surface_from_above
from annotations.geometry.kinematics import LinkFrame
from annotations.geometry.meshes import Mesh
from annotations.synthesis.mesh_body import MeshBody, MeshShape
from tests.annotations.synthesis.stl_files import mesh_of

BALL = mesh_of(trimesh.creation.icosphere(5, 2000))

turns = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda values: np.linalg.norm(values) > 0.1)


def frame(turn: tuple[float, ...], *base_um: float) -> LinkFrame:
    return LinkFrame(np.array(base_um), rotations.matrix(turn))


def posed(mesh: Mesh, at: LinkFrame) -> MeshBody:
    return MeshBody(MeshShape(mesh), at)


@given(turns, st.integers(0, 100))
def test_light_ends_on_a_box_where_it_ends_on_the_analytic_one(turn: tuple[float, ...], seed: int) -> None:
    half_um = np.array([3000.0, 1500.0, 900.0])
    body = LinkBody(np.array([100.0, -200.0, 5000.0]), rotations.matrix(turn), half_um, is_round=False)
    box = posed(mesh_of(trimesh.creation.box(2 * half_um)), frame(turn, 100, -200, 5000))
    x, y = np.random.default_rng(seed).uniform(-4000, 4000, (2, 200))

    exact, met = body.first_hit(x, y), box.first_hit(x, y)

    struck = np.isfinite(exact.depth_um)
    assert np.isfinite(met.depth_um[struck]).all()
    surface_um = np.column_stack([x, y, met.depth_um])[struck]
    # On a face, which has no rounding, the two agree.
    on_face = np.sum(half_um - np.abs((surface_um - body.center_um) @ body.axes) > body.edge_um, axis=1) == 2
    assert met.depth_um[struck][on_face] == pytest.approx(exact.depth_um[struck][on_face], abs=0.01)
    assert met.facing[struck][on_face] == pytest.approx(exact.facing[struck][on_face], abs=1e-4)
    # Everywhere the sharp box reaches beyond the rounded one.
    assert np.all(met.depth_um[struck] <= exact.depth_um[struck] + 0.01)


@given(turns)
def test_a_sphere_is_met_as_by_the_formula(turn: tuple[float, ...]) -> None:
    sphere = posed(BALL, frame(turn, 3000, 4000, 5000))
    x = np.linspace(3000, 4900, 50)
    height_um = np.sqrt(2000**2 - (x - 3000) ** 2)

    met = sphere.first_hit(x, np.full(50, 4000.0))

    assert met.depth_um == pytest.approx(5000 - height_um, abs=6)
    assert met.facing == pytest.approx(height_um / 2000, abs=0.05)


def test_where_nothing_is_met_depth_is_infinite_and_nothing_faces_the_light() -> None:
    body = posed(mesh_of(trimesh.creation.annulus(1000, 2000, 500)), frame((1, 0, 0, 0), 0, 0, 0))

    met = body.first_hit([0.0, 1500.0, 2500.0], [0.0, 0.0, 0.0])

    assert met.depth_um == pytest.approx([np.inf, -250, np.inf])
    assert met.facing == pytest.approx([0, 1, 0])


@given(turns)
def test_bounds_hold_the_mesh_and_touch_it(turn: tuple[float, ...]) -> None:
    mesh = mesh_of(trimesh.creation.cylinder(500, 3000, sections=9))
    body = posed(mesh, frame(turn, 7, 8, 9))
    low, high = body.bounds_um()

    assert low == pytest.approx(body.mesh.vertices_um.min(axis=0))
    assert high == pytest.approx(body.mesh.vertices_um.max(axis=0))


def test_a_mesh_is_posed_with_its_origin_at_the_links_base_and_its_x_along_the_link() -> None:
    mesh = Mesh(np.array([[0.0, 0, 0], [1000, 0, 0], [0, 10, 0]]), np.array([[0, 1, 2]]))
    upright = rotations.about_axis((0, 1, 0), -90)

    body = posed(mesh, frame(upright, 100, 200, 300))

    assert body.mesh.vertices_um[0] == pytest.approx([100, 200, 300])
    assert body.mesh.vertices_um[1] == pytest.approx([100, 200, 1300])


@pytest.mark.parametrize("mesh_first", [True, False])
def test_meshes_and_analytic_bodies_hide_each_other(mesh_first: bool) -> None:
    upper = posed(mesh_of(trimesh.creation.box((1000, 1000, 1000))), frame((1, 0, 0, 0), 0, 0, 1000))
    half_um = np.array([3000.0, 500.0, 500.0])
    lower = LinkBody(np.array([0.0, 0.0, 3000.0]), np.eye(3), half_um, is_round=True)
    x = np.array([-2000.0, 0.0, 2000.0, 4000.0])

    surface = surface_from_above([upper, lower] if mesh_first else [lower, upper], x, np.zeros(1))

    assert surface.depth_um[:, 0] == pytest.approx([2500, 500, 2500, np.inf])
    assert surface.facing[:, 0] == pytest.approx([1, 1, 1, 0])
