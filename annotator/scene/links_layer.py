"""Lines between the keypoints of a link, in the link's colour, and the ray of a position that is proposed."""

from collections.abc import Mapping

import vtk

from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.volumes import Ray, clip_to_box
from annotator.scene.colors import RAY, rgb
from annotator.scene.segments import Segment, Segments


class LinksLayer:
    """The tool's links as far as their keypoints are placed."""

    def __init__(self) -> None:
        self._links = Segments(width_px=3)
        self._ray = Segments(width_px=1)

    @property
    def actors(self) -> tuple[vtk.vtkActor, ...]:
        """What is drawn."""
        return (self._links.actor, self._ray.actor)

    def show_links(
        self, tool: ToolSpecification | None, positions_um: Mapping[str, Vector], ratio: float
    ) -> None:
        """Draw the links of which both ends have a position."""
        self._links.show(
            (
                Segment(positions_um[link.base], positions_um[link.tip], rgb(link.color))
                for link in (tool.links if tool else ())
                if link.base in positions_um and link.tip in positions_um
            ),
            ratio,
        )

    def show_ray(self, ray: Ray | None, box_um: tuple[Vector, Vector] | None, ratio: float) -> None:
        """Draw a ray where it runs through a box."""
        span_um = clip_to_box(ray, *box_um) if ray and box_um else None
        if ray is None or span_um is None:
            self._ray.show((), ratio)
        else:
            self._ray.show([Segment(ray.at(span_um[0]), ray.at(span_um[1]), RAY)], ratio)
