"""Meshes of STL files: read, checked to be closed, and mended where that can be done."""

import hashlib
import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from annotations.errors import UserError
from annotations.geometry.meshes import Mesh

if TYPE_CHECKING:
    # It takes a second to import, and most commands read no mesh.
    from trimesh import Trimesh

_MOST_BYTES = 100_000_000
"""Two million triangles of a binary file: many more than a tool needs, and gigabytes while they are read."""
_LEAST_SIZE_UM, _FARTHEST_UM = 10.0, 1e8
_SAME_UM_DIGITS = 6
"""Positions that agree to a picometre are one."""
_NEAR_UM = 0.1
"""Where a mesh is open, those as near as this are one, too: far below what the light resolves."""
_MOST_FILLED = 1 / 3
"""Largest share of the surface that may be made up to fill holes: more would be a guess."""
_HEADER_BYTES, _TRIANGLE_BYTES = 84, 50
"""Of a binary file; the header ends with the number of triangles."""


class MeshError(UserError):
    """A mesh file that is absent, damaged, or not closed."""


@dataclass(frozen=True, eq=False)
class ReadMesh:
    """What was read from a file.

    Attributes
    ----------
    mesh : Mesh
        Closed: each edge belongs to an even number of triangles. In the file's own frame.
    repairs : tuple of str
        What had to be mended to make it so, in words; empty where all was in order.
    sha256 : str
        Of the file's content, as hexadecimal digits.
    """

    mesh: Mesh
    repairs: tuple[str, ...]
    sha256: str


def read_mesh(path: Path, um_per_unit: float) -> ReadMesh:
    """Read an STL file, binary or text, and see to it that the mesh is closed.

    Vertices at one position are one vertex. Where that leaves the mesh open, vertices that nearly touch are
    merged, then holes are filled; triangles that do not turn alike are turned.

    Parameters
    ----------
    path : Path
    um_per_unit : float
        How many µm one unit of the file is, for STL files do not say: 1000 where it is a millimetre.

    Raises
    ------
    MeshError
        The file is absent, too large, damaged or no STL file, or the mesh is open and stays open.
    """
    content = _content(path)
    mesh = _load(content, path, um_per_unit)
    repairs: list[str] = []
    mesh.merge_vertices(digits_vertex=_SAME_UM_DIGITS)
    _drop_collapsed(mesh, repairs)
    if _open_edges(mesh):
        _merge_near(mesh, repairs)
    if _open_edges(mesh):
        _fill_holes(mesh, repairs, path)
    if still_open := _open_edges(mesh):
        tried = f", although it was mended: {', '.join(repairs)}" if repairs else ""
        raise _not_closed(path, f"{still_open} of its edges belong to an odd number of triangles{tried}")
    _turn_outwards(mesh, repairs)
    if not _volume(mesh) > 0:
        raise MeshError("the mesh encloses nothing", where=path, remedy="Export it again as a solid")
    vertices_um, triangles = np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
    return ReadMesh(Mesh(vertices_um, triangles), tuple(repairs), hashlib.sha256(content).hexdigest())


def _load(content: bytes, path: Path, um_per_unit: float) -> "Trimesh":
    import trimesh
    from trimesh.exchange.stl import load_stl

    count = int.from_bytes(content[_HEADER_BYTES - 4 : _HEADER_BYTES], "little")
    if len(content) != _HEADER_BYTES + _TRIANGLE_BYTES * count:
        # Not binary, so it is text, in whatever encoding: only names can have letters beyond ASCII.
        content = content.decode("utf-8", errors="replace").encode()
    try:
        # What else the file says, normals above all, is not needed and may be wrong.
        found = load_stl(io.BytesIO(content))
        solids = found.get("geometry", {"": found}).values()
        corners = [np.asarray(solid["vertices"], dtype=np.float64) for solid in solids]
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise _damaged(path, f"it is no STL file, or a damaged one ({error})") from error
    if not corners:
        raise _damaged(path, "no triangles were found in it: it is empty, cut short, or no STL file")
    vertices_um = np.concatenate(corners) * um_per_unit
    if not np.isfinite(vertices_um).all():
        raise _damaged(path, "some of its positions are not finite numbers")
    if np.ptp(vertices_um, axis=0).max() < _LEAST_SIZE_UM or np.abs(vertices_um).max() > _FARTHEST_UM:
        raise MeshError(
            f"at {um_per_unit:g} µm a unit it is smaller than {_LEAST_SIZE_UM:g} µm or reaches farther than "
            f"{_FARTHEST_UM / 1e6:g} m",
            where=path,
            remedy="Check the mesh, and how many µm a unit of it is",
        )
    return trimesh.Trimesh(vertices_um, np.arange(len(vertices_um)).reshape(-1, 3), process=False)


