import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from annotations.synthesis import mesh_file
from annotations.synthesis.mesh_file import MeshError, read_mesh
from tests.annotations.synthesis.stl_files import without, write_stl

BOX = trimesh.creation.box((4, 3, 2))
UP = BOX.face_normals[:, 2] > 0.5
BALL = trimesh.creation.icosphere(3, 2)
TUBE = without(
    trimesh.creation.cylinder(1, 8, sections=24),
    *np.flatnonzero(np.abs(trimesh.creation.cylinder(1, 8, sections=24).face_normals[:, 2]) > 0.5),
)


def loose(shape: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a shape whose triangles have corners of their own, as in an STL file."""
    corners = np.asarray(shape.vertices)[np.asarray(shape.faces)].reshape(-1, 3)
    return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)


def volume_um3(path: Path, um_per_unit: float = 1000.0) -> float:
    mesh = read_mesh(path, um_per_unit).mesh
    corner, second, third = np.moveaxis(mesh.vertices_um[mesh.triangles], 1, 0)
    return float(np.einsum("ij,ij->", corner, np.cross(second, third)) / 6)


@pytest.mark.parametrize("as_text", [False, True], ids=["binary", "text"])
def test_a_closed_mesh_is_read_as_it_is(tmp_path: Path, as_text: bool) -> None:
    found = read_mesh(write_stl(BALL, tmp_path / "ball.STL", as_text=as_text), 1000.0)

    assert found.repairs == ()
    assert found.mesh.vertices_um.shape == BALL.vertices.shape
    assert found.mesh.triangles.shape == BALL.faces.shape
    assert np.linalg.norm(found.mesh.vertices_um, axis=1) == pytest.approx(2000, rel=1e-6)


@pytest.mark.parametrize("um_per_unit", [1.0, 25_400.0, 1e6])
def test_a_unit_of_the_file_is_as_long_as_was_said(tmp_path: Path, um_per_unit: float) -> None:
    shape = trimesh.creation.box(np.array([4000, 3000, 2000]) / um_per_unit)

    assert volume_um3(write_stl(shape, tmp_path / "b.stl"), um_per_unit) == pytest.approx(2.4e10, rel=1e-5)


def test_a_binary_file_may_begin_like_a_text(tmp_path: Path) -> None:
    path = write_stl(BOX, tmp_path / "b.stl")
    path.write_bytes(b"solid".ljust(80) + path.read_bytes()[80:])

    assert volume_um3(path) == pytest.approx(24e9)


def test_a_text_may_hold_several_solids_and_foreign_letters(tmp_path: Path) -> None:
    path = write_stl(BOX, tmp_path / "b.stl", as_text=True)
    second = write_stl(BOX.copy().apply_translation((9, 0, 0)), tmp_path / "c.stl", as_text=True)
    path.write_bytes((path.read_bytes() + b"\n" + second.read_bytes()).replace(b"solid", b"solid \xe4"))
    path.write_bytes(path.read_bytes().replace(b"endsolid \xe4", b"endsolid"))

    assert volume_um3(path) == pytest.approx(48e9)


def test_solids_that_share_an_edge_are_closed(tmp_path: Path) -> None:
    both = trimesh.util.concatenate([BOX, BOX.copy().apply_translation((4, 3, 0))])
    path = write_stl(both, tmp_path / "both.stl")

    assert read_mesh(path, 1000.0).repairs == ()
    assert volume_um3(path) == pytest.approx(48e9)


@pytest.mark.parametrize(
    ("shape", "whole_um3"),
    [
        (without(BOX, 3), 24e9),
        (without(BOX, *np.flatnonzero(UP)), 24e9),
        (TUBE, 24 / 2 * np.sin(2 * np.pi / 24) * 8e9),
    ],
    ids=["a triangle", "a face", "both ends of a tube"],
)
def test_holes_are_filled_and_it_says_so(tmp_path: Path, shape: trimesh.Trimesh, whole_um3: float) -> None:
    path = write_stl(shape, tmp_path / "open.stl")

    assert "holes filled with" in " ".join(read_mesh(path, 1000.0).repairs)
    assert volume_um3(path) == pytest.approx(whole_um3, rel=1e-5)


def test_vertices_that_nearly_touch_are_merged_and_it_says_so(tmp_path: Path) -> None:
    apart = loose(BALL)
    apart.vertices += np.random.default_rng(3).uniform(-1e-5, 1e-5, apart.vertices.shape)
    path = write_stl(apart, tmp_path / "apart.stl")

    found = read_mesh(path, 1000.0)

    assert len(found.mesh.vertices_um) == len(BALL.vertices)
    assert "vertices merged" in found.repairs[0]
    assert volume_um3(path) == pytest.approx(BALL.volume * 1e9, rel=1e-4)


def test_triangles_that_face_inwards_are_turned_and_it_says_so(tmp_path: Path) -> None:
    turned = loose(BALL)
    turned.faces = np.where(
        np.arange(len(turned.faces))[:, None] % 3 == 0, turned.faces[:, ::-1], turned.faces
    )
    path = write_stl(turned, tmp_path / "turned.stl")

    assert "triangles turned" in " ".join(read_mesh(path, 1000.0).repairs)
    assert volume_um3(path) == pytest.approx(BALL.volume * 1e9, rel=1e-5)


def test_triangles_without_area_are_dropped_and_it_says_so(tmp_path: Path) -> None:
    faces = np.concatenate([np.asarray(BOX.faces), [[0, 0, 1]]])
    path = write_stl(trimesh.Trimesh(BOX.vertices, faces, process=False), tmp_path / "b.stl")

    assert read_mesh(path, 1000.0).repairs == ("1 triangles without area dropped",)
    assert volume_um3(path) == pytest.approx(24e9)


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (without(BOX, *range(1, 12)), "not watertight"),
        (without(BALL, *np.flatnonzero(BALL.triangles_center[:, 2] < 0)), "a guess"),
        (without(BALL, *range(0, len(BALL.faces), 3)), "not watertight"),
        (trimesh.Trimesh(BOX.vertices, [*BOX.faces[:2], *BOX.faces[:2, ::-1]], process=False), "nothing"),
    ],
    ids=["one triangle", "half a ball", "many holes", "two sides of a sheet"],
)
def test_what_cannot_be_closed_is_refused(tmp_path: Path, shape: trimesh.Trimesh, said: str) -> None:
    path = write_stl(shape, tmp_path / "open.stl")

    with pytest.raises(MeshError, match=said) as caught:
        read_mesh(path, 1000.0)

    assert str(path) in str(caught.value)
    assert "as a solid" in caught.value.remedy


GOOD = trimesh.exchange.stl.export_stl(BOX)
TEXT = trimesh.exchange.stl.export_stl_ascii(BOX).encode()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "no triangles"),
        (b"v 1 2 3\nf 1 2 3\n", "no triangles"),
        (GOOD[:-77], "no triangles"),
        (GOOD[:40], "no triangles"),
        (GOOD + b"\0", "no triangles"),
        (TEXT[: len(TEXT) // 2], "no triangles"),
        (GOOD[:96] + struct.pack("<f", np.nan) + GOOD[100:], "not finite"),
        (GOOD[:96] + struct.pack("<f", np.inf) + GOOD[100:], "not finite"),
        (GOOD[:96] + struct.pack("<f", 1e30) + GOOD[100:], "farther than"),
        (TEXT.replace(b"vertex ", b"vertex one ", 1), "damaged"),
        (b"endsolid solid", "damaged"),
        (b"solid a\nvertex 1\nvertex 2\nvertex 3\nendsolid", "damaged"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "damaged.stl"
    path.write_bytes(content)

    with pytest.raises(MeshError, match=said) as caught:
        read_mesh(path, 1000.0)

    assert caught.value.where == path
    assert caught.value.remedy


@given(st.binary(max_size=400), st.sampled_from([b"", b"solid ", GOOD[:84], GOOD[:150], TEXT[:200]]))
def test_no_content_leads_to_another_error(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, start: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "fuzz.stl"
    path.write_bytes(start + content)

    with pytest.raises(MeshError):
        read_mesh(path, 1000.0)


@given(st.integers(84, len(GOOD) - 1), st.integers(0, 255))
def test_a_changed_byte_leads_to_a_closed_mesh_or_an_error(
    tmp_path_factory: pytest.TempPathFactory, place: int, byte: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "changed.stl"
    path.write_bytes(GOOD[:place] + bytes([byte]) + GOOD[place + 1 :])

    try:
        mesh = read_mesh(path, 1000.0).mesh
    except MeshError:
        return
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert np.all(np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0)


@pytest.mark.parametrize("um_per_unit", [1e-9, 1e9])
def test_a_unit_that_makes_no_sense_is_refused(tmp_path: Path, um_per_unit: float) -> None:
    with pytest.raises(MeshError, match="a unit") as caught:
        read_mesh(write_stl(BOX, tmp_path / "b.stl"), um_per_unit)

    assert "how many µm a unit" in caught.value.remedy


def test_a_huge_file_is_refused_unread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "huge.stl"
    with path.open("wb") as stream:
        stream.truncate(10**9)
    monkeypatch.delattr(Path, "read_bytes")

    with pytest.raises(MeshError, match="1000 MB"):
        read_mesh(path, 1000.0)

    assert mesh_file._MOST_BYTES < 10**9


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="could not be read") as caught:
        read_mesh(tmp_path / "none.stl", 1000.0)

    assert caught.value.where == tmp_path / "none.stl"
