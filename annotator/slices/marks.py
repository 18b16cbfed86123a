"""Keypoints as a slice shows them: where, and how far from the plane. No painting here."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from annotator.session import Session
from annotator.session.editing.keypoint_marks import KeypointMark, keypoint_marks
from annotator.slices.viewport import Viewport

# A keypoint farther from the plane than this is only hinted at, and the mouse does not meet it.
NEAR_UM = 400.0
RADIUS_PX = 6.0
SMALLEST_RADIUS_PX = 3.5


@dataclass(frozen=True, kw_only=True)
class Mark(KeypointMark):
    """A keypoint on a slice.

    Attributes
    ----------
    x, y : float
        Its projection onto the plane, in pixels of the widget.
    distance_um : float
        From the plane, signed along the plane's axis.
    nearness : float
        1 for a keypoint whose nearest plane this is, falling to 0 at `NEAR_UM` and beyond.
    origin_px : (float, float) or None
        Where the document has a keypoint that is on its way.
    """

    x: float
    y: float
    distance_um: float
    nearness: float
    origin_px: tuple[float, float] | None = None

    @property
    def is_near(self) -> bool:
        """Whether it is drawn as lying on or near the plane."""
        return self.nearness > 0

    @property
    def is_on_plane(self) -> bool:
        """Whether this is the plane nearest to it."""
        return self.nearness == 1

    @property
    def radius_px(self) -> float:
        """How large it is drawn."""
        return SMALLEST_RADIUS_PX + (RADIUS_PX - SMALLEST_RADIUS_PX) * self.nearness


def nearness(distance_um: float, half_spacing_um: float) -> float:
    """Return 1 within half a voxel of a plane, then less, and 0 from `NEAR_UM` on."""
    beyond = abs(distance_um) - half_spacing_um * (1 + 1e-9)
    if beyond <= 0:
        return 1.0
    return max(0.0, 1 - beyond / max(NEAR_UM - half_spacing_um, 1e-9))


def marks(session: Session, viewport: Viewport, index: int) -> tuple[Mark, ...]:
    """Return the keypoints that have a position, the preview among them, on the plane with an index."""
    document, plane = session.document, viewport.plane
    if document is None:
        return ()
    made = []
    stored_um = document.positions_um
    for keypoint in keypoint_marks(session.shown_document, session.tool, session.view):
        distance_um = plane.distance_um(keypoint.position_um, index)
        x, y = viewport.pixel(keypoint.position_um)
        origin_um = stored_um.get(keypoint.name) if keypoint.preview else None
        made.append(
            Mark(
                **vars(keypoint),
                x=x,
                y=y,
                distance_um=distance_um,
                nearness=nearness(distance_um, plane.spacing_um[plane.axis] / 2),
                origin_px=viewport.pixel(origin_um) if origin_um else None,
            )
        )
    return tuple(made)


def mark_under(shown: Iterable[Mark], x: float, y: float, radius_px: float) -> Mark | None:
    """Return the nearest mark within a radius of a pixel, among those on or near the plane.

    Of several at the same place it is the one nearest to the plane.
    """
    reachable = [
        (math.hypot(mark.x - x, mark.y - y), abs(mark.distance_um), mark) for mark in shown if mark.is_near
    ]
    within = [entry for entry in reachable if entry[0] <= radius_px]
    return min(within, key=lambda entry: entry[:2])[2] if within else None
