"""A scene before the scanner: a posed tool, and the volume that the scanner makes of it, plane by plane."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.body import LinkBody, Surface, link_bodies, surface_from_above
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool import ToolSpecification
from annotations.synthesis.grid import Grid
from annotations.synthesis.poses import random_pose
from annotations.synthesis.scanner import Scanner

_POSE, _SPECKLE, _SAMPLED = 0, 1, 2
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
    """A posed tool before a scanner.

    Attributes
    ----------
    tool : ToolSpecification
    pose : ToolPose
    seed : SceneSeed
        Of the speckle. Each plane has its own branch: it looks the same whichever others are made.
    grid : Grid
    scanner : Scanner
    """

    tool: ToolSpecification
    pose: ToolPose
    seed: SceneSeed
    grid: Grid = field(default_factory=Grid)
    scanner: Scanner = field(default_factory=Scanner)

    @cached_property
    def bodies(self) -> dict[str, LinkBody]:
        """The body of each link, by the link's name."""
        return link_bodies(self.pose, self.tool)

    @cached_property
    def surface(self) -> Surface:
        """What the light meets first in each column; of shape (nx, ny)."""
        return surface_from_above(self.bodies.values(), self.grid.axis_um(0), self.grid.axis_um(1))

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
    tool: ToolSpecification, seed: SceneSeed, grid: Grid | None = None, scanner: Scanner | None = None
) -> Scene:
    """Return a scene with the tool in a random legal pose.

    The pose depends on the seed and the workspace alone: grids of different fineness show the same scene.

    Raises
    ------
    UserError
        The tool has no links, or does not fit into the workspace.
    """
    scanner = scanner or Scanner()
    rng = np.random.Generator(np.random.SFC64(seed.sequence(_POSE)))
    pose = random_pose(tool, rng, Grid().extent_um, scanner.signal_end_um)
    return Scene(tool, pose, seed, grid or Grid(), scanner)
