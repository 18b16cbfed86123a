"""Masks of synthetic volumes: which voxels belong to which link of the tool, streamed to disk by planes."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from annotations.errors import UserError
from annotations.geometry.body import LinkBody, link_bodies
from annotations.synthesis.mesh_body import MeshBody
from annotations.synthesis.occupancy import Axes, body_occupancy, occupancy, positions_um
from annotations.synthesis.scene import Scene
from annotations.synthesis.volume_file import write_planes

_MOST_LINKS = 255
"""As many as a mask of uint8 can tell apart."""


def write_mask(
    scene: Scene,
    path: Path,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> None:
    """Write which voxels of a scene's volume belong to which link, as a ``.npy`` file like the volume's.

    Parameters
    ----------
    scene : Scene
    path, progress, cancelled
        As in `write_volume`, which raises the same errors.

    Raises
    ------
    UserError
        The tool has more links than a mask can tell apart.
    """
    write_planes(mask_planes(scene), scene.grid.shape, path, progress, cancelled)


def mask_planes(scene: Scene) -> Iterator[NDArray[np.uint8]]:
    """Yield a mask's planes along axis 0 in their order, shape (ny, nz) each.

    0 is no link, 1 the first of the tool's specification, and so on. A voxel in several links belongs to the
    first of them. A mesh of the whole tool does not say which link is where: each of its voxels belongs to
    the link whose body, as the specification describes it, is nearest. Clutter is no part of the tool.

    Raises
    ------
    UserError
        As by `write_mask`.
    """
    parts = _parts(scene)
    for index in range(scene.grid.shape[0]):
        plane = np.zeros(scene.grid.shape[1:], dtype=np.uint8)
        # The last first, so that the first has the last word.
        for part in reversed(parts):
            part.mark(plane, index)
        yield plane


class _Part:
    """A body of the tool, before the voxels that it can reach.

    Parameters
    ----------
    body : LinkBody or MeshBody
    links : dict of int to LinkBody
        Those that its voxels can belong to, by their numbers.
    axes_um : (ndarray, ndarray, ndarray)
        Of the whole volume.
    """

    def __init__(self, body: LinkBody | MeshBody, links: dict[int, LinkBody], axes_um: Axes) -> None:
        self._body = body
        self._links = links
        low, high = body.bounds_um()
        starts = [np.searchsorted(axis, end, side="left") for axis, end in zip(axes_um, low, strict=True)]
        stops = [np.searchsorted(axis, end, side="right") for axis, end in zip(axes_um, high, strict=True)]
        x, y, z = (slice(int(start), int(stop)) for start, stop in zip(starts, stops, strict=True))
        self._planes = range(x.start, x.stop)
        self._block = y, z
        self._axes_um = axes_um[0], axes_um[1][y], axes_um[2][z]

    def mark(self, plane: NDArray[np.uint8], index: int) -> None:
        """Write the numbers of links into the plane with an index along axis 0, shape (ny, nz)."""
        if index not in self._planes:
            return
        x_um, y_um, z_um = self._axes_um
        axes_um = x_um[index : index + 1], y_um, z_um
        if isinstance(self._body, MeshBody):
            inside = occupancy(self._body.mesh, axes_um)
        else:
            inside = body_occupancy(self._body, axes_um)
        plane[self._block][inside[0]] = self._numbers(axes_um, inside)

    def _numbers(self, axes_um: Axes, inside: NDArray[np.bool_]) -> NDArray[np.uint8]:
        """Return the numbers of the links that voxels belong to, (n,), or that of the only one, (1,)."""
        numbers = np.array(list(self._links), dtype=np.uint8)
        if len(numbers) == 1:
            return numbers
        places_um = positions_um(axes_um, inside)
        distances_um = [body.distance_um(places_um) for body in self._links.values()]
        return np.asarray(numbers[np.argmin(distances_um, axis=0)])


def _parts(scene: Scene) -> list[_Part]:
    """Return the tool's bodies in the order of their links in the specification."""
    tool, pose = scene.tool, scene.pose
    if len(tool.links) > _MOST_LINKS:
        raise UserError(
            f"the tool {tool.name!r} has {len(tool.links)} links, and a mask tells {_MOST_LINKS} apart",
            remedy="Make the volumes without masks",
        )
    axes_um = scene.grid.axis_um(0), scene.grid.axis_um(1), scene.grid.axis_um(2)
    bodies = scene.bodies
    described = link_bodies(pose if scene.mesh is None else scene.mesh.nearest_pose(pose), tool)
    numbered = {
        number: link.name for number, link in enumerate(tool.links, start=1) if link.name in described
    }
    if bodies.keys() != described.keys():
        links = {number: described[name] for number, name in numbered.items()}
        return [_Part(body, links, axes_um) for body in bodies.values()]
    return [_Part(bodies[name], {number: described[name]}, axes_um) for number, name in numbered.items()]
