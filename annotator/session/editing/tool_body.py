"""What the geometry says of the open document: its fit, the tool's pose, and the bodies and handles drawn."""

import numpy as np
from PySide6.QtCore import QObject, Signal

from annotations.documents.annotation import Annotation
from annotations.documents.representations import keypoint_positions_um
from annotations.fitting.mistakes import Mistake
from annotations.fitting.pose_fit import ToolFit, fit_document
from annotations.geometry import rotations
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.tool import ToolSpecification
from annotator.session.editing.box_handles import box_handles
from annotator.session.editing.handles import Handle
from annotator.session.editing.mistake_search import MistakeSearch
from annotator.session.editing.pose_handles import pose_handles
from annotator.session.editing.solids import Solid, posed_solids
from annotator.session.options import SessionOptions
from annotator.session.remembered import Remembered
from annotator.session.state import SessionState
from annotator.session.viewing.view import Mode

# A position that was stored and read again may differ in its last digits.
_SAME_UM = 1e-3
_SAME_AXIS = 1e-6


class SessionBody(SessionState):
    """The tool as one body: follows from the document and the view, and is kept nowhere else.

    Signals
    -------
    mistakes_changed
        A search for ``mistakes``, in the background after each edit, has ended.
    """

    mistakes_changed = Signal()

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(options, parent)
        self._fit: ToolFit | None = None
        self._fitted: Annotation | None = None
        self._settled: Remembered[ToolPose | None] = Remembered()
        self._box_handles: Remembered[tuple[Handle, ...]] = Remembered()
        self._pose_handles: Remembered[tuple[Handle, ...]] = Remembered()
        self._solids: Remembered[tuple[Solid, ...]] = Remembered()
        self._mistakes = MistakeSearch(self.jobs, self)
        self._mistakes.found.connect(self.mistakes_changed)
        self._mistakes.failed.connect(self._raise_error)
        self.volume_changed.connect(self._mistakes.clear)
        self.document_changed.connect(self._on_document_changed)

    @property
    def tool_fit(self) -> ToolFit | None:
        """The pose that explains the shown document best; None where it says too little for one."""
        document, tool = self.shown_document, self.tool
        if document is None or tool is None:
            return None
        if document is not self._fitted:
            draft = self._view.draft
            # Of poses that explain the document equally well, the one in which a person left the tool.
            posed = draft.pose if draft is not None and draft.pose is not None else self._view.pose
            self._fitted, self._fit = document, fit_document(document, tool, start=posed)
        return self._fit

    @property
    def tool_pose(self) -> ToolPose | None:
        """The pose that is drawn: the one that is being dragged, else the last one posed, else the fit's."""
        draft = self._view.draft
        if draft is None and self._view.preview is None:
            return self.settled_pose
        if draft is not None and draft.pose is not None:
            return draft.pose
        return self.tool_fit.pose if self.tool_fit is not None else None

    @property
    def settled_pose(self) -> ToolPose | None:
        """The pose of the document without what is on its way: where every drag begins.

        In pose mode there is one even where the document says too little for a fit.
        """
        view = self._view
        return self._settled.result(self._settle_pose, self._document, self.tool, view.pose, view.mode)

    @property
    def mistakes(self) -> tuple[Mistake, ...]:
        """What is likely wrong with the document, as far as it has been looked for by now."""
        return self._mistakes.mistakes

    @property
    def has_looked_for_mistakes(self) -> bool:
        """Whether ``mistakes`` are those of the document as it is now, and not of an earlier one."""
        return self._document is not None and self._mistakes.looked_at is self._document

    @property
    def is_searching_mistakes(self) -> bool:
        """Whether mistakes are being looked for."""
        return self._mistakes.is_running

    def _take_fit(self, document: Annotation, fit: ToolFit | None) -> None:
        """Keep what another thread has fitted to a document, with no pose to begin from."""
        self._fitted, self._fit = document, fit

    def search_every_relabelling(self) -> None:
        """Try every way in which keypoints may have been interchanged; ``mistakes_changed`` follows."""
        if self._document is not None and self.tool is not None:
            self._mistakes.search(self._document, self.tool, every_relabelling=True)

    def active_box(self) -> Box | None:
        """Return the shown box of the active link; None where it has none, as in a document of keypoints."""
        document, name = self.shown_document, self._view.active_part
        return document.placed_boxes.get(name or "") if document is not None else None

    def handles(self) -> tuple[Handle, ...]:
        """Return what can be taken hold of now: of the tool in pose mode, of the active box in place mode."""
        document, tool, view = self._document, self.tool, self._view
        if document is None or tool is None or view.mode == "navigate":
            return ()
        if view.mode == "pose":
            pose = self.tool_pose
            return self._pose_handles.result(pose_handles, pose, tool) if pose is not None else ()
        return self._box_handles.result(
            _box_handles, document, self.shown_document, tool, view.active_part, view.free_links
        )

    def solids(self) -> tuple[Solid, ...]:
        """Return the bodies to be drawn: the boxes of the shown document, and the fitted or posed tool."""
        document, tool, view = self.shown_document, self.tool, self._view
        if document is None or tool is None:
            return ()
        # The last pose agrees with an empty document, too, but there it is no fit of anything.
        wanted = view.mode == "pose" or ("ghost" in view.layers and any(self.shown_positions_um()))
        pose = self.tool_pose if wanted else None
        proposal = view.refinement.pose if view.refinement is not None else None
        return self._solids.result(_solids, document, tool, view.active_part, pose, proposal)

    def _settle_pose(
        self, document: Annotation | None, tool: ToolSpecification | None, posed: ToolPose | None, mode: Mode
    ) -> ToolPose | None:
        if document is None or tool is None:
            return None
        if posed is not None and _agrees(document, posed, tool):
            return posed
        fit = self._fit if document is self._fitted else fit_document(document, tool, start=posed)
        return fit.pose if fit is not None else posed if mode == "pose" else None

    def _lying_pose(self, tool: ToolSpecification) -> ToolPose | None:
        """Return the pose of a tool that nobody has placed: at the crosshair, across the light."""
        volume, spacing_um = self.volume, self.spacing_um
        if volume is None or spacing_um is None or not tool.links:
            return None
        depth = np.eye(3)[volume.depth_axis]
        extents_um = [size * step for size, step in zip(volume.shape, spacing_um, strict=True)]
        longest = max(
            (axis for axis in range(3) if axis != volume.depth_axis), key=lambda axis: extents_um[axis]
        )
        along = np.eye(3)[longest]
        axes = np.column_stack([along, np.cross(depth, along), depth])
        return ToolPose(self._view.crosshair_um, rotations.from_matrix(axes))

    def _on_document_changed(self, _before: Annotation | None, after: Annotation | None) -> None:
        if after is not None and self.tool is not None:
            self._mistakes.search(after, self.tool)