def _content(path: Path) -> bytes:
    try:
        size = path.stat().st_size
        if size > _MOST_BYTES:
            raise MeshError(
                f"it has {size / 1e6:.0f} MB, and at most {_MOST_BYTES / 1e6:.0f} MB are read",
                where=path,
                remedy="Export the mesh with fewer triangles",
            )
        return path.read_bytes()
    except OSError as error:
        raise MeshError(
            f"it could not be read ({error.strerror or error})", where=path, remedy="Choose another file"
        ) from error


def _damaged(path: Path, problem: str) -> MeshError:
    return MeshError(problem, where=path, remedy="Export the mesh again")


def _not_closed(path: Path, reason: str) -> MeshError:
    return MeshError(
        f"the mesh is not watertight: {reason}",
        where=path,
        remedy="Close it in the program that made it, and export it again as a solid",
    )


def _open_edges(mesh: "Trimesh") -> int:
    """Return how many edges belong to an odd number of triangles: where there are none, parity holds.

    Unlike trimesh's own check this allows an edge of four triangles, at which two solids touch.
    """
    low, high = mesh.edges_sorted.T
    _, count = np.unique(low * len(mesh.vertices) + high, return_counts=True)
    return int(np.count_nonzero(count % 2))


def _drop_collapsed(mesh: "Trimesh", repairs: list[str]) -> None:
    """Drop triangles of which two corners are one vertex."""
    first, second, third = mesh.faces.T
    whole = (first != second) & (second != third) & (third != first)
    if not whole.all():
        mesh.update_faces(whole)
        repairs.append(f"{np.count_nonzero(~whole)} triangles without area dropped")


def _merge_near(mesh: "Trimesh", repairs: list[str]) -> None:
    before = len(mesh.vertices)
    pairs = cKDTree(mesh.vertices).query_pairs(_NEAR_UM, output_type="ndarray")
    links = coo_array((np.ones(len(pairs), dtype=bool), tuple(pairs.T)), shape=(before, before))
    group = connected_components(links, directed=False)[1]
    _, representative = np.unique(group, return_index=True)
    mesh.update_vertices(mask=representative, inverse=group)
    if merged := before - len(mesh.vertices):
        repairs.append(f"{merged} vertices merged with others less than {_NEAR_UM:g} µm away")
        _drop_collapsed(mesh, repairs)


def _fill_holes(mesh: "Trimesh", repairs: list[str], path: Path) -> None:
    import trimesh

    before, area_before = len(mesh.faces), mesh.area
    trimesh.repair.fill_holes(mesh, use_fan=True)
    added, share = len(mesh.faces) - before, 1 - area_before / mesh.area
    if share > _MOST_FILLED:
        raise _not_closed(path, "its holes are so large that to fill them is a guess")
    if added:
        repairs.append(f"holes filled with {added} triangles, {100 * share:.2g} % of the surface")


def _turn_outwards(mesh: "Trimesh", repairs: list[str]) -> None:
    """Turn triangles so that their corners go right-handed about the outward normal."""
    import trimesh

    before = np.array(mesh.faces)
    trimesh.repair.fix_winding(mesh)  # type: ignore[no-untyped-call]
    if _volume(mesh) < 0:
        mesh.invert()
    if turned := np.count_nonzero((mesh.faces != before).any(axis=1)):
        repairs.append(f"{turned} triangles turned to face outwards")


def _volume(mesh: "Trimesh") -> float:
    """Return the volume inside in µm³, negative where the triangles face inwards."""
    corner, second, third = np.moveaxis(np.asarray(mesh.triangles), 1, 0)
    return float(np.einsum("ij,ij->", corner, np.cross(second, third)) / 6)
