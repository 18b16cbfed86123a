"""The state of a session: what is open and how it is looked at. The only signals of state."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from annotations.documents.annotation import Annotation, is_untouched
from annotations.documents.edits import EditRefused
from annotations.documents.provenance import NO_STAMPS, Viewing
from annotations.documents.record import Method
from annotations.documents.study import CONSENSUS
from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tools
from annotations.volumes import Level, LevelCache, Volume
from annotator.session.documents.autosave import Autosave
from annotator.session.documents.document_file import DocumentFile
from annotator.session.documents.undo_stack import UndoStack
from annotator.session.jobs import Jobs
from annotator.session.neutral_words import NeutralWords
from annotator.session.options import SessionOptions
from annotator.session.remembered import Remembered
from annotator.session.viewing import placing
from annotator.session.viewing.on_its_way import drawn_in, shown_positions_um
from annotator.session.viewing.view import View
from annotator.session.volumes.level_loader import LevelLoader
from annotator.session.volumes.opening import Opened
from annotator.session.volumes.worklist import WorkItem, Worklist


class SessionState(QObject):
    """Everything that is open in one window, each thing once, and the signals that announce its changes.

    `SessionEditing` changes the document, `Session` opens and saves it.

    Attributes
    ----------
    jobs : Jobs
        Long work in the background.
    undo_stack : UndoStack
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
        ``unsaved``, ``annotation_path`` or ``read_only_reason`` changed.
    message_posted : str
        For the status bar.
    error_raised : UserError
        For a dialog.
    spacing_requested, dataset_requested
        See `VolumeOpener`; answer with `provide_spacing`, `provide_dataset` or `decline_opening`.
    recovery_requested : tuple of Recovery
        Left by a program that died: answer each with `recover` or `discard_recovery`.
    look_requested : Path, str
        The path asked for is another person's annotation, and this is why it is not for the annotator's eyes
        yet: answer with ``open_path(path, looks_anyway=True)`` or not at all.
    takeover_requested : LockHolder
        The document is read-only because of a computer that says nothing: answer with `take_over` or not.
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
    look_requested = Signal(object, str)
    takeover_requested = Signal(object)
    overwrite_requested = Signal(str)

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._options = options
        self._worklist = Worklist(Path(), "", Path(), (), options.annotator_name, method=options.method)
        self._current_index: int | None = None
        self._opened: Opened | None = None
        self._document: Annotation | None = None
        self._view = View()
        self._shown: Remembered[Annotation | None] = Remembered()
        self._shown_positions_um: Remembered[Mapping[str, Vector]] = Remembered()
        self._words: Remembered[NeutralWords] = Remembered()
        self._file: DocumentFile | None = None
        self._proposed: Annotation | None = None
        self._read_only_reason = ""
        self._more_follows = False
        self.jobs = Jobs(self)
        self.undo_stack = UndoStack(lambda: self._document, self._show_document, self)
        self.undo_stack.clean_changed.connect(self._on_undo_stack_clean_changed)
        self._autosave = Autosave(options.autosave_s, self)
        self._autosave.failed.connect(self.report)
        cache = LevelCache(options.level_cache_folder, options.cache_limit_bytes)
        self._levels = LevelLoader(self.jobs, cache, self)
        self._levels.loaded.connect(self.levels_changed)
        self._levels.averaged_failed.connect(self._raise_error)
        self._levels.detail_failed.connect(self._on_levels_detail_failed)

    # What is open

    @property
    def more_follows(self) -> bool:
        """Whether the signal that is being sent is not the last one of a change: ``worklist_changed`` is.

        All properties are the new ones already. Who draws the same for several signals may wait for the last.
        """
        return self._more_follows

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
    def is_blind(self) -> bool:
        """Whether the annotator is to know the volumes by their numbers alone."""
        return self._worklist.is_blind

    @property
    def volume_label(self) -> str:
        """What the open volume is called: by the name of its file, in blind work by its number."""
        index = self._current_index
        if self.is_blind and index is not None:
            return self.items[index].label
        return self.volume.path.name if self.volume is not None else ""

    @property
    def volume(self) -> Volume | None:
        """The open volume."""
        return self._opened.found.volume if self._opened else None

    @property
    def volume_fingerprint(self) -> str | None:
        """What the open volume is recognised by, as its file was when it was opened."""
        return self._opened.found.fingerprint if self._opened else None

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
        return self._levels.averaged or (self._opened.level if self._opened else None)

    @property
    def level(self) -> Level | None:
        """What the scene shows: the detail where it is wanted and there, else the whole volume."""
        detail = self._levels.detail if self._view.detail else None
        return detail or self.slice_level

    @property
    def method(self) -> Method:
        """How the items are annotated: by keypoints or by boxes."""
        return self._worklist.method

    @property
    def methods(self) -> tuple[Method, ...]:
        """The methods that can be chosen: the study's, or both."""
        return self._worklist.methods

    @property
    def annotator_name(self) -> str:
        """Whose annotations the items' files are."""
        return self._worklist.annotator

    @property
    def person(self) -> str:
        """Who works here: also where what is open is somebody else's, or the study's consensus."""
        return self._options.annotator_name

    @property
    def tool_folders(self) -> tuple[Path, ...]:
        """Where tools are looked for before those that ship: the study's own, and the user's."""
        return self._tool_folders(self._worklist)

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
        return not self.undo_stack.is_clean or (self._file is not None and self._file.owes_stamps)

    @property
    def is_mere_proposal(self) -> bool:
        """Whether the document is a consensus that was only proposed: left so, it is not saved."""
        document, file = self._document, self._file
        if document is None or file is None or not file.is_new or document.annotator != CONSENSUS:
            return False
        return document == self._proposed or is_untouched(document)

    def expect_proposal(self, proposed: Annotation) -> None:
        """Know a document, before it is shown, for one in which a reviewer has decided nothing."""
        if self._document is not None and (self.is_mere_proposal or is_untouched(self._document)):
            self._proposed = proposed

    @property
    def review(self) -> tuple[str, datetime] | None:
        """Who changed the open consensus last, and when that was saved."""
        stamps = self._file.stamps if self._file else NO_STAMPS
        return (
            None if stamps.reviewer is None or stamps.reviewed is None else (stamps.reviewer, stamps.reviewed)
        )

    @property
    def worklist(self) -> Worklist:
        """The items, and the study or folder that they belong to."""
        return self._worklist

    @property
    def viewings(self) -> tuple[Viewing, ...]:
        """What of other people's work was shown to the annotator of the open document."""
        return self._file.stamps.viewings if self._file else ()

    @property
    def read_only_reason(self) -> str:
        """Why the open document cannot be changed here, as a sentence without its full stop; else empty."""
        return self._read_only_reason

    @property
    def active_seconds(self) -> float:
        """Time spent at work on the open document, in seconds."""
        return self._file.stamps.active_seconds if self._file else 0.0

    @property
    def shown_document(self) -> Annotation | None:
        """The document with what is on its way drawn in: a draft, or the preview of a keypoint."""
        return self._shown.result(drawn_in, self._document, self._view.draft, self._view.preview)

    def shown_positions_um(self) -> Mapping[str, Vector]:
        """Return the positions in µm of the shown keypoints, by name; those of boxes are at their ends."""
        return self._shown_positions_um.result(
            shown_positions_um, self.shown_document, self.tool, self._view.preview
        )

    def shown_anchor_um(self, name: str) -> Vector | None:
        """Return where to look for a keypoint or a link's box, in µm; None where it has no place."""
        position_um = self.shown_positions_um().get(name)
        if position_um is None and self.shown_document is not None:
            parts = self.shown_document.parts
            position_um = next((part.anchor_um for part in parts if part.name == name), None)
        return position_um

    def tools(self) -> Mapping[str, ToolSpecification]:
        """Return the tools that can be chosen, by name; ToolError where their files are wrong."""
        return find_tools(self._tool_folders(self._worklist))

    def post_message(self, text: str) -> None:
        """Say something in the status line; in blind work in neutral words."""
        self.message_posted.emit(self.neutral(text))

    def report(self, error: UserError) -> None:
        """Show an error to the person; in blind work in neutral words."""
        self.error_raised.emit(self._neutral_words().error(error))

    def neutral(self, text: str) -> str:
        """Return a text as the annotator may read it: in blind work no volume's name or path is in it.

        `post_message` and `report` see to that by themselves.
        """
        return self._neutral_words().text(text)

    # Looking: never on the undo stack

    def look(self, **changes: object) -> None:
        """Change how the volume is looked at; the names are those of `View`, TypeError for others."""
        wanted = self._without_edits(replace(self._view, **changes))  # type: ignore[arg-type]
        if self.volume is not None and self.spacing_um is not None:
            crosshair_um = placing.clipped_crosshair(wanted.crosshair_um, self.volume.shape, self.spacing_um)
            wanted = replace(wanted, crosshair_um=crosshair_um)
        before, self._view = self._view, wanted
        if before == wanted:
            return
        self._note_activity()
        self.view_changed.emit(before, wanted)
        if before.detail != wanted.detail:
            self._levels.forget_detail()
            self.levels_changed.emit()
        if wanted.detail and (before.detail, before.active_part) != (True, wanted.active_part):
            self._load_detail()

    def _tool_folders(self, worklist: Worklist) -> tuple[Path, ...]:
        return (worklist.folder / "tools", self._options.user_tool_folder)

    def _edit(self, text: str, edit: Callable[[Annotation], Annotation]) -> bool:
        """Make one pure edit and push it; False if it was refused."""
        if self._document is None or self._is_refused():
            return False
        try:
            after = edit(self._document)
        except EditRefused as error:
            self._refuse(error)
            return False
        if after is not self._document:
            self.undo_stack.push(text, self._document, after)
        return True

    def _is_refused(self) -> bool:
        """Say whether nothing can be changed here, and tell the person."""
        if self._read_only_reason:
            self._refuse(EditRefused(self._read_only_reason))
        return bool(self._read_only_reason)

    def _without_edits(self, wanted: View) -> View:
        """Return a view without what is on its way to a document that cannot be changed."""
        if not wanted.is_anything_on_its_way or not self._is_refused():
            return wanted
        return replace(wanted, preview=None, draft=None, first_end_um=None, refinement=None)

    def _show_document(self, document: Annotation) -> None:
        before, self._document = self._document, document
        # Whatever was on its way began from another document; a first click waits for its second one only as
        # long as there is a box to be placed.
        unplaced = {part.name for part in document.parts if part.anchor_um is None and not part.locked}
        first_end_um = self._view.first_end_um if self._view.active_part in unplaced else None
        settled = replace(self._view, draft=None, refinement=None, first_end_um=first_end_um)
        was, self._view = self._view, settled
        self._note_activity()
        # First on disk, then on the screen: whatever a view does next, the edit is safe.
        self._autosave.record(document)
        self.document_changed.emit(before, document)
        if was != settled:
            self.view_changed.emit(was, settled)
        self._refresh_item()

    def _refuse(self, error: EditRefused) -> None:
        self.post_message(str(error))

    def _note_activity(self) -> None:
        if self._file is not None:
            self._file.note_activity()

    def _refresh_item(self) -> None:
        index = self._current_index
        if index is None or self._document is None or self._file is None:
            return
        before = self.items[index]
        item = replace(
            before,
            status=before.status if self.is_mere_proposal else self._document.status,
            flag=self._document.flag,
            # Once saved: a list that is drawn anew with every second would take the time from the work.
            active_seconds=before.active_seconds if self.unsaved else self._file.stamps.active_seconds,
            annotation_path=self._file.path,
        )
        if item != before:
            self._set_worklist(self._worklist.with_item(index, item), index)

    def _set_worklist(self, worklist: Worklist, index: int | None) -> None:
        self._worklist, self._current_index = worklist, index
        self.worklist_changed.emit()

    def _load_detail(self) -> None:
        if self.volume is not None and self.spacing_um is not None:
            centre_um = self.shown_anchor_um(self._view.active_part or "") or self._view.crosshair_um
            self._levels.load_detail(self.volume, self.spacing_um, centre_um)

    def _neutral_words(self) -> NeutralWords:
        item = None if self._current_index is None else self.items[self._current_index]
        return self._words.result(NeutralWords, self._worklist, item)

    def _raise_error(self, error: Exception) -> None:
        if isinstance(error, UserError):
            self.report(error)
        else:
            # Not foreseen: the window's log takes it, with its traceback.
            raise error

    def _on_levels_detail_failed(self, error: Exception) -> None:
        self.look(detail=False)
        self._raise_error(error)

    def _on_undo_stack_clean_changed(self) -> None:
        self.save_state_changed.emit()