def _agrees(document: Annotation, pose: ToolPose, tool: ToolSpecification) -> bool:
    """Say whether everything that a document places is where a pose has it."""
    posed_um = keypoints_um(pose, tool)
    for name, position_um in keypoint_positions_um(document, tool).items():
        # A keypoint that ends no link is nowhere in a pose.
        if name in posed_um and not np.allclose(posed_um[name], position_um, rtol=0, atol=_SAME_UM):
            return False
    boxes = link_boxes(pose, tool)
    return all(
        np.allclose(boxes[link].axes, box.axes, rtol=0, atol=_SAME_AXIS)
        for link, box in document.placed_boxes.items()
        if link in boxes
    )


def _box_handles(
    document: Annotation,
    shown: Annotation | None,
    tool: ToolSpecification,
    active_part: str | None,
    free_links: frozenset[str],
) -> tuple[Handle, ...]:
    box = shown.placed_boxes.get(active_part or "") if shown is not None else None
    if box is None or active_part is None:
        return ()
    part = document.part(active_part)
    # A box that waits for its second click is drawn, but there is none to be moved yet.
    if part.locked or part.anchor_um is None:
        return ()
    return box_handles(box, tool.link(active_part).color, free=active_part in free_links)


def _solids(
    document: Annotation,
    tool: ToolSpecification,
    active_part: str | None,
    pose: ToolPose | None,
    proposal: ToolPose | None,
) -> tuple[Solid, ...]:
    boxes = [
        Solid(
            part.link,
            "box",
            part.box,
            is_round=False,
            color=tool.link(part.link).color,
            active=part.link == active_part,
            unsure=part.certainty == "unsure",
        )
        for part in document.boxes
        if part.box is not None
    ]
    return (
        *boxes,
        *(posed_solids(pose, tool, "ghost") if pose is not None else ()),
        *(posed_solids(proposal, tool, "proposal") if proposal is not None else ()),
    )
