"""The Mayavi scene with its layers: draws a look, the volume behind and the overlays before it.

Importing this module imports Mayavi and VTK, which takes seconds.
"""

import time
from collections.abc import Hashable
from dataclasses import dataclass

import vtk
from PySide6.QtGui import QFont

from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.volumes import Level
from annotator.looks.prediction_marks import RING_RADIUS_PX
from annotator.scene.axes_layer import AxesLayer
from annotator.scene.canvas import Canvas
from annotator.scene.handles_layer import HandlesLayer
from annotator.scene.keypoints_layer import KeypointsLayer
from annotator.scene.links_layer import LinksLayer
from annotator.scene.others_layer import OthersLayer
from annotator.scene.picking import SPHERE_PX, Picture
from annotator.scene.planes_layer import PlanesLayer, PlanesLook, SlicesLayer, SlicesLook
from annotator.scene.prediction_layer import PredictionLayer, review_solids
from annotator.scene.renderers import Renderers, is_software
from annotator.scene.scale_bar_layer import ScaleBarLayer
from annotator.scene.solids_layer import SolidsLayer
from annotator.scene.volume_layer import MOVING_RAY_PX, VolumeLayer, VolumeLook, next_moving_ray_px
from annotator.session.agreement.differences import Difference
from annotator.session.agreement.others import OtherAnnotation
from annotator.session.editing.handles import Handle
from annotator.session.editing.keypoint_marks import KeypointMark
from annotator.session.editing.solids import Solid
from annotator.session.predictions.drawn_prediction import DrawnPrediction
from annotator.session.viewing.view import View
from annotator.settings import Renderer


@dataclass(frozen=True)
class SceneLook:
    """Everything that a frame depends on.

    Attributes
    ----------
    ground : (float, float, float)
        Red, green, blue from 0 to 1.
    box_um : ((float, float, float), (float, float, float)) or None
        Outer corners of the volume; None where none is open.
    pointed : str or None
        The handle that is held or under the cursor.
    others : tuple of OtherAnnotation
        Those that are to be seen.
    differences : tuple of Difference
        Between them.
    unnamed : frozenset of str
        The keypoints of the others that no mark of one's own names.
    prediction : DrawnPrediction or None
    """

    picture: Picture
    ground: tuple[float, float, float]
    box_um: tuple[Vector, Vector] | None
    level: Level | None
    view: View
    tool: ToolSpecification | None
    marks: tuple[KeypointMark, ...]
    solids: tuple[Solid, ...]
    handles: tuple[Handle, ...]
    pointed: str | None
    others: tuple[OtherAnnotation, ...] = ()
    differences: tuple[Difference, ...] = ()
    unnamed: frozenset[str] = frozenset()
    prediction: DrawnPrediction | None = None


