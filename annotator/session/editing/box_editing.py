"""The session's editing of boxes: two clicks place one; handles, keys and numbers change it."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from annotations.documents import edits
from annotations.documents.annotation import Annotation, BoxAnnotation, Source
from annotations.documents.edits import EditRefused
from annotations.geometry.boxes import Box, box_between
from annotations.geometry.frames import Vector, vector
from annotations.volumes import Ray
from annotator.session.editing.box_handles import box_dragged, resized, rolled, turned
from annotator.session.editing.editing import SessionEditing
from annotator.session.viewing import placing
from annotator.session.viewing.view import Draft

_FIXED_SECTION = "The cross-section of {} is fixed: press C to free it"


class SessionBoxes(SessionEditing):
    """Edits of boxes. Drags preview as a draft, which is kept as one edit."""

    def place(self, position_um: Vector, source: Source = "clicked", keypoint: str | None = None) -> None:
        """Place a keypoint; or in a document of boxes an end of the active box: base first, then the tip."""
        if self._document is None or self._document.method == "keypoints":
            super().place(position_um, source, keypoint)
        elif self.keypoint_to_place() is not None:
            self._place_end(vector(position_um), source)

    def keypoint_to_place(self) -> str | None:
        """Return the keypoint that a click places: of an unplaced box the end that is still missing."""
        document, tool, name = self._document, self.tool, self._view.active_part
        if document is None or document.method == "keypoints" or tool is None:
            return super().keypoint_to_place()
        if name is None:
            self.post_message("Choose a link first: a number key, or its row in the table")
            return None
        part = document.part(name)
        if part.locked:
            self._refuse(EditRefused(f"The box of {name} is locked", remedy="Unlock it to change it"))
            return None
        if part.anchor_um is not None:
            self.post_message(f"{name} has its box: drag its handles, or clear it to click it anew")
            return None
        link = tool.link(name)
        return link.base if self._view.first_end_um is None else link.tip

    def pick_ray(self, ray: Ray) -> None:
        """Take a click in the scene; from the angle of the last one, it agrees to the end proposed by that.

        So a second click proposes the other end, and a third one places the box and goes on to the next.
        """
        preview = self._view.preview
        agrees = (
            self._active_part() is not None
            and preview is not None
            and preview.ray is not None
            and placing.is_seen_alike(preview.ray, ray)
        )
        if not agrees:
            super().pick_ray(ray)
        elif (position_um := self._met_by(ray)) is not None:
            self.keep_preview()
            part = self._active_part()
            is_open = part is not None and part.anchor_um is None
            if is_open and (name := self.keypoint_to_place()) is not None:
                self._propose(name, position_um, ray)

    def keep_preview(self) -> None:
        """Put the previewed position into the document; of a box, the end of its axis beneath it."""
        preview, part, tool = self._view.preview, self._active_part(), self.tool
        if preview is None or preview.ray is None or part is None or tool is None:
            super().keep_preview()
            return
        # A single ray meets the surface of the link, and the ends of a box lie on its axis: without this, the
        # box would stand half out of the tool. Two rays from different angles are aimed at the middle of what
        # is seen from each, and cross on the axis: an end that they settle stays where it is.
        half_height_um = tool.link(part.link).cross_section_um[1] / 2
        beneath_um = np.add(preview.position_um, half_height_um * np.asarray(preview.ray.direction))
        self.place(vector(beneath_um), preview.source, preview.keypoint)

    def aim_second_end(self, position_um: Vector) -> None:
        """Show the box as a second click at a position would place it, unless the scene has proposed one."""
        part, box = self._active_part(), self._box_to(vector(position_um))
        if self._view.preview is None and part is not None and box is not None and self._document is not None:
            document = edits.place_box(self._document, part.link, box, "clicked")
            self.look(draft=Draft(document, f"Place {part.link}"))

    def free_cross_section(self, link: str, free: bool) -> None:
        """Let a link's box change its width and height, or hold them."""
        links = self._view.free_links
        self.look(free_links=links | {link} if free else links - {link})

    def begin_preview(self, keypoint: str, position_um: Vector, source: Source) -> None:
        """Show a keypoint where a drag has brought it; in a document of boxes their handles do that."""
        if self._document is not None and self._document.method == "boxes":
            self.post_message(f"{keypoint} is an end of a box: drag the handles of the box")
        else:
            super().begin_preview(keypoint, position_um, source)

    # Handles

    def drag_handle(self, handle: str, to_um: Vector) -> None:
        """Show what dragging a handle to a position makes of the active box.

        One that is not among `handles` is ignored: a key may have changed the mode in the middle of a drag.
        """
        part = self._changeable_box()
        is_shown = any(each.name == handle for each in self.handles())
        if is_shown and part is not None and part.box is not None:
            self._draft_box(part.link, box_dragged(part.box, handle, vector(to_um)), "dragged", handle)

    def drag_body(self, link: str, by_um: Vector) -> None:
        """Show what dragging a body by a vector makes of it."""
        if self._view.mode != "place":
            return
        self.activate(link)
        part = self._changeable_box()
        if part is not None and part.box is not None:
            center_um = vector(np.add(part.box.center_um, by_um))
            self._draft_box(link, replace(part.box, center_um=center_um), "dragged", "center")

    def keep_draft(self) -> None:
        """Put what a drag has drafted into the document: one edit."""
        draft = self._view.draft
        if draft is not None:
            was_begun = self._view.first_end_um is not None
            self.look(pose=draft.pose or self._view.pose)
            super()._edit(draft.text, lambda _document: draft.document)
            self.look(draft=None, first_end_um=None)
            if was_begun and (following := self._next_unplaced()) is not None:
                self.activate(following)

    def settle_typing(self) -> None:
        """Put what is being typed into the document: who saves, leaves or goes on meant it."""
        super().settle_typing()
        self._keep_typed_draft()

    # Keys and numbers

    def nudge(self, axis: int, voxels: int) -> None:
        """Move the active keypoint, or the active box, along an axis by whole voxels."""
        document, spacing_um = self._document, self.spacing_um
        if document is None or document.method == "keypoints" or spacing_um is None:
            super().nudge(axis, voxels)
            return
        part = self._changeable_box()
        if part is not None and part.box is not None:
            moved_um = placing.nudged(part.box.center_um, axis, voxels, spacing_um)
            self._change_box(part.link, replace(part.box, center_um=moved_um), "nudged", "Nudge")

    def turn(self, axis: int, turn_deg: float) -> None:
        """Turn the active box about one of its own axes."""
        part = self._changeable_box()
        if part is not None and part.box is not None:
            self._change_box(part.link, turned(part.box, axis, turn_deg), "nudged", "Turn")

    def move_face(self, axis: int, voxels: int, *, leading: bool) -> None:
        """Move one face of the active box along an axis of the volume by whole voxels.

        Parameters
        ----------
        axis : int
            Of the volume.
        voxels : int
            How far; its sign is the direction.
        leading : bool
            Whether it is the face that looks most into that direction, which makes the box larger; else the
            opposite face, which makes it smaller.
        """
        part, spacing_um = self._changeable_box(), self.spacing_um
        if part is None or part.box is None or spacing_um is None:
            return
        box, towards = part.box, np.sign(voxels)
        own = int(np.argmax(np.abs(box.axes[axis])))
        if own != 0 and part.link not in self._view.free_links:
            self.post_message(_FIXED_SECTION.format(part.link))
            return
        sense = float(np.sign(box.axes[axis, own]) * towards) * (1.0 if leading else -1.0)
        step_um = abs(voxels) * spacing_um[axis] * (1.0 if leading else -1.0)
        self._change_box(
            part.link, resized(box, own, sense, box.size_um[own] / 2 + step_um), "nudged", "Resize"
        )

    def type_box(self, link: str, box: Box) -> None:
        """Give a link the box that a person typed; its cross-section only where that is free."""
        if self._may_have(link, box):
            self._change_box(link, box, "typed", "Type")

    def preview_box(self, link: str, box: Box) -> None:
        """Show a box while it is typed; `settle_typing` keeps it, `drop_preview` forgets it."""
        document = self._document
        if document is None or not self._may_have(link, box):
            return
        if document.placed_boxes.get(link) == box:
            # Typed back to what it was: that is no edit.
            self.look(draft=None)
            return
        try:
            typed = edits.place_box(document, link, box, "typed")
        except EditRefused as error:
            self._refuse(error)
        else:
            self.look(draft=Draft(typed, f"Type {link}", is_typed=True))

    def reverse(self, link: str) -> None:
        """Turn the box of a link end for end, half about its own y: the hinge keeps its sense."""
        box = self._document.placed_boxes.get(link) if self._document is not None else None
        if box is not None:
            self._change_box(link, turned(box, 1, 180.0), "nudged", "Reverse")

    def roll_boxes(self, turns_deg: Mapping[str, float]) -> None:
        """Turn boxes, by their links, about their own x: one edit of all, which leaves their sources."""

        def roll(document: Annotation) -> Annotation:
            for part in document.boxes:
                if part.link in turns_deg and part.box is not None and part.source is not None:
                    box = rolled(part.box, turns_deg[part.link])
                    document = edits.place_box(document, part.link, box, part.source)
            return document

        self._edit("Turn boxes", roll)

    def turn_over(self) -> None:
        """Turn the active box 180° about its own x: the same body, the hinge's axis in the other sense."""
        part = self._changeable_box()
        if part is not None and part.box is not None:
            self._change_box(part.link, part.box.turned_over, "nudged", "Turn over")

    def _place_end(self, position_um: Vector, source: Source) -> None:
        part, box = self._active_part(), self._box_to(position_um)
        if part is None:
            return
        if self._view.first_end_um is None:
            self.look(preview=None, first_end_um=position_um, crosshair_um=position_um)
            self.post_message(f"Now click the other end of {part.link}, towards the tip")
            return
        if box is None:
            self.post_message("Both ends are at one place: click the other end of the link")
            return
        if self._edit(
            f"Place {part.link}", lambda document: edits.place_box(document, part.link, box, source)
        ):
            self.look(preview=None, first_end_um=None, crosshair_um=position_um)
            following = self._next_unplaced()
            if following is not None:
                self.activate(following)
            self.post_message(self._roll_untold(part.link))

    def _roll_untold(self, link: str) -> str:
        """Say that a box has just got a roll that nobody has seen, and how to give it the right one."""
        untold = f"Two clicks do not tell the roll of {link}"
        if self._document is None or self._view.active_part == link:
            return f"{untold}: the check proposes it where the ends show it; or turn it with X or its knob"
        number = [part.name for part in self._document.parts].index(link) + 1
        return (
            f"{untold}: once all boxes are placed the check proposes it; or press {number} and turn it with X"
        )

    def _box_to(self, tip_um: Vector) -> Box | None:
        """Return the box from the first end to a second one, with the hinge that its parent suggests."""
        part, tool, base_um = self._active_part(), self.tool, self._view.first_end_um
        if part is None or tool is None or base_um is None or self._document is None:
            return None
        joint = next((joint for joint in tool.joints if joint.child == part.link), None)
        parent = self._document.placed_boxes.get(joint.parent) if joint is not None else None
        if joint is not None and parent is not None:
            # Turning about the hinge leaves its own direction; what is +y to the child was so to the parent.
            hinge = parent.axes[:, 1]
        else:
            # A root lies with its height along the light: something must be shown, and a person turns it.
            depth = np.eye(3)[self.volume.depth_axis if self.volume is not None else 2]
            hinge = np.cross(depth, np.subtract(tip_um, base_um))
        for direction in (hinge, *np.eye(3)):
            try:
                return box_between(base_um, tip_um, tool.link(part.link).cross_section_um, direction)
            except ValueError:
                continue
        return None

    def _may_have(self, link: str, box: Box) -> bool:
        """Say whether a link may have a box as far as its cross-section is concerned; if not, say why."""
        document, tool = self._document, self.tool
        if document is None or tool is None:
            return False
        present = document.placed_boxes.get(link)
        section_um = present.size_um[1:] if present is not None else tool.link(link).cross_section_um
        may = link in self._view.free_links or np.allclose(box.size_um[1:], section_um, rtol=1e-9)
        if not may:
            self.post_message(_FIXED_SECTION.format(link))
        return bool(may)

    def _edit(self, text: str, edit: Callable[[Annotation], Annotation]) -> bool:
        """Make one pure edit, after what is being typed: another edit would drop a draft."""
        self._keep_typed_draft()
        return super()._edit(text, edit)

    def _keep_typed_draft(self) -> None:
        if self._view.draft is not None and self._view.draft.is_typed:
            self.keep_draft()

    def _active_part(self) -> BoxAnnotation | None:
        document, name = self._document, self._view.active_part
        return next((box for box in document.boxes if box.link == name), None) if document else None

    def _changeable_box(self) -> BoxAnnotation | None:
        """Return the active box, as typed, if it can be changed; else say why not."""
        self._keep_typed_draft()
        part = self._active_part()
        if part is None:
            self.post_message("Choose a box that is placed first: a number key, or its row in the table")
            return None
        if part.box is None:
            self.post_message(f"{part.link} has no box yet: place it first, or choose one that is placed")
            return None
        if part.locked:
            self._refuse(EditRefused(f"The box of {part.link} is locked", remedy="Unlock it to change it"))
            return None
        return part

    def _draft_box(self, link: str, box: Box, source: Source, handle: str) -> None:
        if self._document is None:
            return
        words = {"center": "Move", "swing": "Turn", "roll": "Turn"}.get(handle, "Resize")
        try:
            document = edits.place_box(self._document, link, box, source)
        except EditRefused as error:
            self._refuse(error)
            return
        self.look(draft=Draft(document, f"{words} {link}"))

    def _change_box(self, link: str, box: Box, source: Source, words: str) -> None:
        if self._edit(f"{words} {link}", lambda document: edits.place_box(document, link, box, source)):
            self.look(draft=None)
