"""Meshes of known shape, and STL files of them, for the tests."""

from pathlib import Path

import numpy as np
import trimesh

from annotations.geometry.kinematics import ToolPose
from annotations.geometry.meshes import Mesh
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.mesh_tool import MeshTool

FORCEPS = shipped_tools()["magnetic-forceps"]


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.array(shape.vertices, dtype=np.float64), np.array(shape.faces, dtype=np.int64))


def write_stl(shape: trimesh.Trimesh, path: Path, *, as_text: bool = False) -> Path:
    content = (
        trimesh.exchange.stl.export_stl_ascii(shape).encode()
        if as_text
        else trimesh.exchange.stl.export_stl(shape)
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def without(shape: trimesh.Trimesh, *triangles: int) -> trimesh.Trimesh:
    """Return a shape that lacks some of its triangles."""
    kept = np.setdiff1d(np.arange(len(shape.faces)), triangles)
    return trimesh.Trimesh(shape.vertices, shape.faces[kept], process=False)


def link_shapes() -> dict[str, trimesh.Trimesh]:
    """Return each link of the forceps as a mesh with its base at the origin and its tip on +x, in mm."""
    shapes = {}
    for link in FORCEPS.links:
        width, height = link.cross_section_um
        shape = trimesh.creation.box((link.length_um, width, height))
        if link.is_round:
            shape = trimesh.creation.cylinder(width / 2, link.length_um, sections=64)
            shape.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0)))
        shapes[link.name] = shape.apply_translation((link.length_um / 2, 0, 0)).apply_scale(1e-3)
    return shapes


def write_links(folder: Path) -> Path:
    """Write a file for each link of the forceps."""
    for name, shape in link_shapes().items():
        write_stl(shape, folder / f"{name}.stl")
    return folder


def write_configurations(folder: Path, *angles_deg: tuple[float, float]) -> Path:
    """Write the whole forceps as posed by the meshes of its links, in the root link's frame."""
    files = {path.stem: path for path in write_links(folder / "links").iterdir()}
    links = MeshTool.per_link(FORCEPS, files, 1000.0)
    root_um = FORCEPS.links[0].length_um / 2
    for theta1, theta2 in angles_deg:
        pose = ToolPose((root_um, 0, 0), (1, 0, 0, 0), {"theta1": theta1, "theta2": theta2})
        parts = [
            trimesh.Trimesh(body.mesh.vertices_um / 1000, body.mesh.triangles)
            for body in links.bodies(pose).values()
        ]
        write_stl(trimesh.util.concatenate(parts), folder / f"theta1_{theta1:g}_theta2_{theta2:g}.stl")
    return folder
