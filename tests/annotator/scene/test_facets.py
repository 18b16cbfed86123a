"""Bodies as they are seen: smooth where they are round, outlined where they end."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry.boxes import Box
from annotations.geometry.meshes import Mesh
from annotations.geometry.rotations import about_axis
from annotator.scene import facets as facets_module
from annotator.scene.camera import preset, turned
from annotator.scene.facets import _smooth, facets
from annotator.session.editing.solids import Solid

BOX = Box((8000.0, 12_000.0, 5000.0), (9000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))
BLOCK, ROUND = (Solid("link0", "ghost", BOX, is_round, "#56b4e9") for is_round in (False, True))
HOME = preset("home", (0, 0, 0), (17_400, 26_100, 10_800), 2, 1.4)
ALONG, ACROSS = (preset(name, (0, 0, 0), (17_400, 26_100, 10_800), 2, 1.4) for name in ("+x", "+z"))


def test_a_cylinder_is_smooth_round_its_axis_and_sharp_at_its_ends() -> None:
    body = facets(ROUND)
    outwards = body.corners_um - np.array(BOX.center_um)
    on_side = np.abs(body.normals[:, 0]) < 0.5
    radial = outwards[on_side] * (0, 1, 1)
    radial /= np.linalg.norm(radial, axis=2, keepdims=True)
    assert np.einsum("ijk,ijk->ij", body.corner_normals[on_side], radial) == pytest.approx(1, abs=1e-3)
    assert np.abs(body.corner_normals[~on_side, :, 0]) == pytest.approx(1)


@pytest.mark.parametrize("solid", [BLOCK, ROUND])
def test_each_edge_has_its_two_triangles(solid: Solid) -> None:
    body = facets(solid)
    assert 2 * len(body.edges_um) == 3 * len(body.corners_um)
    for edge_um, beside in zip(body.edges_um, body.beside, strict=True):
        for triangle in beside:
            corners = {tuple(corner) for corner in body.corners_um[triangle]}
            assert {tuple(end) for end in edge_um} <= corners


def test_a_body_that_moves_keeps_its_shape(monkeypatch: pytest.MonkeyPatch) -> None:
    shapes: list[Mesh] = []

    def smooth(mesh: Mesh, normals: np.ndarray) -> np.ndarray:
        shapes.append(mesh)
        return _smooth(mesh, normals)

    monkeypatch.setattr(facets_module, "_smooth", smooth)
    for step in range(5):
        box = Box((100.0 * step, 0.0, 0.0), (9000.0, 4000.0, 3777.0), about_axis((1, 2, 3), 10.0 * step))
        solid = replace(ROUND, box=box)
        body = facets(solid)
        assert body.corners_um == pytest.approx(solid.mesh.vertices_um[solid.mesh.triangles])
        first, second = body.corners_um[:, 1] - body.corners_um[:, 0], body.normals
        assert np.einsum("ij,ij->i", first, second) == pytest.approx(0, abs=1e-6)
    assert len(shapes) == 1


@given(st.floats(-1, 1), st.floats(-0.4, 0.4))
def test_a_block_is_outlined_by_the_edges_that_are_seen(right: float, down: float) -> None:
    camera = turned(HOME, right, down)
    seen = np.abs(np.array(camera.forward)) > 1e-9
    # Three faces towards the eye have nine edges, two have seven, one has four.
    assert len(facets(BLOCK).outline_um(camera)) == {3: 9, 2: 7, 1: 4}[int(seen.sum())]


def test_from_its_end_a_cylinder_is_a_ring_and_from_its_side_a_ring_and_two_lines_more() -> None:
    body = facets(ROUND)
    rim = len({tuple(end) for end in body.outline_um(ALONG).reshape(-1, 3)})
    assert len(body.outline_um(ALONG)) == rim
    lengths_um = np.linalg.norm(np.diff(body.outline_um(ACROSS), axis=1)[:, 0], axis=1)
    assert np.count_nonzero(np.isclose(lengths_um, 9000)) == 2


def test_what_faces_the_eye_does_so_fully() -> None:
    body = facets(BLOCK)
    facing = body.facing(ACROSS)
    assert facing[np.isclose(body.normals[:, 2], -1)] == pytest.approx(1)
    assert facing[np.isclose(body.normals[:, 2], 1)] == pytest.approx(-1)
    assert facing[np.isclose(body.normals[:, 0], 1)] == pytest.approx(0)


def test_depth_grows_away_from_the_eye() -> None:
    body = facets(BLOCK)
    depths_um = body.depths_um(ACROSS)
    near, far = np.isclose(body.normals[:, 2], -1), np.isclose(body.normals[:, 2], 1)
    assert depths_um[far].min() - depths_um[near].max() == pytest.approx(4000)
