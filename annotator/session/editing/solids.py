"""The bodies that are drawn into the volume, from the document, the fit and the view: no painting."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, link_boxes
from annotations.geometry.meshes import Mesh, box_mesh
from annotations.geometry.tool import ToolSpecification
from annotations.volumes import Ray

SolidKind = Literal["box", "ghost", "proposal", "prediction"]
"""A box of the document; the fitted or posed tool; the tool as a refinement proposes it; as predicted."""


@dataclass(frozen=True)
class Solid:
    """A translucent body on a link.

    Attributes
    ----------
    link : str
    kind : str
        See `SolidKind`.
    box : Box
    is_round : bool
        Whether the body is a cylinder; an annotated box never is.
    color : str
        ``#rrggbb``, the link's.
    active : bool
        Whether it is the box that keys and handles act on.
    unsure : bool
        Whether the annotator is not sure of it.
    """

    link: str
    kind: SolidKind
    box: Box
    is_round: bool
    color: str
    active: bool = False
    unsure: bool = False

    @property
    def mesh(self) -> Mesh:
        """Its surface in µm."""
        return _mesh(self.box, self.is_round)


def posed_solids(pose: ToolPose, tool: ToolSpecification, kind: SolidKind) -> tuple[Solid, ...]:
    """Return the bodies of a tool in a pose."""
    return tuple(
        Solid(name, kind, box, tool.link(name).is_round, tool.link(name).color)
        for name, box in link_boxes(pose, tool).items()
    )


def solid_on_ray(solids: Iterable[Solid], ray: Ray) -> tuple[Solid, Vector] | None:
    """Return the first body that a ray meets, and where in µm; None where it meets none."""
    met = [
        (distance_um, solid)
        for solid in solids
        if (distance_um := solid.mesh.first_hit_um(ray.origin_um, ray.direction)) is not None
    ]
    if not met:
        return None
    distance_um, solid = min(met, key=lambda each: each[0])
    return solid, vector(ray.at(distance_um))


def solid_around(solids: Iterable[Solid], position_um: Vector) -> Solid | None:
    """Return the body whose box is around a position, the one with the nearest centre of several."""
    around = [solid for solid in solids if solid.box.contains(position_um)]
    return min(around, key=lambda solid: math.dist(solid.box.center_um, position_um), default=None)


@lru_cache(maxsize=64)
def _mesh(box: Box, is_round: bool) -> Mesh:
    return box_mesh(box, is_round=is_round)
