"""What is looked at, and how: frozen, announced like the document, never undone, never saved with it."""

from dataclasses import dataclass, field
from typing import Literal

from annotations.documents.annotation import Source
from annotations.geometry.frames import Vector
from annotations.volumes import Ray

Mode = Literal["navigate", "place"]
Rendering = Literal["volume", "mip"]
Pane = Literal["scene", "slice0", "slice1", "slice2"]
Preset = Literal["+x", "-x", "+y", "-y", "+z", "-z", "home"]
"""Directions of the scene's camera, in the order of their keys."""

Layer = Literal["volume", "planes", "axes", "scale_bar", "names", "links", "crosshair"]

ALL_LAYERS: frozenset[Layer] = frozenset(
    ("volume", "planes", "axes", "scale_bar", "names", "links", "crosshair")
)


@dataclass(frozen=True)
class Preview:
    """A keypoint on its way, not yet in the document: dragged, or clicked in the scene but not kept.

    Attributes
    ----------
    keypoint : str
    position_um : (float, float, float)
    source : str
        What the document will say when the preview is kept.
    ray : Ray or None
        The ray of the click in the scene that proposed it; a second ray from another angle settles its depth.
    """

    keypoint: str
    position_um: Vector
    source: Source
    ray: Ray | None = None


@dataclass(frozen=True)
class View:
    """How the open volume is looked at.

    Attributes
    ----------
    crosshair_um : (float, float, float)
        Where the three slices meet, µm in the volume's frame.
    active_keypoint : str or None
        What the next placing click places.
    mode : str
        ``navigate``: no click moves an annotation. ``place``: a click places the active keypoint.
    preview : Preview or None
        Drawn in place of the keypoint's position in the document.
    window : (float, float)
        Intensities drawn darkest and brightest.
    opacity_threshold : float
        Intensity below which the rendered volume is transparent, and at which a ray meets the surface.
    colormap : str
        One of `annotator.looks.colormaps.COLORMAPS`.
    cropping_um : ((float, float, float), (float, float, float)) or None
        Lowest and highest corner of the part that the scene shows.
    detail : bool
        Whether the scene shows the full resolution around the active keypoint instead of the whole volume.
    maximized : str or None
        The pane that fills the window; None shows all four.
    layers : frozenset of str
        What is drawn besides the keypoints.
    overlays_hidden : bool
        While the key that hides all overlays is held.
    """

    crosshair_um: Vector = (0.0, 0.0, 0.0)
    active_keypoint: str | None = None
    mode: Mode = "navigate"
    preview: Preview | None = None
    window: tuple[float, float] = (0.0, 255.0)
    opacity_threshold: float = 0.0
    rendering: Rendering = "volume"
    colormap: str = "gray"
    cropping_um: tuple[Vector, Vector] | None = None
    detail: bool = False
    maximized: Pane | None = None
    layers: frozenset[Layer] = field(default=ALL_LAYERS)
    overlays_hidden: bool = False
