"""A tool whose body are meshes: one for each link, or one for each way its joints can stand.

A folder of meshes, as `read_mesh_tool` reads it, holds files of one of two kinds:

- ``<link>.stl`` for every link, in the link's own frame: its base is the origin, +x runs to its tip.
- ``<joint>_<degrees>`` for every joint, in the specification's order and joined by ``_``, such as
  ``theta1_-30_theta2_45.stl``: the whole tool with its joints so, in the frame of the root link. Any number
  of such files will do; other angles than theirs do not occur.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from annotations.geometry.kinematics import ToolPose, link_frames
from annotations.geometry.tool import ToolSpecification
from annotations.synthesis.mesh_body import MeshBody, MeshShape
from annotations.synthesis.mesh_file import MeshError, ReadMesh, read_mesh

UM_PER_MM = 1000.0

_MOST_KEPT = 4_000_000
"""Triangles that are kept of the meshes that were read last: some 150 MB."""
_LIKELY = 10
"""A mesh that is larger or smaller than this times the length it should have was read in a wrong unit."""
_NUMBER = r"([+-]?\d+(?:\.\d+)?)"


class MeshTool(ABC):
    """Meshes as the body of a tool.

    Attributes
    ----------
    tool : ToolSpecification
    um_per_unit : float
        How many µm one unit of the files is.
    repairs : dict of Path to tuple of str
        Of each file read so far that had to be mended: what was done.
    sha256 : dict of Path to str
        Of each file read so far: its content's, as hexadecimal digits.
    """

    def __init__(self, tool: ToolSpecification, um_per_unit: float) -> None:
        self.tool = tool
        self.repairs: dict[Path, tuple[str, ...]] = {}
        self.sha256: dict[Path, str] = {}
        self.um_per_unit = um_per_unit

    @staticmethod
    def per_link(tool: ToolSpecification, files: Mapping[str, Path], um_per_unit: float) -> "MeshTool":
        """Return a tool with a mesh for each link, posed by the forward kinematics.

        Parameters
        ----------
        tool : ToolSpecification
        files : mapping of str to Path
            The STL file of every link, by the link's name, in the link's own frame.
        um_per_unit : float
            How many µm one unit of the files is.

        Raises
        ------
        MeshError
            A link has no file, or one of the files cannot be used.
        """
        return _LinkMeshes(tool, files, um_per_unit)

    @staticmethod
    def per_configuration(tool: ToolSpecification, folder: Path, um_per_unit: float) -> "MeshTool":
        """Return a tool with a mesh for each way its joints can stand; each is read when it is needed.

        Parameters
        ----------
        tool : ToolSpecification
        folder : Path
            Its STL files are named by the joints' angles and are in the frame of the root link.
        um_per_unit : float
            How many µm one unit of the files is.

        Raises
        ------
        MeshError
            The folder cannot be read, a file's name says no angles, two files are for the same ones, or no
            file is for angles within the joints' limits.
        """
        return _ConfigurationMeshes(tool, folder, um_per_unit)

    @abstractmethod
    def bodies(self, pose: ToolPose) -> dict[str, MeshBody]:
        """Return the bodies of the posed tool: each by its link's name, or the whole one by the tool's.

        A mesh for each configuration shows the pose with the angles of `nearest_pose`.

        Raises
        ------
        MeshError
            A mesh that was not read before cannot be used.
        """

    @abstractmethod
    def angles_deg(self, rng: np.random.Generator) -> dict[str, float]:
        """Return random angles of the joints within their limits, any that there are as likely as others."""

    @abstractmethod
    def nearest_pose(self, pose: ToolPose) -> ToolPose:
        """Return the pose with the nearest angles that there are: the one that is true of `bodies`."""

    def _read(self, path: Path, expected_um: float) -> MeshShape:
        found: ReadMesh = read_mesh(path, self.um_per_unit)
        size_um = float(np.linalg.norm(np.ptp(found.mesh.vertices_um, axis=0)))
        if not expected_um / _LIKELY < size_um < expected_um * _LIKELY:
            raise MeshError(
                f"at {self.um_per_unit:g} µm a unit its mesh measures {size_um / UM_PER_MM:.3g} mm, where "
                f"the tool {self.tool.name!r} has {expected_um / UM_PER_MM:.3g} mm",
                where=path,
                remedy="Say how many µm a unit of the file is, or choose the mesh's own tool",
            )
        self.sha256[path] = found.sha256
        if found.repairs:
            self.repairs[path] = found.repairs
        return MeshShape(found.mesh)


class _LinkMeshes(MeshTool):
    def __init__(self, tool: ToolSpecification, files: Mapping[str, Path], um_per_unit: float) -> None:
        super().__init__(tool, um_per_unit)
        lacking = [link.name for link in tool.links if link.name not in files]
        if lacking:
            raise MeshError(
                f"the tool {tool.name!r} has no mesh for {', '.join(lacking)}",
                remedy="Give one STL file for each link",
            )
        self._shapes = {link.name: self._read(files[link.name], link.length_um) for link in tool.links}

    def bodies(self, pose: ToolPose) -> dict[str, MeshBody]:
        return {
            name: MeshBody(self._shapes[name], frame) for name, frame in link_frames(pose, self.tool).items()
        }

    def angles_deg(self, rng: np.random.Generator) -> dict[str, float]:
        return {joint.name: float(rng.uniform(*joint.limits_deg)) for joint in self.tool.joints}

    def nearest_pose(self, pose: ToolPose) -> ToolPose:
        return pose


class _ConfigurationMeshes(MeshTool):
    def __init__(self, tool: ToolSpecification, folder: Path, um_per_unit: float) -> None:
        super().__init__(tool, um_per_unit)
        if not tool.joints:
            raise MeshError(
                f"the tool {tool.name!r} has no joints",
                where=folder,
                remedy="Give one STL file for each link",
            )
        limits_deg = np.array([joint.limits_deg for joint in tool.joints])
        configurations = sorted(_configurations(tool, folder).items())
        angles_deg = np.array([angles for angles, _ in configurations]).reshape(-1, len(tool.joints))
        legal = np.all((angles_deg >= limits_deg[:, 0]) & (angles_deg <= limits_deg[:, 1]), axis=1)
        if not legal.any():
            raise MeshError(
                f"it has no mesh of the tool {tool.name!r} with its joints within their limits",
                where=folder,
                remedy=f"Name files by the joints' angles, such as {_file_name(tool)}",
            )
        self._angles_deg = angles_deg[legal]
        self._paths = [path for (_, path), kept in zip(configurations, legal, strict=True) if kept]
        self._kept: dict[int, MeshShape] = {}
        self._length_um = sum(link.length_um for link in tool.links)

    def bodies(self, pose: ToolPose) -> dict[str, MeshBody]:
        root = self.tool.root
        if root is None:
            return {}
        frame = link_frames(pose, self.tool)[root.name]
        return {self.tool.name: MeshBody(self._shape(self._nearest(pose)), frame)}

    def angles_deg(self, rng: np.random.Generator) -> dict[str, float]:
        return self._named(int(rng.integers(len(self._paths))))

    def nearest_pose(self, pose: ToolPose) -> ToolPose:
        return replace(pose, angles_deg=self._named(self._nearest(pose)))

    def _named(self, index: int) -> dict[str, float]:
        values = self._angles_deg[index].tolist()
        return {joint.name: angle for joint, angle in zip(self.tool.joints, values, strict=True)}

    def _nearest(self, pose: ToolPose) -> int:
        wanted = [pose.angles_deg.get(joint.name, 0.0) for joint in self.tool.joints]
        return int(np.square(self._angles_deg - wanted).sum(axis=1).argmin())

    def _shape(self, index: int) -> MeshShape:
        shape = self._kept.pop(index, None)
        if shape is None:
            shape = self._read(self._paths[index], self._length_um)
        # Last in the order, and so the last to be given up.
        self._kept[index] = shape
        while len(self._kept) > 1 and self._triangles_kept() > _MOST_KEPT:
            del self._kept[next(iter(self._kept))]
        return shape

    def _triangles_kept(self) -> int:
        return sum(len(shape.mesh.triangles) for shape in self._kept.values())


def read_mesh_tool(tool: ToolSpecification, folder: Path, um_per_unit: float) -> MeshTool:
    """Return the tool with the meshes of a folder: one for each link, or one for each configuration.

    Parameters
    ----------
    tool : ToolSpecification
    folder : Path
        Its STL files are all named by links, or all by the joints' angles; see this module.
    um_per_unit : float
        How many µm one unit of the files is.

    Raises
    ------
    MeshError
        As by `MeshTool.per_link` and `MeshTool.per_configuration`.
    """
    files = {path.stem: path for path in _stl_files(folder)}
    links = {link.name for link in tool.links}
    if not links & files.keys() and tool.joints:
        return MeshTool.per_configuration(tool, folder, um_per_unit)
    if unknown := sorted(files.keys() - links):
        raise MeshError(
            f"the tool {tool.name!r} has no link of that name; its links are {', '.join(sorted(links))}",
            where=files[unknown[0]],
            remedy="Name the file by its link, or move it away",
        )
    return MeshTool.per_link(tool, files, um_per_unit)


def _configurations(tool: ToolSpecification, folder: Path) -> dict[tuple[float, ...], Path]:
    """Return the files of a folder by the angles in degrees that their names say, one for each joint."""
    pattern = re.compile("_".join(f"{re.escape(joint.name)}_{_NUMBER}" for joint in tool.joints))
    found: dict[tuple[float, ...], Path] = {}
    for path in _stl_files(folder):
        match = pattern.fullmatch(path.stem)
        if match is None:
            raise MeshError(
                f"its name does not say how the joints of the tool {tool.name!r} stand",
                where=path,
                remedy=f"Name it by their angles in degrees, such as {_file_name(tool)}, or move it away",
            )
        angles_deg = tuple(float(value) for value in match.groups())
        if angles_deg in found:
            raise MeshError(
                f"it stands for the same angles as {found[angles_deg].name}",
                where=path,
                remedy="Move one of the two away",
            )
        found[angles_deg] = path
    return found


def _stl_files(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if path.suffix.lower() == ".stl")
    except OSError as error:
        raise MeshError(
            f"it could not be read ({error.strerror or error})",
            where=folder,
            remedy="Name a folder of STL files",
        ) from error


def _file_name(tool: ToolSpecification) -> str:
    """Return an example of a configuration's file name."""
    return "_".join(f"{joint.name}_{joint.limits_deg[1]:g}" for joint in tool.joints) + ".stl"
