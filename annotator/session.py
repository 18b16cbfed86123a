"""The session: what is open, how it is looked at, and every change of it. The only signals of state."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoStack

from annotations.documents import edits
from annotations.documents.annotation import Annotation, Certainty, Source, State, Status
from annotations.documents.edits import EditRefused
from annotations.documents.files import ChangedOnDisk
from annotations.documents.recovery import Recovery, discard, find_recoveries
from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotations.geometry.frames import Vector, vector
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tools
from annotations.volumes import Level, LevelCache, Ray, Volume
from annotator import placing
from annotator.autosave import Autosave
from annotator.commands import EditCommand
from annotator.document_file import DocumentFile
from annotator.jobs import Jobs
from annotator.level_loader import LevelLoader
from annotator.opening import Opened
from annotator.pick_refiner import PickRefiner
from annotator.session_options import SessionOptions
from annotator.view import Layer, Mode, Preview, View
from annotator.volume_opener import VolumeOpener
from annotator.worklist import WorkItem, Worklist, item_of_document, read_worklist


class Session(QObject):
    """Everything that is open in one window, and the only way to change it.

    Attributes
    ----------
    jobs : Jobs
        Long work in the background.
    undo_stack : QUndoStack
        The edits of the open document; looking around is never on it.

    Signals
    -------
    worklist_changed
        ``items`` or ``current_index`` changed.
    volume_changed
        Another volume is open, or none; document, view and levels are already the new ones.
    levels_changed
        ``level`` or ``slice_level`` changed.
    document_changed : Annotation or None, Annotation or None
        Before and after.
    view_changed : View, View
        Before and after.
    save_state_changed
        ``unsaved`` or ``annotation_path`` changed.
    message_posted : str
        For the status bar.
    error_raised : UserError
        For a dialog.
    spacing_requested, dataset_requested
        See `VolumeOpener`; answer with `provide_spacing`, `provide_dataset` or `cancel_opening`.
    recovery_requested : tuple of Recovery
        Left by a program that died: answer each with `recover` or `discard_recovery`.
    overwrite_requested : str
        Another program changed the file: answer with ``save(overwrite=True)``, `reload` or `save_as`.
    """

    worklist_changed = Signal()
    volume_changed = Signal()
    levels_changed = Signal()
    document_changed = Signal(object, object)
    view_changed = Signal(object, object)
    save_state_changed = Signal()
    message_posted = Signal(str)
    error_raised = Signal(object)
    spacing_requested = Signal(object, object)
    dataset_requested = Signal(object, object)
    recovery_requested = Signal(object)
    overwrite_requested = Signal(str)

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._options = options
        self._worklist = Worklist("", Path(), ())
        self._current_index: int | None = None
        self._opened: Opened | None = None
        self._document: Annotation | None = None
        self._view = View()
        self._averaged: Level | None = None
        self._detail: Level | None = None
        self._file: DocumentFile | None = None
        self._recovering: Recovery | None = None
        self._save_failed = False
        self.jobs = Jobs(self)
        self.undo_stack = QUndoStack(self)
        self.undo_stack.cleanChanged.connect(self._on_undo_stack_clean_changed)
        self._autosave = Autosave(options.autosave_s, self)
        self._autosave.save_requested.connect(self._on_autosave_save_requested)
        self._autosave.failed.connect(self.error_raised)
        self._opener = VolumeOpener(
            self.jobs,
            lambda: self.annotator_name,
            options.spacing_override_um,
            options.remembered_spacing,
            options.remember_spacing,
            self,
        )
        self._opener.opened.connect(self._on_opener_opened)
        self._opener.failed.connect(self._on_opener_failed)
        self._opener.spacing_requested.connect(self.spacing_requested)
        self._opener.dataset_requested.connect(self.dataset_requested)
        cache = LevelCache(options.level_cache_folder, options.cache_limit_bytes)
        self._levels = LevelLoader(self.jobs, cache, self)
        self._levels.averaged_loaded.connect(self._on_levels_averaged_loaded)
        self._levels.detail_loaded.connect(self._on_levels_detail_loaded)
        self._levels.failed.connect(self._raise_error)
        self._refiner = PickRefiner(self.jobs, self)
        self._refiner.ray_refined.connect(self._on_refiner_ray_refined)
        self._refiner.snapped.connect(self._on_refiner_snapped)
        self._refiner.failed.connect(self._raise_error)

    # What is open

    @property
    def items(self) -> tuple[WorkItem, ...]:
        """The volumes to annotate."""
        return self._worklist.items

    @property
    def current_index(self) -> int | None:
        """Index in ``items`` of the open volume."""
        return self._current_index

    @property
    def title(self) -> str:
        """Name of the study or folder."""
        return self._worklist.title

    @property
    def volume(self) -> Volume | None:
        """The open volume."""
        return self._opened.found.volume if self._opened else None

    @property
    def spacing_um(self) -> Vector | None:
        """Spacing of the open volume in µm."""
        return self._opened.spacing_um if self._opened else None

    @property
    def spacing_note(self) -> str:
        """Where the spacing comes from, in words."""
        return self._opened.spacing_note if self._opened else ""

    @property
    def tool(self) -> ToolSpecification | None:
        """The tool of the open document."""
        return self._opened.found.tool if self._opened else None

    @property
    def document(self) -> Annotation | None:
        """The open document as of the last edit."""
        return self._document

    @property
    def view(self) -> View:
        """How the volume is looked at."""
        return self._view

    @property
    def slice_level(self) -> Level | None:
        """The best level of the whole volume so far."""
        return self._averaged or (self._opened.level if self._opened else None)

    @property
    def level(self) -> Level | None:
        """What the scene shows: the detail where it is wanted and there, else the whole volume."""
        return self._detail if self._view.detail and self._detail is not None else self.slice_level

    @property
    def annotator_name(self) -> str:
        """Whose annotations are made."""
        return self._options.annotator_name

    @property
    def tool_name(self) -> str:
        """The tool of new documents: the study's, or the one chosen."""
        return self._worklist.tool_name or self._options.tool_name

    @property
    def annotation_path(self) -> Path | None:
        """Where the open document is kept."""
        return self._file.path if self._file else None

    @property
    def unsaved(self) -> bool:
        """Whether the document has edits that are not in its file (they are in the recovery journal)."""
        return not self.undo_stack.isClean()

    @property
    def active_seconds(self) -> float:
        """Time spent at work on the open document, in seconds."""
        return self._file.active_seconds if self._file else 0.0

    def shown_positions_um(self) -> Mapping[str, Vector]:
        """Return the document's positions in µm by keypoint, with the preview drawn in."""
        positions = dict(self._document.positions_um) if self._document else {}
        if self._view.preview is not None:
            positions[self._view.preview.keypoint] = self._view.preview.position_um
        return positions

    def tools(self) -> Mapping[str, ToolSpecification]:
        """Return the tools that can be chosen, by name; ToolError where their files are wrong."""
        return find_tools(self._tool_folders())

    # Opening and closing

    def open_path(self, path: Path) -> None:
        """Open a study, an annotation, a folder of volumes or a volume; errors come as ``error_raised``."""
        annotator = self.annotator_name
        self.jobs.start(
            f"Looking at {path.name}",
            lambda _progress, _cancelled: read_worklist(path, annotator),
            done=self._on_worklist_read,
            failed=self._raise_error,
        )

    def open_item(self, index: int) -> None:
        """Save what is open and open another item."""
        if self.close_volume():
            self._set_worklist(self._worklist, index)
            self._opener.open(self.items[index], self.tool_name, self._tool_folders())

    def next_volume(self) -> None:
        """Open the next item."""
        self._step(1)

    def previous_volume(self) -> None:
        """Open the previous item."""
        self._step(-1)

    def provide_dataset(self, name: str) -> None:
        """Answer ``dataset_requested``."""
        self._opener.provide_dataset(name)

    def provide_spacing(self, spacing_um: Vector, remember: bool = True) -> None:
        """Answer ``spacing_requested``."""
        self._opener.provide_spacing(spacing_um, remember=remember)

    def cancel_opening(self) -> None:
        """Open nothing after all."""
        self._opener.cancel()
        self._recovering = None
        self._set_worklist(self._worklist, None)

    def choose_tool(self, name: str) -> None:
        """Use another tool for new documents, and for the open one if nothing is placed in it yet."""
        self._options = replace(self._options, tool_name=name)
        index = self._current_index
        if self._document is None or index is None or self._document.tool == name:
            return
        if self._document.positions_um or self.unsaved:
            self.message_posted.emit(
                f"This annotation stays with {self._document.tool}: keypoints are placed"
            )
        elif self._file is not None and self._file.path.exists():
            self.message_posted.emit(f"The annotation on disk stays with {self._document.tool}")
        else:
            self.open_item(index)

    def set_annotator_name(self, name: str) -> None:
        """Annotate as another person from the next opening on."""
        self._options = replace(self._options, annotator_name=name)

    def set_autosave(self, seconds: float) -> None:
        """Change how soon an edit is written to the annotation's file; 0 leaves saving to the person."""
        self._autosave.set_save_after(seconds)

    def close_volume(self) -> bool:
        """Save and close what is open; False if it could not be saved, and then it stays open."""
        if self.unsaved and not self.save():
            return False
        self.abandon()
        return True

    def abandon(self) -> None:
        """Close what is open without saving; unsaved edits stay in the recovery journal for the next start."""
        self._opener.cancel()
        self._levels.cancel()
        self._refiner.cancel()
        if self._opened is None:
            return
        if self._file is not None:
            self._file.close(nothing_left=not self.unsaved)
        self._install(None)

    def shut_down(self) -> None:
        """End all background work; call it last."""
        self.abandon()
        self.jobs.close()

    # Recovery

    def offer_recoveries(self) -> None:
        """Look for what a dead program left behind, and ask about it."""
        if recoveries := find_recoveries(self._options.recovery_folder):
            self.recovery_requested.emit(recoveries)

    def recover(self, recovery: Recovery) -> None:
        """Open the document of a recovery, with its unsaved edits as one edit that can be undone."""
        if not self.close_volume():
            return
        item = item_of_document(recovery.document, recovery.annotation_path)
        self._recovering = recovery
        known = [
            index for index, other in enumerate(self.items) if other.annotation_path == item.annotation_path
        ]
        if known:
            self._set_worklist(self._worklist.with_item(known[0], item), known[0])
        else:
            self._set_worklist(Worklist(item.label, recovery.annotation_path.parent, (item,)), 0)
        self._opener.open(item, recovery.document.tool, self._tool_folders())

    def discard_recovery(self, recovery: Recovery) -> None:
        """Delete what a dead program left behind."""
        discard(recovery.journal_path)

    # Looking: never on the undo stack

    def look(self, **changes: object) -> None:
        """Change how the volume is looked at; the names are those of `View`, TypeError for others."""
        wanted = replace(self._view, **changes)  # type: ignore[arg-type]
        if self.volume is not None and self.spacing_um is not None:
            crosshair_um = placing.clipped_crosshair(wanted.crosshair_um, self.volume.shape, self.spacing_um)
            wanted = replace(wanted, crosshair_um=crosshair_um)
        before, self._view = self._view, wanted
        if before == wanted:
            return
        self._note_activity()
        self.view_changed.emit(before, wanted)
        if before.detail != wanted.detail:
            self._detail = None
            self.levels_changed.emit()
        if wanted.detail and (self._detail is None or before.active_keypoint != wanted.active_keypoint):
            self._load_detail()

    def activate(self, keypoint: str | None, *, jump: bool = False) -> None:
        """Choose the keypoint that the next click places; ``jump`` brings the crosshair to it."""
        position_um = self.shown_positions_um().get(keypoint or "")
        changes: dict[str, object] = {"active_keypoint": keypoint}
        preview = self._view.preview
        if preview is not None and preview.keypoint != keypoint:
            changes["preview"] = None
        if jump and position_um is not None:
            changes["crosshair_um"] = position_um
        self.look(**changes)

    def activate_next_unplaced(self) -> None:
        """Choose the next keypoint without a position, counted from the active one."""
        if (name := self._next_unplaced()) is not None:
            self.activate(name)
        elif self._document is not None:
            self.message_posted.emit("All keypoints are placed")

    def set_mode(self, mode: Mode) -> None:
        """Say whether clicks place keypoints."""
        self.look(mode=mode, preview=None)

    def toggle_layer(self, layer: Layer) -> None:
        """Show or hide a layer."""
        self.look(layers=self._view.layers ^ {layer})

    # Placing

    def place(self, position_um: Vector, source: Source = "clicked", keypoint: str | None = None) -> None:
        """Give a keypoint, by default the active one, a position; then the next unplaced one is active."""
        name = keypoint or self._view.active_keypoint
        if name is None or self._document is None:
            self.message_posted.emit("Choose a keypoint first: a number key, or its row in the table")
            return
        fresh = name not in self._document.positions_um
        placed = self._edit(
            f"{'Place' if fresh else 'Move'} {name}",
            lambda document: edits.place_keypoint(document, name, vector(position_um), source),
        )
        self.look(preview=None, crosshair_um=vector(position_um) if placed else self._view.crosshair_um)
        following = self._next_unplaced()
        if placed and fresh and name == self._view.active_keypoint and following is not None:
            self.activate(following)

    def begin_preview(self, keypoint: str, position_um: Vector, source: Source) -> None:
        """Show a keypoint where a drag has brought it; the document changes when it is kept."""
        if self._document is None:
            return
        if self._document.keypoint(keypoint).locked:
            self._refuse(EditRefused(f"keypoint {keypoint} is locked", remedy="Unlock it to move it"))
            return
        self.look(preview=Preview(keypoint, vector(position_um), source), active_keypoint=keypoint)

    def keep_preview(self) -> None:
        """Put the previewed position into the document: one edit."""
        if (preview := self._view.preview) is not None:
            self.place(preview.position_um, preview.source, preview.keypoint)

    def drop_preview(self) -> None:
        """Forget the previewed position; nothing has changed."""
        self.look(preview=None)

    def pick_ray(self, ray: Ray) -> None:
        """Take a click in the scene: propose a depth, or settle a proposal's depth by a ray from another angle."""
        name = self._view.active_keypoint
        if name is None or self._document is None or self.level is None:
            self.message_posted.emit("Choose a keypoint first: a number key, or its row in the table")
            return
        if self._document.keypoint(name).locked:
            self._refuse(EditRefused(f"keypoint {name} is locked", remedy="Unlock it to move it"))
            return
        preview = self._view.preview
        if preview is not None and preview.keypoint == name and preview.ray is not None:
            settled = placing.settle(preview.ray, ray)
            if settled.position_um is not None:
                self.place(settled.position_um, "clicked", name)
                return
            self.message_posted.emit(f"Depth not settled: {settled.reason}")
        position_um = placing.depth_along_ray(self.level, ray, self._view)
        if position_um is None:
            self.message_posted.emit("Nothing above the opacity threshold lies under the click")
            return
        self.look(preview=Preview(name, position_um, "clicked", ray), crosshair_um=position_um)
        self._refine(position_um, ray)

    def look_along_ray(self, ray: Ray) -> None:
        """Bring the crosshair to what a click in the scene meets; no keypoint moves."""
        if self.level is not None:
            position_um = placing.depth_along_ray(self.level, ray, self._view)
            if position_um is not None:
                self.look(crosshair_um=position_um)

    def nudge(self, axis: int, voxels: int) -> None:
        """Move the active keypoint along an axis by whole voxels."""
        name = self._view.active_keypoint
        if name is None or self._document is None or self.spacing_um is None:
            return
        position_um = self.shown_positions_um().get(name)
        if position_um is None:
            self.message_posted.emit(f"{name} is not placed yet")
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
            self.look(preview=None, active_keypoint=keypoint, crosshair_um=typed_um)

    def snap(self, to: Literal["maximum", "edge"]) -> None:
        """Move the active keypoint to the brightest voxel or strongest edge near it, once it is found."""
        name = self._view.active_keypoint
        position_um = self._document.positions_um.get(name or "") if self._document else None
        if name is None or position_um is None or self.volume is None or self.spacing_um is None:
            self.message_posted.emit("Place the keypoint before snapping it")
            return
        self._refiner.snap(self.volume, self.spacing_um, name, position_um, to)

    # Saying more about a keypoint, and about the whole

    def set_state(self, keypoint: str, state: State) -> None:
        """Say how a keypoint is seen."""
        words = state.replace("_", " ")
        self._edit(f"Mark {keypoint} {words}", lambda document: edits.set_state(document, keypoint, state))

    def set_certainty(self, keypoint: str, certainty: Certainty) -> None:
        """Say whether the annotator is sure of a keypoint."""
        self._edit(
            f"Mark {keypoint} {certainty}",
            lambda document: edits.set_certainty(document, keypoint, certainty),
        )

    def set_locked(self, keypoint: str, locked: bool) -> None:
        """Protect a keypoint from changes, or release it."""
        self._edit(
            f"{'Lock' if locked else 'Unlock'} {keypoint}",
            lambda document: edits.lock_keypoint(document, keypoint, locked),
        )

    def clear(self, keypoint: str) -> None:
        """Remove a keypoint's position."""
        self._edit(f"Clear {keypoint}", lambda document: edits.clear_keypoint(document, keypoint))

    def set_status(self, status: Status) -> None:
        """Mark the document as done, which saves it, or as in progress."""
        words = status.replace("_", " ")
        if self._edit(f"Mark as {words}", lambda document: edits.set_status(document, status)):
            self.save()

    # Saving

    def save(self, *, overwrite: bool = False) -> bool:
        """Write the document's file; False if that failed, and then a signal has said why."""
        return self._save(overwrite=overwrite, path=None)

    def save_as(self, path: Path) -> bool:
        """Write the document to another file, which is its own from then on."""
        return self._save(overwrite=True, path=path)

    def reload(self) -> None:
        """Read the document from its file again; unsaved edits are given up."""
        if self._current_index is not None and self._file is not None:
            self.undo_stack.setClean()
            self.abandon()
            self._opener.open(self.items[self._current_index], self.tool_name, self._tool_folders())

    def _save(self, *, overwrite: bool, path: Path | None) -> bool:
        if self._document is None or self._file is None:
            return True
        try:
            self._file.save(self._document, overwrite=overwrite, path=path)
        except ChangedOnDisk as error:
            self.overwrite_requested.emit(str(error))
            return False
        except SaveError as error:
            # Said once, not at every attempt of the timer.
            if not self._save_failed:
                self.error_raised.emit(error)
            self._save_failed = True
            return False
        self._save_failed = False
        self._autosave.watch(self._file)
        self.undo_stack.setClean()
        self._refresh_item()
        self.save_state_changed.emit()
        return True

    def _edit(self, text: str, edit: Callable[[Annotation], Annotation]) -> bool:
        """Make one pure edit and push it; False if it was refused."""
        if self._document is None:
            return False
        try:
            after = edit(self._document)
        except EditRefused as error:
            self._refuse(error)
            return False
        if after is not self._document:
            self.undo_stack.push(EditCommand(text, self._document, after, self._show_document))
        return True

    def _show_document(self, document: Annotation) -> None:
        before, self._document = self._document, document
        self._note_activity()
        # First on disk, then on the screen: whatever a view does next, the edit is safe.
        self._autosave.record(document)
        self.document_changed.emit(before, document)
        if before is not None and before.status != document.status:
            self._refresh_item()

    def _refuse(self, error: EditRefused) -> None:
        self.message_posted.emit(str(error))

    def _note_activity(self) -> None:
        if self._file is not None:
            self._file.note_activity()

    def _next_unplaced(self) -> str | None:
        if self._document is None:
            return None
        names = [keypoint.name for keypoint in self._document.keypoints]
        active = self._view.active_keypoint
        begin = names.index(active) + 1 if active in names else 0
        placed = self._document.positions_um
        return next((name for name in names[begin:] + names[:begin] if name not in placed), None)

    def _tool_folders(self) -> tuple[Path, ...]:
        return (self._worklist.folder / "tools", self._options.user_tool_folder)

    def _step(self, by: int) -> None:
        index = (self._current_index if self._current_index is not None else -by) + by
        if 0 <= index < len(self.items):
            self.open_item(index)
        else:
            self.message_posted.emit("There is no next volume" if by > 0 else "There is no previous volume")

    def _set_worklist(self, worklist: Worklist, index: int | None) -> None:
        self._worklist, self._current_index = worklist, index
        self.worklist_changed.emit()

    def _refresh_item(self) -> None:
        index = self._current_index
        if index is None or self._document is None or self._file is None:
            return
        item = replace(self.items[index], status=self._document.status, annotation_path=self._file.path)
        if item != self.items[index]:
            self._set_worklist(self._worklist.with_item(index, item), index)

    def _install(self, opened: Opened | None) -> None:
        """Make another volume, or none, the open one; every property has changed when the signals come."""
        before_view, before_document = self._view, self._document
        self._averaged = self._detail = None
        self._save_failed = False
        self._opened = opened
        self._file = None
        if opened is None:
            self._document = None
            self._view = replace(before_view, active_keypoint=None, preview=None, cropping_um=None)
        else:
            item = opened.found.item
            self._document = opened.document
            self._file = DocumentFile(
                item.annotation_path,
                item.volume_path,
                opened.found.identity,
                self._options.recovery_folder,
                opened.document.active_seconds,
            )
            self._view = self._first_view(opened)
        self._autosave.watch(self._file)
        self.undo_stack.clear()
        self.volume_changed.emit()
        self.levels_changed.emit()
        self.document_changed.emit(before_document, self._document)
        self.view_changed.emit(before_view, self._view)
        self.save_state_changed.emit()

    def _first_view(self, opened: Opened) -> View:
        unplaced = self._next_unplaced()
        shape = opened.found.volume.shape
        middle_um = vector(
            [(size - 1) / 2 * step for size, step in zip(shape, opened.spacing_um, strict=True)]
        )
        low, high = opened.window
        return replace(
            self._view,
            crosshair_um=middle_um,
            active_keypoint=unplaced or opened.document.keypoints[0].name,
            preview=None,
            window=opened.window,
            opacity_threshold=low + 0.25 * (high - low),
            cropping_um=None,
            detail=False,
        )

    def _load_detail(self) -> None:
        if self.volume is not None and self.spacing_um is not None:
            centre_um = self.shown_positions_um().get(
                self._view.active_keypoint or "", self._view.crosshair_um
            )
            self._levels.load_detail(self.volume, self.spacing_um, centre_um)

    def _refine(self, position_um: Vector, ray: Ray) -> None:
        if self.volume is not None and self.spacing_um is not None and self.level is not None:
            self._refiner.refine_ray(
                self.volume, self.spacing_um, self.level.spacing_um, position_um, ray, self._view
            )

    def _raise_error(self, error: Exception) -> None:
        if isinstance(error, UserError):
            self.error_raised.emit(error)
        else:
            # Not foreseen: the window's log takes it, with its traceback.
            raise error

    def _on_worklist_read(self, worklist: Worklist) -> None:
        if not self.close_volume():
            return
        self._set_worklist(worklist, None)
        if worklist.items:
            self.open_item(worklist.first)

    def _on_opener_opened(self, opened: Opened) -> None:
        try:
            self._install(opened)
        except SaveError as error:
            self._opened = None
            self._install(None)
            self.error_raised.emit(error)
            return
        self._levels.load_averaged(opened.found.volume, opened.spacing_um)
        for warning in opened.warnings:
            self.error_raised.emit(warning)
        if (recovery := self._recovering) is not None:
            self._recovering = None
            self._edit("Recover unsaved edits", lambda _document: recovery.document)
            discard(recovery.journal_path)

    def _on_opener_failed(self, error: Exception) -> None:
        self._recovering = None
        self._set_worklist(self._worklist, None)
        self._raise_error(error)

    def _on_levels_averaged_loaded(self, level: Level) -> None:
        self._averaged = level
        self.levels_changed.emit()

    def _on_levels_detail_loaded(self, level: Level) -> None:
        if self._view.detail:
            self._detail = level
            self.levels_changed.emit()

    def _on_refiner_ray_refined(self, proposed_um: Vector, ray: Ray, position_um: Vector) -> None:
        preview = self._view.preview
        if preview is not None and preview.ray is ray and preview.position_um == proposed_um:
            self.look(preview=replace(preview, position_um=position_um), crosshair_um=position_um)

    def _on_refiner_snapped(self, name: str, began_um: Vector, position_um: Vector) -> None:
        # The keypoint may have moved on while the voxels were read.
        if self._document is not None and self._document.positions_um.get(name) == began_um:
            if self._edit(
                f"Snap {name}",
                lambda document: edits.place_keypoint(document, name, position_um, "snapped"),
            ):
                self.look(crosshair_um=position_um)

    def _on_autosave_save_requested(self) -> None:
        if self.unsaved:
            self.save()

    def _on_undo_stack_clean_changed(self, _clean: bool) -> None:
        self.save_state_changed.emit()
