"""What the menus Edit and Annotate do to the document and to the active keypoint or box."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from PySide6.QtWidgets import QInputDialog, QWidget

from annotations.documents.annotation import Part, State
from annotations.documents.record import Method
from annotations.errors import UserError
from annotator.actions.annotate_table import BENT_JOINTS, KEYPOINT_KEYS
from annotator.session import Session
from annotator.session.viewing.placing import nudged
from annotator.settings import Settings
from annotator.slices.projection import Plane
from annotator.window.questions import Questions

# Steps to the right, downwards, and on to the next plane.
_DIRECTIONS = {
    "left": ("horizontal", -1),
    "right": ("horizontal", 1),
    "up": ("vertical", -1),
    "down": ("vertical", 1),
    "before": ("axis", -1),
    "behind": ("axis", 1),
}
# What the names of the turning and bending actions end in, in degrees.
_TURN_STEPS = {"": 1.0, "_back": -1.0, "_ten": 10.0, "_back_ten": -10.0}


class AnnotateHandlers:
    """Turns keys and menu entries into the session's edits.

    Parameters
    ----------
    used_axis : callable
        Returns the axis that the slice used last is across: arrow keys move in its plane, as it is drawn.
    """

    def __init__(
        self,
        session: Session,
        settings: Settings,
        questions: Questions,
        used_axis: Callable[[], int],
        window: QWidget,
    ) -> None:
        self._session = session
        self._questions = questions
        self._settings = settings
        self._used_axis = used_axis
        self._window = window

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        session = self._session
        keypoints = {
            f"keypoint_{number}": self._choosing(number - 1) for number in range(1, KEYPOINT_KEYS + 1)
        }
        moves = {f"move_{name}": self._moving(name, 1) for name in _DIRECTIONS}
        far_moves = {f"move_{name}_ten": self._moving(name, 10) for name in _DIRECTIONS}
        return (
            keypoints
            | moves
            | far_moves
            | self._turns()
            | self._resizes()
            | {
                "undo": session.undo,
                "redo": session.redo,
                "choose_tool": self._choose_tool,
                "navigate_mode": self._navigate,
                "place_mode": lambda: session.set_mode("place"),
                "pose_mode": lambda: session.set_mode("pose"),
                "keep_preview": self._keep,
                "method_keypoints": self._annotating_by("keypoints"),
                "method_boxes": self._annotating_by("boxes"),
                "derive": session.deriving.derive,
                "turn_over": session.turn_over,
                "free_cross_section": lambda: self._with_active(self._toggle_cross_section),
                "next_unplaced": session.activate_next_unplaced,
                "go_to_keypoint": lambda: session.activate(session.view.active_part, jump=True),
                "snap_maximum": lambda: session.snap("maximum"),
                "snap_edge": lambda: session.snap("edge"),
                "state_placed": self._stating("placed"),
                "state_occluded": self._stating("occluded"),
                "state_out_of_view": self._stating("out_of_view"),
                "clear": lambda: self._with_active(lambda active: session.clear(active.name)),
                "unsure": lambda: self._with_active(self._toggle_certainty),
                "lock": lambda: self._with_active(
                    lambda active: session.set_locked(active.name, not active.locked)
                ),
                "mark_done": self._toggle_done,
                "flag": self._flag,
            }
        )

    def _with_active(self, do: Callable[[Part], None]) -> None:
        document, name = self._session.document, self._session.view.active_part
        if document is not None and name is not None:
            do(document.part(name))

    def _choosing(self, index: int) -> Callable[[], None]:
        def choose() -> None:
            document = self._session.document
            if document is not None and index < len(document.parts):
                self._session.activate(document.parts[index].name, jump=True)

        return choose

    def _stating(self, state: State) -> Callable[[], None]:
        return lambda: self._with_active(lambda active: self._session.set_state(active.name, state))

    def _toggle_certainty(self, active: Part) -> None:
        self._session.set_certainty(active.name, "sure" if active.certainty == "unsure" else "unsure")

    def _toggle_done(self) -> None:
        document = self._session.document
        if document is None:
            return
        unjudged = [part.name for part in document.parts if part.source == "predicted"]
        if document.status == "done":
            self._session.set_status("in_progress")
        elif unjudged:
            self._ask_about_predicted(unjudged)
        else:
            self._session.set_status("done")

    def _ask_about_predicted(self, names: Sequence[str]) -> None:
        from annotator.dialogs.exports.unjudged_dialog import (
            UnjudgedDialog,  # late: few start from predictions
        )

        dialog = UnjudgedDialog(names, self._window)

        def on_dialog_accepted() -> None:
            if dialog.choice == "accept":
                self._session.predicting.accept_predicted()
            self._session.set_status("done")

        dialog.accepted.connect(on_dialog_accepted)
        self._questions.show(dialog)

    def _flag(self) -> None:
        from annotator.dialogs.annotating.flag_dialog import FlagDialog  # late: few volumes are flagged

        document = self._session.document
        if document is None:
            return
        dialog = FlagDialog(document.flag, self._window)
        dialog.accepted.connect(lambda: self._session.set_flag(dialog.reason))
        self._questions.show(dialog)

    def _toggle_cross_section(self, active: Part) -> None:
        free = active.name not in self._session.view.free_links
        self._session.free_cross_section(active.name, free)

    def _annotating_by(self, method: Method) -> Callable[[], None]:
        def choose() -> None:
            if method in self._session.methods:
                self._settings.method = method
            self._session.set_method(method)

        return choose

    def _keep(self) -> None:
        view = self._session.view
        if view.refinement is not None:
            self._session.accept_refinement()
        elif view.preview is not None:
            self._session.keep_preview()
        else:
            self._session.keep_draft()

    def _turns(self) -> dict[str, Callable[[], object]]:
        session = self._session
        handlers: dict[str, Callable[[], object]] = {}
        for name, degrees in _TURN_STEPS.items():
            for axis, letter in enumerate("xyz"):
                handlers[f"turn_{letter}{name}"] = partial(session.turn, axis, degrees)
            for joint in range(BENT_JOINTS):
                handlers[f"bend_{joint + 1}{name}"] = partial(session.bend, joint, degrees)
        return handlers

    def _resizes(self) -> dict[str, Callable[[], object]]:
        return {
            f"face_{sense}_{direction}{far}": self._resizing(direction, voxels, leading=sense == "out")
            for sense in ("out", "in")
            for direction in ("left", "right", "up", "down")
            for far, voxels in (("", 1), ("_ten", 10))
        }

    def _resizing(self, direction: str, voxels: int, *, leading: bool) -> Callable[[], None]:
        which, sense = _DIRECTIONS[direction]

        def resize() -> None:
            if (plane := self._used_plane()) is not None:
                self._session.move_face(getattr(plane, which), sense * voxels, leading=leading)

        return resize

    def _used_plane(self) -> Plane | None:
        volume, spacing_um = self._session.volume, self._session.spacing_um
        if volume is None or spacing_um is None:
            return None
        return Plane.across(self._used_axis(), volume.shape, spacing_um, volume.depth_axis)

    def _navigate(self) -> None:
        if self._session.view.is_anything_on_its_way:
            self._session.drop_preview()
        else:
            self._session.set_mode("navigate")

    def _moving(self, name: str, voxels: int) -> Callable[[], None]:
        which, sense = _DIRECTIONS[name]

        def move() -> None:
            plane = self._used_plane()
            if plane is None:
                return
            axis: int = getattr(plane, which)
            if self._session.view.mode != "navigate":
                self._session.nudge(axis, sense * voxels)
            else:
                # Navigating never moves an annotation: the same keys move where one looks.
                here_um = self._session.view.crosshair_um
                moved_um = nudged(here_um, axis, sense * voxels, plane.spacing_um)
                self._session.look(crosshair_um=moved_um)
                name = self._session.view.active_part
                if name is not None and self._session.shown_anchor_um(name) is not None:
                    self._session.post_message(f"Crosshair moved; in place mode (P) the keys nudge {name}")

        return move

    def _choose_tool(self) -> None:
        try:
            tools = self._session.tools()
        except UserError as error:
            self._questions.show_error(error)
            return
        names = sorted(tools)
        titles = [f"{name} – {tools[name].title}" if tools[name].title else name for name in names]
        dialog = QInputDialog(self._window)
        dialog.setObjectName("tool_dialog")
        dialog.setWindowTitle("Tool")
        dialog.setLabelText("Instrument for new annotations:")
        dialog.setComboBoxItems(titles)
        if self._session.tool_name in names:
            dialog.setTextValue(titles[names.index(self._session.tool_name)])

        def on_dialog_accepted() -> None:
            name = names[titles.index(dialog.textValue())]
            self._settings.tool_name = name
            self._session.choose_tool(name)

        dialog.accepted.connect(on_dialog_accepted)
        self._questions.show(dialog)
