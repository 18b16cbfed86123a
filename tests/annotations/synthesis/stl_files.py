"""Meshes of known shape, and STL files of them, for the tests."""

from pathlib import Path

import numpy as np
import trimesh

from annotations.geometry.meshes import Mesh


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