class Stage:
    """Mayavi's scene and what stands in it.

    Attributes
    ----------
    canvas : Canvas
    renderers : Renderers
    """

    def __init__(self, canvas: Canvas, choice: Renderer) -> None:
        self.canvas = canvas
        self.renderers = Renderers(self.canvas.window, self.canvas.renderer)
        if choice == "auto":
            self._software = is_software(self.renderers.renderer_name())
        else:
            self._software = choice == "software"
        self._volume = VolumeLayer(software=self._software)
        self._slices = SlicesLayer()
        for behind in (self._volume.actor, *self._slices.actors):
            self.renderers.add_behind(behind)
        self._planes = PlanesLayer()
        self._links = LinksLayer()
        self._solids = SolidsLayer()
        self._axes = AxesLayer()
        self._scale_bar = ScaleBarLayer()
        self._others = OthersLayer(self.canvas.renderer)
        self._prediction = PredictionLayer(self.canvas.renderer)
        in_space = (self._planes, self._others, self._links, self._prediction, self._solids)
        for layer in (*in_space, self._axes, self._scale_bar):
            for actor in layer.actors:
                self.renderers.add_overlay(actor)
        self._keypoints = KeypointsLayer(self.canvas.renderer)
        self._handles = HandlesLayer(self.canvas.renderer)
        self.renderers.add_overlay(self._handles.actor)
        self._moving_ray_px = MOVING_RAY_PX

    @property
    def is_software(self) -> bool:
        """Whether rays are cast, and pixels drawn, by the processor."""
        return self._software

    def volume_key(self, look: SceneLook) -> Hashable:
        """Return what the volume's picture at its best depends on."""
        return (look.picture, look.ground, _behind(look, ray_px=1.0))

    def draw(self, look: SceneLook, font: QFont, *, final: bool) -> None:
        """Draw a frame; unless it is final, with as few rays as moving things need."""
        self.canvas.fit(look.picture.width_px, look.picture.height_px, look.picture.ratio)
        coarse = self._software and not final
        behind = _behind(look, ray_px=self._moving_ray_px if coarse else 1.0)
        actors: tuple[vtk.vtkProp, ...] = ()
        if isinstance(behind, VolumeLook):
            self._volume.show(behind)
            actors = (self._volume.actor,)
        elif isinstance(behind, SlicesLook):
            self._slices.show(behind)
            actors = self._slices.actors
        hidden = look.view.overlays_hidden
        if not hidden:
            self._show_overlays(look, font)
        began_s = time.perf_counter()
        self.renderers.draw(
            look.picture.camera, look.ground, behind, actors, overlays=not hidden, final=final
        )
        if coarse:
            self._moving_ray_px = next_moving_ray_px(self._moving_ray_px, time.perf_counter() - began_s)

    def _show_overlays(self, look: SceneLook, font: QFont) -> None:
        view, picture, ratio = look.view, look.picture, look.picture.ratio
        shown, box_um = view.layers, look.box_um
        self._planes.show(
            PlanesLook(
                crosshair_um=view.crosshair_um,
                box_um=box_um,
                outlined="planes" in shown,
                crossed="crosshair" in shown,
                ratio=ratio,
            )
        )
        positions_um = {mark.name: mark.position_um for mark in look.marks}
        self._links.show_links(look.tool if "links" in shown else None, positions_um, ratio)
        self._links.show_ray(view.preview.ray if view.preview else None, box_um, ratio)
        solids = review_solids(look.prediction) if look.prediction is not None else ()
        self._solids.show((*look.solids, *solids), picture.camera, ratio)
        self._others.show(look.others, look.differences, picture, font, look.unnamed)
        axes = "axes" in shown and box_um is not None
        self._axes.show_outlines(box_um if axes else None, view.cropping_um, ratio)
        self._axes.show_triad(picture, font, visible=axes)
        self._scale_bar.show(picture, font, visible="scale_bar" in shown and box_um is not None)
        predicted = look.prediction
        self._keypoints.show(
            look.marks,
            picture,
            font,
            names="names" in shown,
            # Clear of the rings that a prediction draws around keypoints.
            clear_px=SPHERE_PX / 2 if predicted is None else RING_RADIUS_PX,
            unnamed=frozenset() if predicted is None else predicted.named,
        )
        named = (*self._keypoints.named, *self._others.lettered)
        self._prediction.show(predicted, picture, font, named)
        self._handles.show(look.handles, picture, look.pointed)


def _behind(look: SceneLook, ray_px: float) -> VolumeLook | SlicesLook | None:
    """Return what is drawn behind the overlays: the volume, or in its place the slices, or nothing."""
    view = look.view
    if look.level is None:
        return None
    if "volume" in view.layers:
        return VolumeLook(
            level=look.level,
            window=view.window,
            opacity_threshold=view.opacity_threshold,
            rendering=view.rendering,
            colormap=view.colormap,
            cropping_um=view.cropping_um,
            ray_px=ray_px,
        )
    if "planes" in view.layers:
        return SlicesLook(look.level, view.crosshair_um, view.window, view.colormap)
    return None
