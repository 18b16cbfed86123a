"""Translucent bodies: boxes with sharp edges and the sense of their axes, ghosts of the tool, a proposal.

Without a GPU peeling depths is too slow. So only surfaces that face the eye are drawn, faintly and from the
farthest to the nearest, and every line is opaque: behind several surfaces it can still be seen.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import vtk
from numpy.typing import NDArray
from PySide6.QtGui import QColor
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

from annotations.geometry.boxes import Box
from annotator.scene.camera import Camera
from annotator.scene.colors import ACTIVE, Rgb, rgb
from annotator.scene.facets import facets
from annotator.scene.segments import Segment, Segments, block_edges, segments
from annotator.session.editing.solids import Solid, SolidKind

_FACE_ON: dict[SolidKind, float] = {"box": 0.20, "ghost": 0.07, "proposal": 0.03, "prediction": 0.05}
_GRAZING: dict[SolidKind, float] = {"box": 0.12, "ghost": 0.55, "proposal": 0.25, "prediction": 0.4}
"""Opacity where a surface faces the eye, and where it turns away: a box is flat, the ghost is like glass."""

_ACTIVE_LIGHTER = 135  # percent
_DASHES = 9  # of the longest edge of a box that the annotator is not sure of
_ARROW, _BARB, _TIP = 0.3, 0.07, 0.25
"""Length of the arrow along own +y, its barbs, the tip towards +x: as shares of the smaller side."""


class SolidsLayer:
    """The bodies that the session says to be drawn."""

    def __init__(self) -> None:
        self._edges = Segments(width_px=2)
        self._active_edges = Segments(width_px=3)
        self._ghost_lines = Segments(width_px=1)
        self._proposal_lines = Segments(width_px=2)
        self._surfaces = _Surfaces()
        self._shown: tuple[tuple[Solid, ...], Camera, float] | None = None

    @property
    def actors(self) -> tuple[vtk.vtkActor, ...]:
        """What is drawn."""
        lines = (self._ghost_lines, self._edges, self._active_edges, self._proposal_lines)
        return (*(each.actor for each in lines), self._surfaces.actor)

    def show(self, solids: Iterable[Solid], camera: Camera, ratio: float) -> None:
        """Draw these bodies and no others, as a camera sees them; ``ratio``: as for `Segments.show`."""
        wanted = (tuple(solids), camera, ratio)
        if wanted == self._shown:
            return
        self._shown = wanted
        boxes = [solid for solid in wanted[0] if solid.kind == "box"]
        self._edges.show(_box_lines(box for box in boxes if not box.active), ratio)
        self._active_edges.show(_box_lines(box for box in boxes if box.active), ratio)
        ghosts = [*_outlines(wanted[0], "ghost", camera), *_outlines(wanted[0], "prediction", camera)]
        self._ghost_lines.show(ghosts, ratio)
        self._proposal_lines.show(_outlines(wanted[0], "proposal", camera), ratio)
        self._surfaces.show(wanted[0], camera)


class _Surfaces:
    """All surfaces as one actor, in the order in which they are to be drawn."""

    def __init__(self) -> None:
        self._count = 0
        self._triangles = vtk.vtkPolyData()
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputData(self._triangles)
        self.actor = vtk.vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.GetProperty().LightingOff()
        self.actor.GetProperty().BackfaceCullingOn()
        self.actor.ForceTranslucentOn()
        self.actor.PickableOff()

    def show(self, solids: Sequence[Solid], camera: Camera) -> None:
        self.actor.SetVisibility(bool(solids))
        if not solids:
            return
        bodies = [facets(solid) for solid in solids]
        order = np.argsort(-np.concatenate([body.depths_um(camera) for body in bodies]))
        corners = np.concatenate([body.corners_um for body in bodies])[order]
        colors = np.concatenate(
            [_colors(solid, body.facing(camera)) for solid, body in zip(solids, bodies, strict=True)]
        )[order]
        points = vtk.vtkPoints()
        points.SetData(numpy_to_vtk(corners.reshape(-1, 3), deep=True))
        self._triangles.SetPoints(points)
        if len(corners) != self._count:
            self._count = len(corners)
            self._triangles.SetPolys(_separate(self._count))
        self._triangles.GetPointData().SetScalars(numpy_to_vtk(colors.reshape(-1, 4), deep=True))
        self._triangles.Modified()


def _separate(count: int) -> vtk.vtkCellArray:
    """Return triangles that share no corners."""
    offsets, ids = np.arange(0, 3 * count + 1, 3, dtype=np.int64), np.arange(3 * count, dtype=np.int64)
    cells = vtk.vtkCellArray()
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(ids, deep=True))
    return cells


def _colors(solid: Solid, facing: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return red, green, blue and opacity at each corner, shape (m, 3, 4)."""
    turned_away = np.clip(1 - facing, 0, 1)
    face_on, grazing = _FACE_ON[solid.kind], _GRAZING[solid.kind]
    if solid.unsure:
        face_on, grazing = face_on / 2, grazing / 2
    opacity = face_on + (grazing - face_on) * turned_away**2
    light = 1 - 0.4 * turned_away if solid.kind == "box" else np.ones_like(facing)
    colors = np.empty((*facing.shape, 4))
    colors[..., :3] = np.asarray(rgb(solid.color)) * light[..., None]
    colors[..., 3] = 255 * opacity
    return np.rint(colors).astype(np.uint8)


