"""How a volume is looked at when it has just been opened."""

from dataclasses import replace
from typing import Any

from annotations.geometry.frames import vector
from annotator.session.viewing.view import View
from annotator.session.volumes.opening import Opened

_NOTHING_ON_ITS_WAY: dict[str, Any] = {
    "preview": None,
    "draft": None,
    "first_end_um": None,
    "free_links": frozenset(),
    "pose": None,
    "refinement": None,
}


def first_view(before: View, opened: Opened) -> View:
    """Return the first view of a volume: its middle, and what of the view before it still makes sense.

    Nothing of how this volume was looked at earlier is in it: in blind work it may be met again.
    """
    parts = opened.document.parts
    unplaced = (part.name for part in parts if part.state == "unplaced")
    shape = opened.found.volume.shape
    middle_um = vector([(size - 1) // 2 * step for size, step in zip(shape, opened.spacing_um, strict=True)])
    return replace(
        before,
        crosshair_um=middle_um,
        active_part=next(unplaced, parts[0].name if parts else None),
        # A tool that cannot be posed leaves pose mode, in which the last volume may have been.
        mode=before.mode if opened.found.tool.links or before.mode != "pose" else "navigate",
        window=opened.window,
        opacity_threshold=opened.opacity_threshold,
        cropping_um=None,
        detail=False,
        **_NOTHING_ON_ITS_WAY,
    )


def nothing_open(before: View) -> View:
    """Return the view once the volume is closed."""
    return replace(before, active_part=None, cropping_um=None, **_NOTHING_ON_ITS_WAY)
