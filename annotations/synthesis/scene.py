"""A scene before the scanner: a posed tool, and the volume that the scanner makes of it, plane by plane."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.body import LinkBody, Surface, link_bodies, surface_from_above
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool import ToolSpecification
from annotations.synthesis.clutter import random_clutter
from annotations.synthesis.conditions import PLAIN_CONDITIONS, SceneConditions
from annotations.synthesis.grid import Grid
from annotations.synthesis.mesh_body import MeshBody
from annotations.synthesis.mesh_tool import MeshTool
from annotations.synthesis.out_of_view import moved_out_of_view
from annotations.synthesis.poses import random_pose
from annotations.synthesis.scanner import Scanner

_POSE, _SPECKLE, _SAMPLED, _SCANNER, _VIEW, _CLUTTER = range(6)
"""Branches of a scene's seed, so that neither depends on how many numbers the other has used."""


@dataclass(frozen=True)
class SceneSeed:
    """Where a scene's random choices come from: the number of its series, and its own in that."""

    series: int
    scene: int = 0

    def sequence(self, *branch: int) -> np.random.SeedSequence:
        """Return the seed of one branch of the choices."""
        return np.random.SeedSequence(self.series, spawn_key=(self.scene, *branch))


@dataclass(frozen=True)
class Scene:
    """A posed tool before a scanner, and what else lies there.

    Attributes
    ----------
    tool : ToolSpecification
    pose : ToolPose
    seed : SceneSeed
        Of the speckle. Each plane has its own branch: it looks the same whichever others are made.
    grid : Grid
    scanner : Scanner
    clutter : tuple of LinkBody
        Other bodies than the tool's.
    mesh : MeshTool or None
        The tool's body, instead of that of its specification.
    """

    tool: ToolSpecification
    pose: ToolPose
    seed: SceneSeed
    grid: Grid = field(default_factory=Grid)
    scanner: Scanner = field(default_factory=Scanner)
    clutter: tuple[LinkBody, ...] = ()
    mesh: MeshTool | None = None

    @cached_property
    def bodies(self) -> dict[str, LinkBody | MeshBody]:
        """The bodies of the tool: each by its link's name, or a mesh of all by the tool's."""
        if self.mesh is None:
            return dict(link_bodies(self.pose, self.tool))
        return dict(self.mesh.bodies(self.pose))

    @cached_property
    def surface(self) -> Surface:
        """What the light meets first in each column; of shape (nx, ny)."""
        return self.surface_at(self.grid.axis_um(0), self.grid.axis_um(1))

    def surface_at(self, x_um: NDArray[np.float64], y_um: NDArray[np.float64]) -> Surface:
        """Return what the light meets first in the columns at x and y in µm; see `surface_from_above`."""
        return surface_from_above((*self.bodies.values(), *self.clutter), x_um, y_um)

    def plane(self, index: int) -> NDArray[np.uint8]:
        """Return the grey values of the voxels with one index along axis 0, shape (ny, nz)."""
        bits = self._random_bits(self.grid.shape[1:], _SPECKLE, index)
        return self.scanner.image(self.surface[index], self.grid, bits)

    def planes(self) -> Iterator[NDArray[np.uint8]]:
        """Yield the planes along axis 0 in their order; the whole volume is never in memory."""
        for index in range(self.grid.shape[0]):
            yield self.plane(index)

    def sampled_bits(self, shape: tuple[int, int]) -> NDArray[np.uint16]:
        """Return the random bits of what a network sees, any shape, other than those of the planes."""
        return self._random_bits(shape, _SAMPLED)

    def _random_bits(self, shape: tuple[int, int], *branch: int) -> NDArray[np.uint16]:
        count = shape[0] * shape[1]
        # The raw stream of a bit generator is the one that NumPy promises never to change.
        raw = np.random.SFC64(self.seed.sequence(*branch)).random_raw((count + 3) // 4)
        return np.asarray(raw.view(np.uint16)[:count].reshape(shape))


def random_scene(
    tool: ToolSpecification,
    seed: SceneSeed,
    grid: Grid | None = None,
    scanner: Scanner | None = None,
    conditions: SceneConditions = PLAIN_CONDITIONS,
    mesh: MeshTool | None = None,
) -> Scene:
    """Return a scene with the tool in a random legal pose.

    It depends on the seed, the conditions and the workspace alone: grids of different fineness show the same
    scene.

    Parameters
    ----------
    tool : ToolSpecification
    seed : SceneSeed
    grid : Grid, optional
        The full volume's by default.
    scanner : Scanner, optional
        Where the conditions leave it as it is.
    conditions : SceneConditions
        What else is random; by default nothing is.
    mesh : MeshTool, optional
        The tool's body, instead of that of its specification.

    Raises
    ------
    UserError
        The tool has no links, does not fit into the workspace, or a mesh of it cannot be used.
    """
    workspace = Grid()
    scanner = conditions.random_scanner(scanner or Scanner(), _generator(seed, _SCANNER))
    pose = random_pose(
        tool,
        _generator(seed, _POSE),
        workspace.extent_um,
        scanner.signal_end_um,
        conditions.largest_tilt_deg,
        mesh,
    )
    rng = _generator(seed, _VIEW)
    if rng.random() < conditions.out_of_view_probability:
        share = rng.uniform(0, conditions.largest_out_of_view_share)
        pose = moved_out_of_view(pose, tool, workspace, share, heading_deg=rng.uniform(0, 360))
    rng = _generator(seed, _CLUTTER)
    count = int(rng.integers(*conditions.clutter, endpoint=True))
    clutter = random_clutter(
        rng, link_bodies(pose, tool).values(), count, conditions.clutter_size_um, workspace.extent_um
    )
    return Scene(tool, pose, seed, grid or workspace, scanner, clutter, mesh)


def _generator(seed: SceneSeed, branch: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64(seed.sequence(branch)))