def _outlines(solids: Iterable[Solid], kind: SolidKind, camera: Camera) -> list[Segment]:
    lines: list[Segment] = []
    for solid in solids:
        if solid.kind == kind:
            color = rgb(ACTIVE if kind == "proposal" else solid.color)
            lines += segments(facets(solid).outline_um(camera), color)
    return lines


def _box_lines(solids: Iterable[Solid]) -> Iterator[Segment]:
    for solid in solids:
        color = QColor(solid.color)
        edge = rgb(color.lighter(_ACTIVE_LIGHTER) if solid.active else color)
        edges = block_edges(corners_um(solid.box), edge)
        dash_um = max(solid.box.size_um) / (2 * _DASHES - 1)
        yield from (dash for each in edges for dash in _dashed(each, dash_um)) if solid.unsure else edges
        yield from _axis_marks(solid.box, edge)


def corners_um(box: Box) -> NDArray[np.float64]:
    """Return a box's corners, shape (2, 2, 2, 3): the first three indices are along its own axes."""
    shares = np.stack(np.meshgrid(*[(-0.5, 0.5)] * 3, indexing="ij"), axis=-1)
    return np.asarray(box.center_um) + (shares * np.asarray(box.size_um)) @ box.axes.T


def _dashed(edge: Segment, dash_um: float) -> Iterator[Segment]:
    """Yield the dashes of an edge: one begins and one ends at its corners."""
    first, second = np.array(edge.first_um), np.array(edge.second_um)
    count = max(1, round((float(np.linalg.norm(second - first)) / dash_um + 1) / 2))
    places_um = first + np.linspace(0, 1, 2 * count)[:, None] * (second - first)
    yield from segments(places_um.reshape(count, 2, 3), edge.color)


def _axis_marks(box: Box, color: Rgb) -> list[Segment]:
    """Return what shows a box's own axes: on its +y face an arrow stands along +y, and a tip points to +x."""
    side_um = min(box.size_um[1:])
    along, hinge, up = box.axes.T
    foot = np.array(box.position_um((0, 0.5, 0)))
    tip = foot + _ARROW * side_um * hinge
    lines = [(foot, tip)]
    lines += [(tip, tip + _BARB * side_um * (aside - 2 * hinge)) for aside in (along, -along, up, -up)]
    point = np.array(box.position_um((0.42, 0.5, 0)))
    lines += [(point, point + _TIP * side_um * (aside - along)) for aside in (up, -up)]
    return segments(np.array(lines), color)
