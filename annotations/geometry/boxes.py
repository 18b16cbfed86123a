"""Oriented boxes on links: own +x runs along the link towards the tip, +y is the hinge's axis, +z = x × y."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry import rotations
from annotations.geometry.frames import Vector, vector
from annotations.geometry.tool import ToolSpecification


@dataclass(frozen=True)
class Box:
    """A box in the volume's frame.

    Attributes
    ----------
    center_um : (float, float, float)
    size_um : (float, float, float)
        Length, width and height along its own x, y and z.
    rotation_wxyz : (float, float, float, float)
        Unit quaternion, w ≥ 0.
    """

    center_um: Vector
    size_um: Vector
    rotation_wxyz: rotations.Quaternion

    @property
    def axes(self) -> NDArray[np.float64]:
        """The (3, 3) matrix whose columns are its own axes."""
        return rotations.matrix(self.rotation_wxyz)

    @property
    def base_um(self) -> Vector:
        """Centre of the −x face: the keypoint at the link's base."""
        return self.position_um((-0.5, 0.0, 0.0))

    @property
    def tip_um(self) -> Vector:
        """Centre of the +x face: the keypoint at the link's tip."""
        return self.position_um((0.5, 0.0, 0.0))

    def position_um(self, share: ArrayLike) -> Vector:
        """Return a position given in shares of its size from the centre, along its own axes, shape (3,)."""
        offset_um = np.asarray(share, dtype=np.float64) * np.asarray(self.size_um)
        return vector(np.asarray(self.center_um) + self.axes @ offset_um)

    def contains(self, position_um: ArrayLike) -> bool:
        """Say whether a position in µm, shape (3,), lies in the box or on its surface."""
        local_um = (np.asarray(position_um, dtype=np.float64) - self.center_um) @ self.axes
        return bool(np.all(np.abs(local_um) <= np.asarray(self.size_um) / 2))

    @property
    def turned_over(self) -> "Box":
        """The same body turned 180° about its own x: the hinge's axis has the other sense."""
        half_turn = (0.0, 1.0, 0.0, 0.0)
        return replace(self, rotation_wxyz=rotations.product(self.rotation_wxyz, half_turn))


def box_between(
    base_um: ArrayLike, tip_um: ArrayLike, cross_section_um: tuple[float, float], hinge_axis: ArrayLike
) -> Box:
    """Return the box between the two ends of a link's axis, with its own +y as near to a hinge as can be.

    Parameters
    ----------
    base_um, tip_um : (3,)
        Centres of its −x and +x faces.
    cross_section_um : (float, float)
        Width and height along its own y and z.
    hinge_axis : (3,)
        Of any length; the part of it across the link's axis gives +y.

    Raises
    ------
    ValueError
        The ends are at one place, or the hinge runs along the link.
    """
    base, tip = np.asarray(base_um, dtype=np.float64), np.asarray(tip_um, dtype=np.float64)
    length_um = math.hypot(*(tip - base))
    if not length_um:
        raise ValueError("a box needs two ends that are not at one place")
    along = (tip - base) / length_um
    hinge = np.asarray(hinge_axis, dtype=np.float64)
    across = hinge - (hinge @ along) * along
    if math.hypot(*across) <= 1e-9 * math.hypot(*hinge):
        raise ValueError("a box needs a hinge that does not run along it")
    across /= math.hypot(*across)
    rotation = rotations.from_matrix(np.column_stack([along, across, np.cross(along, across)]))
    return Box(vector((base + tip) / 2), (length_um, *cross_section_um), rotation)


def box_keypoints_um(boxes: Mapping[str, Box], tool: ToolSpecification) -> dict[str, Vector]:
    """Return the keypoints at the ends of boxes, given by link; one of two links is the first link's."""
    positions_um: dict[str, Vector] = {}
    for link in tool.links:
        if link.name in boxes:
            positions_um.setdefault(link.base, boxes[link.name].base_um)
            positions_um.setdefault(link.tip, boxes[link.name].tip_um)
    return {name: positions_um[name] for name in tool.keypoint_names if name in positions_um}


def box_ends_um(
    centers_um: NDArray[np.float64], lengths_um: NDArray[np.float64], rotations_wxyz: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return `Box.base_um` and `Box.tip_um` of many boxes, each (…, 3) in µm; NaN stays NaN.

    Parameters
    ----------
    centers_um : (…, 3) array of float64
    lengths_um : (…) array of float64
        Sizes along their own x.
    rotations_wxyz : (…, 4) array of float64
        Unit quaternions.
    """
    half_um = rotations.matrices(rotations_wxyz)[..., 0] * (lengths_um[..., np.newaxis] / 2)
    return centers_um - half_um, centers_um + half_um


def hinge_axes(boxes: Mapping[str, Box], tool: ToolSpecification) -> dict[str, Vector]:
    """Return the unit vector of each joint's hinge in the volume's frame, where its parent has a box.

    The specification names the hinge in the parent's own frame, so the parent's box carries it; for the
    published tool these are the own +y axes of links 0 and 1.
    """
    return {
        joint.name: vector(boxes[joint.parent].axes @ np.asarray(joint.hinge_axis))
        for joint in tool.joints
        if joint.parent in boxes
    }
