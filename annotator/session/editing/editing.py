"""The session's editing: choosing a part, placing and moving keypoints, and saying more about a part."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

from PySide6.QtCore import QObject

from annotations.documents import edits
from annotations.documents.annotation import Certainty, Source, State
from annotations.documents.edits import EditRefused
from annotations.geometry.frames import Vector, vector
from annotations.volumes import Ray, intensity_window
from annotator.session.editing.pick_refiner import PickRefiner
from annotator.session.editing.tool_body import SessionBody
from annotator.session.options import SessionOptions
from annotator.session.viewing import placing
from annotator.session.viewing.view import Layer, Mode, Preview


class SessionEditing(SessionBody):
    """Edits of keypoints, and what keypoints and boxes have in common; refusals come as messages.

    Each edit is pure and one step of undo. `SessionBoxes` adds those of boxes, `SessionPosing` those of the
    tool as a whole.
    """

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(options, parent)
        self._refiner = PickRefiner(self.jobs, self)
        self._refiner.ray_refined.connect(self._on_refiner_ray_refined)
        self._refiner.snapped.connect(self._on_refiner_snapped)
        self._refiner.failed.connect(self._raise_error)

    def activate(self, name: str | None, *, jump: bool = False) -> None:
        """Choose the keypoint or the link that the next click places; ``jump`` brings the crosshair to it.

        In a document of boxes the name of a keypoint stands for the link that it ends.
        """
        if name != self._view.active_part:
            self.settle_typing()
        document, tool = self._document, self.tool
        position_um = self.shown_anchor_um(name or "")
        if document is not None and tool is not None and name is not None and document.method == "boxes":
            link = tool.link_of(name)
            name = link.name if link is not None else name
        changes: dict[str, object] = {"active_part": name}
        if name != self._view.active_part:
            changes |= {"preview": None, "draft": None, "first_end_um": None}
        if jump and position_um is not None:
            changes["crosshair_um"] = position_um
        self.look(**changes)

    def activate_next_unplaced(self) -> None:
        """Choose the next keypoint or box without a place, counted from the active one."""
        if (name := self._next_unplaced()) is not None:
            self.activate(name)
        elif self._document is not None:
            self.post_message(f"All {self._document.method} are placed")

    def set_mode(self, mode: Mode) -> None:
        """Say whether clicks place parts, or handles move the tool as a whole, or neither."""
        self.settle_typing()
        self.look(mode=mode, preview=None, draft=None, first_end_um=None)

    def undo(self) -> None:
        """Take the last edit back; what is being typed is the last one."""
        self.settle_typing()
        if not self._is_refused():
            self.undo_stack.undo()

    def redo(self) -> None:
        """Make the edit again that was taken back last, unless something else has been typed since."""
        self.settle_typing()
        if not self._is_refused():
            self.undo_stack.redo()

    def auto_window(self) -> None:
        """Use the window that suits what the volume holds."""
        if self.slice_level is not None:
            self.look(window=intensity_window(self.slice_level))

    def toggle_layer(self, layer: Layer) -> None:
        """Show or hide a layer."""
        self.look(layers=self._view.layers ^ {layer})

    # Placing

    def place(self, position_um: Vector, source: Source = "clicked", keypoint: str | None = None) -> None:
        """Give a keypoint, by default the active one, a position; then the next unplaced one is active."""
        name = keypoint or self._view.active_part
        if name is None or self._document is None:
            self.post_message("Choose a keypoint first: a number key, or its row in the table")
            return
        fresh = name not in self._document.positions_um
        placed = self._edit(
            f"{'Place' if fresh else 'Move'} {name}",
            lambda document: edits.place_keypoint(document, name, vector(position_um), source),
        )
        self.look(preview=None, crosshair_um=vector(position_um) if placed else self._view.crosshair_um)
        following = self._next_unplaced()
        if placed and fresh and name == self._view.active_part and following is not None:
            self.activate(following)

    def begin_preview(self, keypoint: str, position_um: Vector, source: Source) -> None:
        """Show a keypoint where a drag has brought it; the document changes when it is kept."""
        if self._document is None:
            return
        if self._document.keypoint(keypoint).locked:
            self._refuse(EditRefused(f"Keypoint {keypoint} is locked", remedy="Unlock it to move it"))
            return
        self.look(preview=Preview(keypoint, vector(position_um), source), active_part=keypoint)

    def keep_preview(self) -> None:
        """Put the previewed position into the document: one edit."""
        if (preview := self._view.preview) is not None:
            self.place(preview.position_um, preview.source, preview.keypoint)

    def settle_typing(self) -> None:
        """Put a position that is being typed into the document: who saves, leaves or goes on meant it."""
        preview = self._view.preview
        if preview is not None and preview.source == "typed":
            self.type_position(preview.keypoint, preview.position_um)

    def drop_preview(self) -> None:
        """Forget what is on its way; nothing has changed."""
        self.look(preview=None, draft=None, first_end_um=None, refinement=None)

    def pick_ray(self, ray: Ray) -> None:
        """Take a click in the scene: propose a depth, or settle the proposed one by a second ray."""
        name = self.keypoint_to_place()
        if name is None:
            return
        preview = self._view.preview
        if preview is not None and preview.keypoint == name and preview.ray is not None:
            settled = placing.settle(preview.ray, ray)
            if settled.position_um is not None:
                self.place(settled.position_um, "clicked", name)
                return
            self.post_message(f"Depth not settled: {settled.reason}")
        if (position_um := self._met_by(ray)) is not None:
            self._propose(name, position_um, ray)

    def keypoint_to_place(self) -> str | None:
        """Return the keypoint that a click places; None where it places nothing, and a message says why."""
        name = self._view.active_part
        if name is None or self._document is None:
            self.post_message("Choose a keypoint first: a number key, or its row in the table")
            return None
        if self._document.part(name).locked:
            self._refuse(EditRefused(f"Keypoint {name} is locked", remedy="Unlock it to move it"))
            return None
        return name

    def look_along_ray(self, ray: Ray) -> None:
        """Bring the crosshair to what a click in the scene meets; no keypoint moves."""
        if self.level is not None:
            position_um = placing.depth_along_ray(self.level, ray, self._view)
            if position_um is not None:
                self.look(crosshair_um=position_um)

    def nudge(self, axis: int, voxels: int) -> None:
        """Move the active keypoint along an axis by whole voxels."""
        name = self._view.active_part
        if name is None or self._document is None or self.spacing_um is None:
            return
        position_um = self.shown_positions_um().get(name)
        if position_um is None:
            self.post_message(f"{name} is not placed yet: choose the keypoint to move first")
            return
        moved_um = placing.nudged(position_um, axis, voxels, self.spacing_um)
        preview = self._view.preview
        if preview is not None and preview.ray is not None:
            # A proposal is moved before it is kept; its ray no longer says where it is.
            self.look(preview=replace(preview, position_um=moved_um, ray=None), crosshair_um=moved_um)
            return
        if self._edit(
            f"Nudge {name}", lambda document: edits.place_keypoint(document, name, moved_um, "nudged")
        ):
            self.look(crosshair_um=moved_um)

    def type_position(self, keypoint: str, position_um: Vector) -> None:
        """Give a keypoint the position that a person typed."""
        typed_um = vector(position_um)
        if self._edit(
            f"Type {keypoint}", lambda document: edits.place_keypoint(document, keypoint, typed_um, "typed")
        ):
            self.look(preview=None, active_part=keypoint, crosshair_um=typed_um)

    def snap(self, to: Literal["maximum", "edge"]) -> None:
        """Move the active keypoint to the brightest voxel or strongest edge near it, once it is found."""
        name = self._view.active_part
        position_um = self._document.positions_um.get(name or "") if self._document else None
        if name is None or position_um is None or self.volume is None or self.spacing_um is None:
            self.post_message("Place a keypoint before snapping it; boxes do not snap")
            return
        self._refiner.snap(self.volume, self.spacing_um, name, position_um, to)

    # Saying more about a keypoint or a box

    def set_state(self, name: str, state: State) -> None:
        """Say how a part is seen."""
        words = state.replace("_", " ")
        self._edit(f"Mark {name} {words}", lambda document: edits.set_state(document, name, state))

    def set_certainty(self, name: str, certainty: Certainty) -> None:
        """Say whether the annotator is sure of a part."""
        self._edit(
            f"Mark {name} {certainty}", lambda document: edits.set_certainty(document, name, certainty)
        )

    def set_locked(self, name: str, locked: bool) -> None:
        """Protect a part from changes, or release it."""
        self._edit(
            f"{'Lock' if locked else 'Unlock'} {name}", lambda document: edits.lock(document, name, locked)
        )

    def clear(self, name: str) -> None:
        """Take a part away."""
        self._edit(f"Clear {name}", lambda document: edits.clear(document, name))

    def set_flag(self, flag: str | None) -> None:
        """Say why somebody should look at the volume; None takes that back."""
        self._edit(
            "Flag the volume" if flag else "Remove the flag", lambda document: edits.set_flag(document, flag)
        )

    def relabel(self, right_names: Mapping[str, str]) -> None:
        """Give parts that were taken for each other their right names, see `edits.relabel`: one edit."""
        words = "Swap" if len(right_names) == 2 else "Relabel"
        *others, last = right_names
        self._edit(
            f"{words} {', '.join(others)} and {last}",
            lambda document: edits.relabel(document, right_names),
        )

    def _next_unplaced(self) -> str | None:
        if self._document is None:
            return None
        parts = self._document.parts
        names = [part.name for part in parts]
        active = self._view.active_part
        begin = names.index(active) + 1 if active in names else 0
        return next((part.name for part in parts[begin:] + parts[:begin] if part.anchor_um is None), None)

    def _met_by(self, ray: Ray) -> Vector | None:
        """Return what a click in the scene meets, in µm; None where it is nothing, which a message says."""
        if self.level is None:
            return None
        position_um = placing.depth_along_ray(self.level, ray, self._view)
        if position_um is None:
            self.post_message("Nothing above the opacity threshold lies under the click")
        return position_um

    def _propose(self, keypoint: str, position_um: Vector, ray: Ray) -> None:
        """Propose what a click in the scene has met, and read its depth more sharply."""
        proposed = Preview(keypoint, position_um, "clicked", ray)
        self.look(preview=proposed, draft=None, crosshair_um=position_um)
        if self.volume is not None and self.spacing_um is not None and self.level is not None:
            self._refiner.refine_ray(
                self.volume, self.spacing_um, self.level.spacing_um, position_um, ray, self._view
            )

    def _on_refiner_ray_refined(self, proposed_um: Vector, ray: Ray, position_um: Vector) -> None:
        preview = self._view.preview
        if preview is not None and preview.ray is ray and preview.position_um == proposed_um:
            self.look(preview=replace(preview, position_um=position_um), crosshair_um=position_um)

    def _on_refiner_snapped(self, name: str, began_um: Vector, position_um: Vector) -> None:
        # The keypoint may have moved on while the voxels were read.
        unmoved = self._document is not None and self._document.positions_um.get(name) == began_um
        if unmoved and self._edit(
            f"Snap {name}", lambda document: edits.place_keypoint(document, name, position_um, "snapped")
        ):
            self.look(crosshair_um=position_um)
