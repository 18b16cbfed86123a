import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, link_boxes
from annotations.geometry.meshes import Mesh, box_mesh, tool_meshes
from annotations.geometry.tool import ToolSpecification

LYING = Box((10.0, 20.0, 30.0), (6.0, 4.0, 2.0), (1.0, 0.0, 0.0, 0.0))

directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda values: math.hypot(*values) > 1e-2)


def corners(mesh: Mesh) -> np.ndarray:
    """Return the corners of each triangle about the mesh's middle, (m, 3, 3)."""
    return (mesh.vertices_um - mesh.vertices_um.mean(axis=0))[mesh.triangles]


def volume_um3(mesh: Mesh) -> float:
    """Return the enclosed volume, positive for outward triangles, by the divergence theorem."""
    first, second, third = np.moveaxis(corners(mesh), 1, 0)
    return float(np.einsum("ij,ij->", first, np.cross(second, third)) / 6)


def local(box: Box, positions_um: np.ndarray) -> np.ndarray:
    """Return positions in µm as shares of a box's size from its centre."""
    shares: np.ndarray = (positions_um - box.center_um) @ box.axes / box.size_um
    return shares


def is_on_surface(box: Box, positions_um: np.ndarray, is_round: bool) -> np.ndarray:
    x, y, z = np.abs(local(box, positions_um)).T
    beside = np.hypot(y, z) if is_round else np.maximum(y, z)
    # The cylinder has 32 flat sides, whose middles lie a little inside of the circle.
    least = math.cos(math.pi / 32) / 2 if is_round else 0.5
    # A ray may hit a triangle's plane as far beside it as rounding goes along the longest edge.
    slack = 1e-9 * max(box.size_um) / min(box.size_um)
    on_side = (beside >= least - slack) & (beside <= 0.5 + slack) & (x <= 0.5 + slack)
    on_end = (np.abs(x - 0.5) <= slack) & (beside <= 0.5 + slack)
    on_either: np.ndarray = on_side | on_end
    return on_either


@pytest.mark.parametrize("is_round", [True, False])
@given(box=...)
def test_a_surface_is_closed_and_faces_outwards(is_round: bool, box: Box) -> None:
    mesh = box_mesh(box, is_round=is_round)
    edges = Counter(
        (int(triangle[index]), int(triangle[(index + 1) % 3]))
        for triangle in mesh.triangles
        for index in range(3)
    )
    # Each edge is run along once each way, by the triangles on its two sides.
    assert set(edges.values()) == {1}
    assert all((end, start) in edges for start, end in edges)
    first, second, third = np.moveaxis(corners(mesh), 1, 0)
    assert (np.einsum("ij,ij->i", first, np.cross(second - first, third - first)) > 0).all()


@given(box=...)
def test_a_surface_encloses_the_body_s_volume(box: Box) -> None:
    length, width, height = box.size_um
    assert volume_um3(box_mesh(box, is_round=False)) == pytest.approx(length * width * height, rel=1e-6)
    polygon = 16 * math.sin(2 * math.pi / 32) * width * height / 4
    assert volume_um3(box_mesh(box, is_round=True)) == pytest.approx(length * polygon, rel=1e-6)
    assert polygon == pytest.approx(math.pi * width * height / 4, rel=0.01)


@pytest.mark.parametrize("is_round", [True, False])
@given(box=..., axis=st.integers(0, 2), share=st.floats(-0.6, 0.6))
def test_a_cut_lies_in_the_plane_and_on_the_surface(
    is_round: bool, box: Box, axis: int, share: float
) -> None:
    mesh = box_mesh(box, is_round=is_round)
    low_um, high_um = mesh.vertices_um[:, axis].min(), mesh.vertices_um[:, axis].max()
    through_um = (low_um + high_um) / 2 + share * (high_um - low_um)
    cut_um = mesh.cut_um(axis, through_um)
    assert (len(cut_um) > 0) == (abs(share) < 0.5) or abs(abs(share) - 0.5) < 1e-6
    np.testing.assert_allclose(cut_um[..., axis], through_um, atol=1e-8)
    assert is_on_surface(box, cut_um.reshape(-1, 3), is_round).all()


@pytest.mark.parametrize("is_round", [True, False])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_cut_is_a_closed_outline(is_round: bool, axis: int) -> None:
    # Vertices of a lying body are on the plane through its centre: they must not break the outline.
    cut_um = box_mesh(LYING, is_round=is_round).cut_um(axis, LYING.center_um[axis])
    long = cut_um[np.linalg.norm(cut_um[:, 1] - cut_um[:, 0], axis=1) > 1e-9]
    ends = Counter(tuple(np.round(end, 6)) for end in long.reshape(-1, 3))
    assert set(ends.values()) == {2}


def test_a_plane_beside_the_body_cuts_nothing() -> None:
    assert box_mesh(LYING, is_round=False).cut_um(0, 13.1).shape == (0, 2, 3)


@pytest.mark.parametrize("is_round", [True, False])
@given(box=..., direction=directions)
@example(
    box=Box((0.0, 0.0, 0.0), (14170.5, 10.0, 10.0), (0.0, 0.7525766947068778, 0.0, 0.658504607868518)),
    direction=(0.0, 1.0, 0.0),
)
def test_a_ray_to_the_middle_hits_the_surface_first(
    is_round: bool, box: Box, direction: tuple[float, float, float]
) -> None:
    mesh = box_mesh(box, is_round=is_round)
    ray = np.array(direction) / math.hypot(*direction)
    far_um = 2 * math.hypot(*box.size_um)
    origin_um = np.array(box.center_um) - far_um * ray
    hit_um = mesh.first_hit_um(origin_um, ray)
    assert hit_um is not None
    assert hit_um < far_um
    assert is_on_surface(box, (origin_um + hit_um * ray)[None], is_round).all()
    # From the middle outwards it meets the opposite side, and from outside away from it nothing.
    outwards_um = mesh.first_hit_um(box.center_um, ray)
    assert outwards_um == pytest.approx(far_um - hit_um, rel=1e-6)
    assert mesh.first_hit_um(origin_um, -ray) is None


def test_a_ray_beside_the_body_hits_nothing() -> None:
    mesh = box_mesh(LYING, is_round=False)
    assert mesh.first_hit_um((0.0, 20.5, 30.25), (1.0, 0.0, 0.0)) == pytest.approx(7.0)
    assert mesh.first_hit_um((0.0, 22.5, 30.25), (1.0, 0.0, 0.0)) is None


def test_the_tool_s_surface_is_round_where_its_links_are(forceps: ToolSpecification) -> None:
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 20.0, "theta2": 50.0})
    meshes, boxes = tool_meshes(pose, forceps), link_boxes(pose, forceps)
    assert list(meshes) == ["link0", "link1", "link2"]
    for name, is_round in (("link0", True), ("link1", True), ("link2", False)):
        expected = box_mesh(boxes[name], is_round=is_round)
        np.testing.assert_array_equal(meshes[name].vertices_um, expected.vertices_um)
        np.testing.assert_array_equal(meshes[name].triangles, expected.triangles)
