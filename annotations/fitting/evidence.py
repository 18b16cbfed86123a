"""What a document says about a tool's pose: points fixed on its links, where they are seen, how surely."""

import math
from dataclasses import dataclass

import numpy as np

from annotations.documents.annotation import Annotation, BoxAnnotation, KeypointAnnotation, State
from annotations.geometry.box_conversion import CLICK_NOISE_UM
from annotations.geometry.frames import Vector, vector
from annotations.geometry.tool import Link, ToolSpecification

SIGMA_UM = CLICK_NOISE_UM
"""Standard deviation along each axis of a keypoint that is placed and sure."""

ROLL_SIGMA_DEG = 5.0
"""Standard deviation of a box's roll where its ends have `SIGMA_UM`. A round link looks the same at any roll,
and two clicks tell none: it is turned by eye until its hinge seems to suit the bend."""

_UNSURE_FACTOR = 3.0
_STATE_FACTORS: dict[State, float] = {"placed": 1.0, "occluded": 2.0, "out_of_view": 4.0}
"""How much less a position weighs that a person put where it cannot be seen: by reasoning from what can."""


@dataclass(frozen=True)
class BodyPoint:
    """A point fixed on a link, and where it is seen.

    Attributes
    ----------
    link : str
    local_um : (float, float, float)
        In the link's frame: its base at 0, x towards the tip, y and z across.
    position_um : (float, float, float)
        Where it is seen, in the volume's frame.
    sigma_um : float
        Standard deviation along each axis.
    keypoint : str
        The keypoint that it is; empty for a point that only shows how a box is turned about its own x.
    """

    link: str
    local_um: Vector
    position_um: Vector
    sigma_um: float = SIGMA_UM
    keypoint: str = ""


def document_points(
    document: Annotation, tool: ToolSpecification, sigma_um: float = SIGMA_UM
) -> tuple[BodyPoint, ...]:
    """Return the points that a document of either method gives, in its own order.

    A keypoint gives itself if it ends a link. A box gives its two ends, and a point on the side of its +y, so
    that roll and the hinge's sense count, for as much as `ROLL_SIGMA_DEG`. What was filled in from a fit, and
    no person placed since, is none.

    Parameters
    ----------
    sigma_um : float
        Standard deviation along each axis of what is placed and sure; three times that where it is unsure,
        and twice (occluded) or four times (out of view) that where it cannot be seen.
    """
    if document.method == "boxes":
        links = {link.name: link for link in tool.links}
        return tuple(
            point
            for part in document.boxes
            if part.link in links and _is_evidence(part)
            for point in _box_points(part, links[part.link], part_sigma_um(part, sigma_um))
        )
    points = []
    for part in document.keypoints:
        link = tool.link_of(part.name)
        if link is None or part.position_um is None or not _is_evidence(part):
            continue
        local_um = (0.0 if part.name == link.base else link.length_um, 0.0, 0.0)
        points.append(
            BodyPoint(link.name, local_um, part.position_um, part_sigma_um(part, sigma_um), part.name)
        )
    return tuple(points)


def part_sigma_um(part: KeypointAnnotation | BoxAnnotation, sigma_um: float = SIGMA_UM) -> float:
    """Return the standard deviation along each axis of a part that has a place, in µm.

    Parameters
    ----------
    sigma_um : float
        That of what is placed and sure; see `document_points` for the others.
    """
    return sigma_um * _STATE_FACTORS[part.state] * (_UNSURE_FACTOR if part.certainty == "unsure" else 1.0)


def _box_points(part: BoxAnnotation, link: Link, sigma_um: float) -> tuple[BodyPoint, ...]:
    box = part.box
    if box is None:
        return ()
    # The specification's width, so that a box drawn too wide pulls nothing to the side.
    half_width_um = link.cross_section_um[0] / 2
    beside_um = vector(np.asarray(box.center_um) + box.axes[:, 1] * half_width_um)
    # A thin link's side is seen no surer than its ends.
    roll_sigma_um = sigma_um / SIGMA_UM * half_width_um * math.radians(ROLL_SIGMA_DEG)
    return (
        BodyPoint(link.name, (0.0, 0.0, 0.0), box.base_um, sigma_um, link.base),
        BodyPoint(link.name, (link.length_um, 0.0, 0.0), box.tip_um, sigma_um, link.tip),
        BodyPoint(
            link.name, (link.length_um / 2, half_width_um, 0.0), beside_um, max(sigma_um, roll_sigma_um)
        ),
    )


def _is_evidence(part: KeypointAnnotation | BoxAnnotation) -> bool:
    return part.state == "placed" or (part.state != "unplaced" and part.source != "fitted")
