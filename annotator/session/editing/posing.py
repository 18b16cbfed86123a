"""The session's editing of the tool as one body: pose mode, filling in from the fit, refining."""

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QObject

from annotations.documents import edits
from annotations.documents.annotation import KeypointAnnotation, Source
from annotations.documents.edits import EditRefused
from annotations.errors import UserError
from annotations.fitting.told_keypoints import told_keypoints_um
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotator.session.editing.box_editing import SessionBoxes
from annotator.session.editing.pose_handles import bent, joint_named, moved, pose_dragged, turned
from annotator.session.jobs import Job
from annotator.session.options import SessionOptions
from annotator.session.viewing.placing import nudged
from annotator.session.viewing.view import Draft, Mode

if TYPE_CHECKING:
    from annotations.fitting.refine import Refinement

# Less than this a keypoint that was filled in may lie from where the fit has come to put it.
_SAME_PLACE_UM = 5.0
_NO_CLICKS = "In pose mode clicks place nothing: drag the tool's handles, or place with P"


class SessionPosing(SessionBoxes):
    """Moves the whole tool: all keypoints or boxes follow as one body, and one gesture is one edit.

    Signals: see `SessionState`.
    """

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(options, parent)
        self._refining: Job | None = None

    def set_mode(self, mode: Mode) -> None:
        """Say whether clicks place parts, or handles move the tool as a whole, or neither."""
        tool = self.tool
        if mode == "pose" and tool is not None and not tool.links:
            self.post_message(f"The tool {tool.name} has no links, so it cannot be posed")
            return
        super().set_mode(mode)
        self._bring_tool()

    # Pose mode

    def place(self, position_um: Vector, source: Source = "clicked", keypoint: str | None = None) -> None:
        """Place a keypoint or an end of a box; in pose mode, where clicks place nothing, only one named."""
        if self._view.mode != "pose" or keypoint is not None:
            super().place(position_um, source, keypoint)
        else:
            self.post_message(_NO_CLICKS)

    def keypoint_to_place(self) -> str | None:
        """Return the keypoint that a click places: none in pose mode."""
        if self._view.mode != "pose":
            return super().keypoint_to_place()
        self.post_message(_NO_CLICKS)
        return None

    def preview_pose(self, pose: ToolPose, *, is_typed: bool = False) -> None:
        """Show the document with the tool in a pose; `keep_draft` keeps it, `drop_preview` forgets it."""
        if self._document is None or self.tool is None:
            return
        try:
            document = edits.pose_tool(self._document, self.tool, pose)
        except EditRefused as error:
            self._refuse(error)
            return
        self.look(draft=Draft(document, "Pose the tool", pose, is_typed))

    def pose_tool(self, pose: ToolPose) -> None:
        """Put the tool into a pose: one edit."""
        self.preview_pose(pose)
        self.keep_draft()

    def drag_handle(self, handle: str, to_um: Vector) -> None:
        """Show what dragging a handle to a position makes of the tool, or of the active box."""
        if self._view.mode != "pose":
            super().drag_handle(handle, to_um)
            return
        pose, tool = self.settled_pose, self.tool
        is_shown = any(each.name == handle for each in self.handles())
        if is_shown and pose is not None and tool is not None:
            self.preview_pose(pose_dragged(pose, tool, handle, vector(to_um)))

    def drag_body(self, link: str, by_um: Vector) -> None:
        """Show what dragging a body by a vector makes of the tool, or of the link's box."""
        if self._view.mode != "pose":
            super().drag_body(link, by_um)
        elif (pose := self.settled_pose) is not None:
            self.preview_pose(moved(pose, by_um))

    def nudge(self, axis: int, voxels: int) -> None:
        """Move the tool in pose mode, else the active keypoint or box, along an axis by whole voxels."""
        if self._view.mode != "pose" or self.spacing_um is None:
            super().nudge(axis, voxels)
            return
        step_um = nudged((0.0, 0.0, 0.0), axis, voxels, self.spacing_um)
        self._pose_by(lambda pose: moved(pose, step_um))

    def turn(self, axis: int, turn_deg: float) -> None:
        """Turn the tool in pose mode, else the active box, about one of its own axes."""
        if self._view.mode == "pose":
            self._pose_by(lambda pose: turned(pose, axis, turn_deg))
        else:
            super().turn(axis, turn_deg)

    def bend(self, number: int, by_deg: float) -> None:
        """Bend a joint, counted from 0, by an angle, within its limits."""
        tool = self.tool
        if tool is None or number >= len(tool.joints):
            return
        joint = tool.joints[number]
        self._pose_by(lambda pose: bent(pose, joint, pose.angles_deg.get(joint.name, 0.0) + by_deg))

    def preview_angle(self, joint: str, angle_deg: float, *, is_typed: bool = False) -> None:
        """Show the tool with a joint at a signed angle, and the others as they are drawn now."""
        pose, tool = self.tool_pose, self.tool
        if pose is not None and tool is not None:
            self.preview_pose(bent(pose, joint_named(tool, joint), angle_deg), is_typed=is_typed)

    def take_alternative(self, number: int) -> None:
        """Pose the tool in one of the other ways that explain the document as well as the fit."""
        fit = self.tool_fit
        if fit is not None and number < len(fit.alternatives):
            self.pose_tool(fit.alternatives[number])

    # From the fit

    @property
    def told_keypoints_um(self) -> Mapping[str, Vector]:
        """Positions in µm of the keypoints that the fit tells, by name; see `annotations.fitting`."""
        fit, tool = self.tool_fit, self.tool
        return {} if fit is None or tool is None else told_keypoints_um(fit, tool)

    @property
    def fillable_keypoints(self) -> tuple[str, ...]:
        """Names of the keypoints that `fill_in` would place, or place anew where the fit has changed."""
        told_um = self.told_keypoints_um
        return tuple(
            keypoint.name
            for keypoint in self._unseen_keypoints()
            if keypoint.name in told_um
            and (
                keypoint.position_um is None
                or math.dist(keypoint.position_um, told_um[keypoint.name]) > _SAME_PLACE_UM
            )
        )

    def fill_in(self) -> None:
        """Give the keypoints that nobody can see the positions of the fit, where what is seen tells them.

        Those that were filled in from an earlier fit get their new positions.
        """
        fit, document = self.tool_fit, self._document
        if document is None:
            return
        if document.method != "keypoints":
            self.post_message("Boxes are not filled in; pose mode places the tool as a whole")
        elif fit is None:
            self.post_message("Too few keypoints are placed for a fit of the tool")
        else:
            names = self.fillable_keypoints
            told_um = {name: self.told_keypoints_um[name] for name in names}
            untold = [
                part.name for part in self._unseen_keypoints() if part.name not in self.told_keypoints_um
            ]
            self._edit("Fill in from the fit", lambda present: edits.fill_in(present, told_um))
            said = [f"Filled in {' and '.join(names)}"] if names else []
            if untold:
                said.append(f"What is placed does not tell where {' and '.join(untold)} would be")
            self.post_message(". ".join(said) or "Nothing to fill in: every keypoint is where it should be")

    # Against the volume

    @property
    def is_refining(self) -> bool:
        """Whether the volume is being read for a refinement."""
        return self._refining is not None

    def refine(self) -> None:
        """Polish the tool's pose against the volume; the result is a proposal, see `View.refinement`."""
        from annotations.fitting.refine import refine_pose  # late: few sessions refine

        volume, spacing_um, tool, pose = self.volume, self.spacing_um, self.tool, self.settled_pose
        if volume is None or spacing_um is None or tool is None:
            return
        if pose is None or self._document is None or not self.shown_positions_um():
            self.post_message("Place keypoints or boxes first: refining begins from their fit")
            return
        self._stop_refining()
        began = self._document
        self._refining = self.jobs.start(
            "Refining against the volume",
            lambda progress, cancelled: refine_pose(
                volume, spacing_um, tool, pose, progress=progress, cancelled=cancelled
            ),
            done=lambda found: self._on_job_refined(found, began),
            failed=self._on_job_refining_failed,
            cancelled=self._on_job_refining_cancelled,
        )

    def accept_refinement(self) -> None:
        """Move what is placed to where the refinement proposes it: one edit."""
        refinement, tool = self._view.refinement, self.tool
        if refinement is not None and tool is not None:
            self.look(pose=refinement.pose)
            self._edit("Refine", lambda document: edits.refine(document, tool, refinement.pose))
            self.look(refinement=None)

    def reject_refinement(self) -> None:
        """Leave everything where it is."""
        self.look(refinement=None)

    def refinement_moves_um(self) -> dict[str, float]:
        """Return how far each placed keypoint would move if the proposal were accepted, in µm."""
        refinement, tool = self._view.refinement, self.tool
        if refinement is None or tool is None:
            return {}
        proposed_um = keypoints_um(refinement.pose, tool)
        return {
            name: float(np.linalg.norm(np.subtract(proposed_um[name], position_um)))
            for name, position_um in self.shown_positions_um().items()
            if name in proposed_um
        }

    def _unseen_keypoints(self) -> list[KeypointAnnotation]:
        """Return the keypoints that a fit may place, or place anew: nobody has."""
        keypoints = self._document.keypoints if self._document is not None else ()
        return [keypoint for keypoint in keypoints if edits.is_left_to_fit(keypoint)]

    def _bring_tool(self) -> None:
        """Show the tool at the crosshair where there is nothing to be taken hold of in pose mode."""
        tool = self.tool
        if self._view.mode == "pose" and tool is not None and self.settled_pose is None:
            self.look(pose=self._lying_pose(tool))
            self.post_message("Drag the tool to where it is: its handles move, turn and bend it")

    def _stop_refining(self) -> None:
        job, self._refining = self._refining, None
        if job is not None:
            self.jobs.cancel(job)

    def _pose_by(self, change: Callable[[ToolPose], ToolPose]) -> None:
        self.settle_typing()
        pose = self.settled_pose
        if self._view.mode != "pose" or pose is None:
            self.post_message("In pose mode (B) the keys move the tool as a whole")
            return
        self.pose_tool(change(pose))

    def _on_job_refined(self, found: "Refinement", began: object) -> None:
        self._refining = None
        if self._document == began:
            self.look(refinement=found)
            self.post_message("Refined: Return accepts the proposal, Esc rejects it")
        else:
            self.post_message("The annotation has changed since: refine again")

    def _on_job_refining_failed(self, error: Exception) -> None:
        self._refining = None
        if isinstance(error, UserError):
            self.post_message(str(error))
        else:
            self._raise_error(error)

    def _on_job_refining_cancelled(self) -> None:
        # By a person: where another job takes the place of one, that is no end.
        if self._refining is not None and self._refining.state == "cancelled":
            self._refining = None
