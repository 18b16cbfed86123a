"""The session: opens and recovers what its bases edit, save and announce."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject

from annotations.documents.files import file_identity
from annotations.documents.record import Method
from annotations.documents.recovery import Recovery
from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotator.session.agreement.agreeing import Agreeing
from annotator.session.agreement.agreement_reporting import AgreementReporting
from annotator.session.agreement.calibrating import Calibrating
from annotator.session.agreement.others import Others
from annotator.session.agreement.settling import Settling
from annotator.session.documents.document_file import DocumentFile
from annotator.session.exporting import Exporting
from annotator.session.files.deriving import Deriving
from annotator.session.files.recovering import tells_more, worklist_of_recovery
from annotator.session.files.stepping import SessionStepping, skipped_words
from annotator.session.jobs import Job, Result
from annotator.session.neutral_words import NeutralWords
from annotator.session.options import SessionOptions
from annotator.session.predictions.checkpoints import Checkpoints
from annotator.session.predictions.judging import Judging
from annotator.session.predictions.living import Living
from annotator.session.predictions.predicted_volumes import PredictedVolumes
from annotator.session.predictions.predicting import Predicting
from annotator.session.predictions.reporting import Reporting
from annotator.session.predictions.reviewing import Reviewing
from annotator.session.studies import Studies
from annotator.session.volumes.first_view import first_view, nothing_open
from annotator.session.volumes.identifying import Identifying
from annotator.session.volumes.opening import Opened, OpeningRequest
from annotator.session.volumes.spacing_answer import SpacingAnswer
from annotator.session.volumes.study_paths import (
    IdentityNeeded,
    KeptFromView,
    LookNeeded,
    read_path,
)
from annotator.session.volumes.volume_opener import VolumeOpener
from annotator.session.volumes.worklist import Worklist, moved_with, read_worklist


class Session(SessionStepping):
    """Everything that is open in one window, and the only way to change it; signals: see `SessionState`."""

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(options, parent)
        self._looking: Job | None = None
        self.identifying = Identifying(self)
        self._opener = VolumeOpener(
            self.jobs,
            options.spacing_override_um,
            options.remembered_spacing,
            options.remember_spacing,
            self._claim_lock,
            self,
        )
        self._opener.opened.connect(self._on_opener_opened)
        self._opener.failed.connect(self._on_opener_failed)
        self._opener.spacing_requested.connect(self.spacing_requested)
        self._opener.dataset_requested.connect(self.dataset_requested)
        self.agreeing = Agreeing(self, options.user_tool_folder, self)
        self.agreement_reporting = AgreementReporting(self, self.agreeing, self)
        self.studies = Studies(self, self.reread_worklist, self._raise_error, options.user_tool_folder, self)
        self.calibrating = Calibrating(
            self, lambda: not self.agreeing.refusal, options.user_tool_folder, self._raise_error, self
        )
        self.deriving = Deriving(
            self, lambda: not self._is_refused() and self._is_saved(), self.set_method, self
        )
        self.others = Others(self, self.seeing, self.agreeing, self)
        self.settling = Settling(self, self.others, self._edit, self.open_list, self._raise_error, self)
        self.exporting = Exporting(self, self.agreeing, self)
        self.checkpoints = Checkpoints(self, self)
        self.predicting = Predicting(self, self.seeing, self._edit, self._opener.known_spacing, self)
        self.predicted_volumes = PredictedVolumes(self, self.predicting, self.seeing, self)
        self.living = Living(self, self.predicting, self.seeing, self.identifying.is_settled, self)
        self.reviewing = Reviewing(self, self.predicting, self.agreeing, self.open_item, self)
        self.judging = Judging(self, self.reviewing, self)
        self.reporting = Reporting(self, self.reviewing, self.judging, self.agreeing, self)

    # Opening and closing

    def open_path(self, path: Path, *, looks_anyway: bool = False) -> None:
        """Open a study, an annotation, a folder of volumes or a volume; errors come as ``error_raised``.

        ``looks_anyway`` answers ``look_requested`` with yes; `identify` answers ``identity_requested``. For a
        checkpoint nothing that is open is closed.
        """
        if self.checkpoints.takes(path):
            self.checkpoints.open(path)
            return
        annotator, method = self._options.annotator_name, self._options.method

        def on_failed(error: Exception) -> None:
            if isinstance(error, LookNeeded):
                self.look_requested.emit(path, error.problem)
            elif isinstance(error, IdentityNeeded):
                self.identifying.identity_requested.emit(path, error.folder, error.study)
            else:
                self._raise_error(error)

        asks = self.identifying.is_settled
        read = partial(read_path, path, annotator, method, looks_anyway=looks_anyway, is_settled=asks)
        self._look_at(read, partial(self._on_worklist_read, looks_anyway=looks_anyway), on_failed)

    def identify(self, path: Path, folder: Path, name: str) -> None:
        """Answer ``identity_requested``: a path in a study's folder is opened by whoever has that name."""
        self.identifying.confirm(folder, name)
        self._options = replace(self._options, annotator_name=name)
        self.open_path(path)

    def shown_anchor_um(self, name: str) -> Vector | None:
        """Return where to look for a part, in µm: where it is placed, else by others, else as predicted."""
        position_um = super().shown_anchor_um(name)
        if position_um is None:
            position_um = self.others.mean_um(name)
        shown = self.predicting.shown if position_um is None else None
        return shown.position_um(name) if shown is not None else position_um

    def open_item(self, index: int, *, skipped: Sequence[str] = ()) -> None:
        """Save what is open and open another item; what is open stays until the other one is ready."""
        self._open(self._destination()[0], index)
        self._skipped = tuple(skipped)

    def open_list(self, annotator: str, method: Method, volume_id: str | None) -> None:
        """Save what is open, and open somebody's list in the present study, at a volume or its first one."""
        folder = self._worklist.folder

        def on_read(worklist: Worklist) -> None:
            ids = [item.volume_id for item in worklist.items]
            if ids:
                self._open(worklist, ids.index(volume_id) if volume_id in ids else worklist.first)
            elif self.close_volume():
                self._set_worklist(worklist, None)

        self._look_at(lambda: read_worklist(folder, annotator, method), on_read)

    def reread_worklist(self) -> None:
        """Read the list anew, as its study or folder is by now; what is open stays open."""
        path, annotator, method = self._worklist.path, self._worklist.annotator, self._worklist.method
        self._look_at(lambda: read_path(path, annotator, method), self._on_worklist_reread)

    def provide_dataset(self, path: Path, name: str) -> None:
        """Answer ``dataset_requested`` for a file; ignored if another is being opened by now."""
        self._opener.provide_dataset(path, name)

    def provide_spacing(self, path: Path, answer: SpacingAnswer) -> None:
        """Answer ``spacing_requested`` for a file; ignored if another is being opened by now."""
        self._opener.provide_spacing(path, answer)

    @property
    def is_opening(self) -> bool:
        """Whether a document is being opened or read again, or a question about that waits for its answer."""
        return self._opener.request is not None

    @property
    def opening_label(self) -> str:
        """The number of the volume that is being opened in blind work; else empty, as it has a name."""
        request = self._opener.request
        return request.item.label if request is not None and request.worklist.is_blind else ""

    def decline_opening(self, path: Path) -> None:
        """Answer either question with no: the volume is not opened, and what is open stays."""
        self._opener.decline(path)

    def choose_tool(self, name: str) -> None:
        """Use another tool for new documents, and for the open one if nothing is placed in it yet."""
        self._options = replace(self._options, tool_name=name)
        index = self._current_index
        if self._document is None or index is None or self._document.tool == name:
            return
        if self.unsaved or any(part.anchor_um is not None for part in self._document.parts):
            self.post_message(
                f"This annotation stays with {self._document.tool}: {self._document.method} are placed"
            )
        elif self._file is not None and self._file.path.exists():
            self.post_message(f"The annotation on disk stays with {self._document.tool}")
        else:
            self.open_item(index)

    def set_method(self, method: Method) -> None:
        """Annotate by keypoints or by boxes: what is open is saved, and the volume's other file is opened."""
        if method not in self._worklist.methods:
            self.post_message(f"This study is annotated by {' and '.join(self._worklist.methods)}")
            return
        self._options = replace(self._options, method=method)
        worklist, _ = self._destination()
        if worklist.method == method:
            return
        if not worklist.items:
            self._set_worklist(worklist.with_method(method), None)
            return
        self._look_at(lambda: worklist.with_method(method), self._on_worklist_of_method_read)

    def set_annotator_name(self, name: str) -> None:
        """Annotate as another person: what is open is saved, and the list is read anew for that person."""
        if name == self._options.annotator_name:
            return
        self._options = replace(self._options, annotator_name=name)
        if self.items:
            self.open_path(self._worklist.path)
        else:
            self._set_worklist(replace(self._worklist, annotator=name), None)

    def close_volume(self) -> bool:
        """Save and close what is open; False if it could not be saved, and then it stays open."""
        if not self._is_saved():
            return False
        self.abandon()
        return True

    def abandon(self) -> None:
        """Close what is open without saving; unsaved edits stay in the journal for the next start."""
        self._opener.cancel()
        self._levels.forget()
        self._refiner.cancel()
        self._stop_refining()
        if self._opened is not None:
            self._close_file(nothing_left=not self.unsaved or self.is_mere_proposal)
            self._install(None)
        if self._current_index is not None:
            self._set_worklist(self._worklist, None)

    def shut_down(self) -> None:
        """End all background work; call it last."""
        self.abandon()
        self.predicting.close()
        self.living.close()
        self._locks.close()
        self.jobs.close()

    # Recovery

    def recover(self, recovery: Recovery) -> None:
        """Open the document of a recovery, with its unsaved edits as one edit that can be undone."""
        present = self._worklist
        path, person = moved_with(recovery.annotation_path, present), self._options.annotator_name

        self._look_at(
            lambda: worklist_of_recovery(recovery, path, present, person, self.identifying.is_settled),
            lambda worklist: self._open(
                worklist, worklist.first, recovery=replace(recovery, annotation_path=path)
            ),
        )

    def reload(self) -> None:
        """Read the document from its file again, and give up the unsaved edits once that has succeeded."""
        if self._current_index is not None:
            self._open(self._worklist, self._current_index, rereads=True)

    def _look_at(
        self,
        read: Callable[[], Result],
        done: Callable[[Result], None],
        failed: Callable[[Exception], None] | None = None,
    ) -> None:
        if self._looking is not None:
            # The last wish counts, not the slowest folder.
            self.jobs.cancel(self._looking)
        self._looking = self.jobs.start(
            # Not by its name: it may be one that is not to be known.
            "Looking at what is there",
            lambda _progress, _cancelled: read(),
            done=done,
            failed=failed or self._raise_error,
        )

    def _open(
        self,
        worklist: Worklist,
        index: int,
        *,
        recovery: Recovery | None = None,
        rereads: bool = False,
        looks_anyway: bool = False,
    ) -> None:
        self._skipped = ()
        if not rereads and not self._is_saved():
            return
        if self._opened is None:
            self._set_worklist(worklist, None)
        tool_name = worklist.tool_name or self._options.tool_name
        folders = self._tool_folders(worklist)
        self._opener.open(
            OpeningRequest(
                worklist,
                index,
                tool_name,
                folders,
                self.person,
                recovery=recovery,
                rereads=rereads,
                looks_anyway=looks_anyway,
            )
        )

    def _destination(self) -> tuple[Worklist, int | None]:
        """Return the list and the place that are being opened, if it has the same volumes; else what is open.

        So a second press goes on from where the first one leads, and by the same method.
        """
        waiting = self._opener.request
        if waiting is not None and waiting.worklist.has_volumes_of(self._worklist):
            return waiting.worklist, waiting.index
        return self._worklist, self._current_index

    def _install(self, opened: Opened | None) -> None:
        """Make another volume, or none, the open one; every property has changed when the signals come."""
        before_view, before_document = self._view, self._document
        self._autosave_failed = False
        self._opened = opened
        self._file = None
        if opened is None:
            self._unlock()
            self._document = None
            self._view = nothing_open(before_view)
        else:
            item, recovery = opened.found.item, opened.found.request.recovery
            self._lock(opened)
            self._document = opened.document
            self._take_fit(opened.document, opened.fit)
            self._file = DocumentFile(
                item.annotation_path,
                item.volume_path,
                opened.found.identity,
                self._options.recovery_folder,
                self.seeing.carried_over(recovery.document if recovery else opened.document),
                owes_stamps=recovery is not None and tells_more(recovery.document, opened.document),
                is_read_only=bool(self._read_only_reason),
            )
            self._view = first_view(before_view, opened)
        self._autosave.watch(self._file)
        self.undo_stack.clear()
        self.volume_changed.emit()
        self.levels_changed.emit()
        self.document_changed.emit(before_document, self._document)
        self.view_changed.emit(before_view, self._view)
        self.save_state_changed.emit()
        self._bring_tool()

    def _on_worklist_read(self, worklist: Worklist, looks_anyway: bool = False) -> None:
        if worklist.left_out:
            self.post_message(worklist.left_out)
        if worklist.items:
            self._open(worklist, worklist.first, looks_anyway=looks_anyway)
        elif self.close_volume():
            self._set_worklist(worklist, None)

    def _on_worklist_reread(self, worklist: Worklist) -> None:
        index = self._current_index
        places = [item.place for item in worklist.items]
        if index is None:
            self._set_worklist(worklist, None)
        elif self.items[index].place not in places:
            self.post_message("What is open is no longer in this list: open another volume")
        elif worklist.method != self._worklist.method:
            self._open(worklist, places.index(self.items[index].place))
        else:
            self._set_worklist(worklist, places.index(self.items[index].place))
            self._refresh_item()

    def _on_worklist_of_method_read(self, worklist: Worklist) -> None:
        # Meanwhile a person may have gone on to another volume, or closed this one.
        present, index = self._destination()
        if index is None:
            self._set_worklist(worklist, None)
        else:
            self._open(worklist, worklist.index_of(present.items[index]))

    def _on_opener_opened(self, opened: Opened) -> None:
        request = opened.found.request
        self._note_opened(request)
        if not request.rereads and not self._may_give_way_to(opened):
            return
        self._levels.forget()
        self._refiner.cancel()
        self._stop_refining()
        self._close_file(nothing_left=True)
        before, self._worklist, self._current_index = self._worklist, request.worklist, request.index
        refused: SaveError | None = None
        self._more_follows = True
        try:
            self._install(opened)
        except SaveError as error:
            refused = error
            self._opened, self._current_index = None, None
            self._install(None)
        finally:
            self._more_follows = False
        self.worklist_changed.emit()
        if refused is not None:
            self.report(refused)
            return
        self._levels.load_averaged(opened.found.volume, opened.spacing_um)
        said = self.identifying.words_for(request.worklist), _number_words(before, request)
        if words := ". ".join(filter(None, (*said, skipped_words(self._skipped)))):
            self.post_message(words)
        self._tell_of_lock()
        if request.looks_anyway:
            self.seeing.look_anyway()
        for warning in opened.warnings:
            self.report(warning)
        if request.recovery is not None:
            self._go_on_from(request.recovery)

    def _may_give_way_to(self, opened: Opened) -> bool:
        """Save what was edited while the other volume was read; False if the open document must stay."""
        if not self._is_saved():
            return False
        item = opened.found.item
        if self._file is None or self._file.path != item.annotation_path:
            return True
        # The open document itself, and what was read of its file may be older than the edits since.
        return file_identity(item.annotation_path) == opened.found.identity

    def _on_opener_failed(self, request: OpeningRequest, error: Exception) -> None:
        if isinstance(error, KeptFromView):
            self.post_message(error.problem)
            return
        self._note_unopened(request)
        # What is open stays; but of a study whose first volume is bad, a person wants to see the others.
        if request.worklist.is_folder and request.worklist is not self._worklist and self.close_volume():
            self._set_worklist(request.worklist, None)
        if isinstance(error, UserError):
            # It is about the volume that was to be opened, not about the one that is open.
            error = NeutralWords(request.worklist, request.item).error(error)
        self._raise_error(error)


def _number_words(before: Worklist, request: OpeningRequest) -> str:
    """Return which number a volume has by the method that has just been changed to, in blind work."""
    worklist = request.worklist
    if not worklist.is_blind or worklist.method == before.method or not worklist.has_volumes_of(before):
        return ""
    return f"By {worklist.method} this volume is number {request.index + 1} of your queue"
