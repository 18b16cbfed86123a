"""What is looked at, and how: frozen, announced like the document, never undone, never saved with it."""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, get_args

from annotations.documents.annotation import Annotation, Source
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose
from annotations.volumes import Ray

if TYPE_CHECKING:
    from annotations.fitting.refine import Refinement

Mode = Literal["navigate", "place", "pose"]
Rendering = Literal["volume", "mip"]
Pane = Literal["scene", "slice0", "slice1", "slice2"]
Preset = Literal["+x", "-x", "+y", "-y", "+z", "-z", "home"]
"""Directions of the scene's camera, in the order of their keys."""

Layer = Literal[
    "volume",
    "planes",
    "axes",
    "scale_bar",
    "names",
    "links",
    "ghost",
    "crosshair",
    "others",
    "prediction",
    "truth",
    "errors",
    "distances",
    "predicted_tool",
    "heatmaps",
]
"""Of a prediction all is hidden without ``prediction``."""

FIRST_LAYERS: frozenset[Layer] = frozenset(get_args(Layer)) - {"others", "prediction", "heatmaps"}
"""Shown at first: not others' work and not predictions, of which it is written down that somebody has seen
them; nor what has to be computed first."""

ReviewColors = Literal["green_red", "blue_orange"]
"""Of the truth and of a prediction. Not all people can tell green from red."""


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
class Draft:
    """The document as the drag, slider or key in hand would leave it; one edit once it is kept.

    Attributes
    ----------
    document : Annotation
    text : str
        Names the edit in the menu.
    pose : ToolPose or None
        The tool's pose where it was that which was dragged: of a straight tool the document alone does not
        tell the roll.
    is_typed : bool
        Whether it was typed or stepped, rather than being in hand: who saves or leaves meant it.
    """

    document: Annotation
    text: str
    pose: ToolPose | None = None
    is_typed: bool = False


@dataclass(frozen=True)
class View:
    """How the open volume is looked at.

    Attributes
    ----------
    crosshair_um : (float, float, float)
        Where the three slices meet, µm in the volume's frame.
    active_part : str or None
        The keypoint, or the link whose box, is placed by the next click and moved by keys.
    mode : str
        ``navigate``: no click moves an annotation. ``place``: a click places the active keypoint or an end of
        the active box, and handles move that. ``pose``: handles move the tool as one body.
    preview : Preview or None
        Drawn in place of the keypoint's position in the document; an end of a box that is being placed, too.
    draft : Draft or None
        Drawn in place of the document.
    first_end_um : (float, float, float) or None
        The end of the active box that has been clicked, while the other one is waited for.
    free_links : frozenset of str
        Links whose box may change its cross-section.
    pose : ToolPose or None
        The pose in which a person last left the tool; counts as long as the document agrees with it.
    refinement : Refinement or None
        Proposed by the volume, and neither accepted nor rejected yet.
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
    review_colors : str
        See `ReviewColors`.
    layers : frozenset of str
        What is drawn besides the keypoints.
    overlays_hidden : bool
        While the key that hides all overlays is held.
    """

    crosshair_um: Vector = (0.0, 0.0, 0.0)
    active_part: str | None = None
    mode: Mode = "navigate"
    preview: Preview | None = None
    draft: Draft | None = None
    first_end_um: Vector | None = None
    free_links: frozenset[str] = frozenset()
    pose: ToolPose | None = None
    refinement: "Refinement | None" = None
    window: tuple[float, float] = (0.0, 255.0)
    opacity_threshold: float = 0.0
    rendering: Rendering = "volume"
    colormap: str = "gray"
    cropping_um: tuple[Vector, Vector] | None = None
    detail: bool = False
    maximized: Pane | None = None
    review_colors: ReviewColors = "green_red"
    layers: frozenset[Layer] = field(default=FIRST_LAYERS)
    overlays_hidden: bool = False

    @property
    def is_anything_on_its_way(self) -> bool:
        """Whether there is something that Esc would drop."""
        on_its_way = (self.preview, self.draft, self.first_end_um, self.refinement)
        return any(each is not None for each in on_its_way)

    def differs_in_crosshair_alone(self, other: "View") -> bool:
        """Say whether all but the crosshair is as in another view."""
        return replace(self, crosshair_um=other.crosshair_um) == other
