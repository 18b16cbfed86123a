"""Opens volumes in the background, and stops to ask where only a person knows."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotations.volumes import DatasetChoiceNeeded, offered_spacing_um, write_folder_answer, write_sidecar
from annotator.session.jobs import Job, Jobs
from annotator.session.volumes import opening
from annotator.session.volumes.opening import Found, Opened, OpeningRequest
from annotator.session.volumes.spacing_answer import SpacingAnswer


class VolumeOpener(QObject):
    """One opening at a time; a new one takes the place of one that has not ended.

    Signals
    -------
    opened : Opened
    failed : OpeningRequest, Exception
    spacing_requested : Volume, (float, float, float)
        Nothing says the spacing: answer with `provide_spacing` or `decline`.
    dataset_requested : Path, tuple of DatasetChoice
        The file holds several arrays: answer with `provide_dataset` or `decline`.

    Answers name the volume's path: one for an opening that was superseded meanwhile is ignored.

    Parameters
    ----------
    spacing_override_um : (float, float, float) or None
        Said when the program was started.
    remembered_spacing, remember_spacing : callable
        Where answers are kept by the volume's fingerprint when its folder cannot be written.
    when_read : callable
        Called, in the thread that reads, with what is ready to be shown and still wanted.
    """

    opened = Signal(object)
    failed = Signal(object, object)
    spacing_requested = Signal(object, object)
    dataset_requested = Signal(object, object)

    def __init__(
        self,
        jobs: Jobs,
        spacing_override_um: Vector | None,
        remembered_spacing: Callable[[str], SpacingAnswer | None],
        remember_spacing: Callable[[str, SpacingAnswer], None],
        when_read: Callable[[Opened], None],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._spacing_override_um = spacing_override_um
        self._remembered_spacing = remembered_spacing
        self._remember_spacing = remember_spacing
        self._when_read = when_read
        self._job: Job | None = None
        self._request: OpeningRequest | None = None
        self._found: Found | None = None

    @property
    def request(self) -> OpeningRequest | None:
        """What is being opened."""
        return self._request

    def open(self, request: OpeningRequest) -> None:
        """Begin to open an item; ``opened`` or ``failed`` follows, or a question."""
        self.cancel()
        self._request = request
        self._job = self._jobs.start(
            f"Opening {request.item.label}",
            lambda _progress, _cancelled: opening.find(request),
            done=self._on_job_found,
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
        )

    def provide_dataset(self, path: Path, name: str) -> None:
        """Answer ``dataset_requested``."""
        if self._request is not None and self._request.item.volume_path == path:
            self.open(replace(self._request, dataset=name))

    def provide_spacing(self, path: Path, answer: SpacingAnswer) -> None:
        """Answer ``spacing_requested``; remembered beside the volume, or else by its fingerprint."""
        if self._found is None or self._found.volume.path != path:
            return
        found = opening.with_depth_axis(self._found, answer.depth_axis)
        try:
            if answer.scope == "file":
                write_sidecar(path, answer.spacing_um, answer.depth_axis)
            elif answer.scope == "folder":
                write_folder_answer(path.parent, found.volume.shape, answer.spacing_um, answer.depth_axis)
        except UserError:
            self._remember_spacing(found.fingerprint, answer)
        self._prepare(found, answer.spacing_um, "as answered")

    def known_spacing(self, found: Found) -> tuple[Found, Vector, str] | None:
        """Return what `opening.known_spacing` does, with what was said at the start and answered before."""
        return opening.known_spacing(found, self._spacing_override_um, self._remembered_spacing)

    def decline(self, path: Path) -> None:
        """Answer a question with no; ignored if it was about an opening that was superseded."""
        if self._request is not None and self._request.item.volume_path == path:
            self.cancel()

    def cancel(self) -> None:
        """Open nothing after all."""
        job, self._job, self._request, self._found = self._job, None, None, None
        if job is not None:
            self._jobs.cancel(job)

    def _prepare(self, found: Found, spacing_um: Vector, note: str) -> None:
        def read(_progress: Callable[[float], None], cancelled: Callable[[], bool]) -> Opened:
            opened = opening.prepare(found, spacing_um, note)
            if not cancelled():
                self._when_read(opened)
            return opened

        self._job = self._jobs.start(
            f"Reading {found.item.label}",
            read,
            done=self._on_job_prepared,
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
        )

    def _on_job_found(self, found: Found) -> None:
        self._found = found
        known = self.known_spacing(found)
        if known is None:
            self.spacing_requested.emit(found.volume, offered_spacing_um(found.volume.shape))
        else:
            self._prepare(*known)

    def _on_job_prepared(self, opened: Opened) -> None:
        self._job = self._request = self._found = None
        self.opened.emit(opened)

    def _on_job_failed(self, error: Exception) -> None:
        if isinstance(error, DatasetChoiceNeeded) and self._request is not None:
            self.dataset_requested.emit(self._request.item.volume_path, error.choices)
            return
        request, self._job, self._request, self._found = self._request, None, None, None
        self.failed.emit(request, error)

    def _on_job_cancelled(self) -> None:
        # By a person: where another opening takes the place of one, that is no end.
        if self._job is not None and self._job.state == "cancelled":
            self._job = self._request = self._found = None
