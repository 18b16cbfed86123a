"""Opens volumes in the background, and stops to ask where only a person knows."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotations.volumes import DatasetChoiceNeeded, offered_spacing_um, write_folder_answer, write_sidecar
from annotator import opening
from annotator.jobs import Job, Jobs
from annotator.opening import Found, Opened
from annotator.spacing_answer import SpacingAnswer
from annotator.worklist import WorkItem


class VolumeOpener(QObject):
    """One opening at a time; a new one takes the place of one that has not ended.

    Signals
    -------
    opened : Opened
    failed : Exception
    spacing_requested : Volume, (float, float, float)
        Nothing says the spacing: answer with `provide_spacing` or `cancel`.
    dataset_requested : Path, tuple of DatasetChoice
        The file holds several arrays: answer with `provide_dataset` or `cancel`.

    Parameters
    ----------
    spacing_override_um : (float, float, float) or None
        Said when the program was started.
    remembered_spacing, remember_spacing : callable
        Where answers are kept by the volume's fingerprint when its folder cannot be written.
    """

    opened = Signal(object)
    failed = Signal(object)
    spacing_requested = Signal(object, object)
    dataset_requested = Signal(object, object)

    def __init__(
        self,
        jobs: Jobs,
        annotator_name: Callable[[], str],
        spacing_override_um: Vector | None,
        remembered_spacing: Callable[[str], SpacingAnswer | None],
        remember_spacing: Callable[[str, SpacingAnswer], None],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._annotator_name = annotator_name
        self._spacing_override_um = spacing_override_um
        self._remembered_spacing = remembered_spacing
        self._remember_spacing = remember_spacing
        self._job: Job | None = None
        self._request: tuple[WorkItem, str, tuple[Path, ...]] | None = None
        self._found: Found | None = None

    def open(
        self, item: WorkItem, tool_name: str, tool_folders: tuple[Path, ...], dataset: str | None = None
    ) -> None:
        """Begin to open an item; ``opened`` or ``failed`` follows, or a request."""
        self.cancel()
        self._request = (item, tool_name, tool_folders)
        self._job = self._jobs.start(
            f"Opening {item.label}",
            lambda _progress, _cancelled: opening.find(item, dataset, tool_name, tool_folders),
            done=self._on_job_found,
            failed=self._on_job_failed,
        )

    def provide_dataset(self, name: str) -> None:
        """Answer ``dataset_requested``."""
        if self._request is not None:
            item, tool_name, tool_folders = self._request
            self.open(item, tool_name, tool_folders, name)

    def provide_spacing(self, answer: SpacingAnswer) -> None:
        """Answer ``spacing_requested``; remembered beside the volume, or else by its fingerprint."""
        if self._found is None:
            return
        found = opening.with_depth_axis(self._found, answer.depth_axis)
        path = found.volume.path
        try:
            if answer.scope == "file":
                write_sidecar(path, answer.spacing_um, answer.depth_axis)
            elif answer.scope == "folder":
                write_folder_answer(path.parent, found.volume.shape, answer.spacing_um, answer.depth_axis)
        except UserError:
            self._remember_spacing(found.fingerprint, answer)
        self._prepare(found, answer.spacing_um, "as answered")

    def cancel(self) -> None:
        """Open nothing after all."""
        if self._job is not None:
            self._jobs.cancel(self._job)
        self._job = self._request = self._found = None

    def _prepare(self, found: Found, spacing_um: Vector, note: str) -> None:
        annotator = self._annotator_name()
        self._job = self._jobs.start(
            f"Reading {found.item.label}",
            lambda _progress, _cancelled: opening.prepare(found, spacing_um, note, annotator),
            done=self._on_job_prepared,
            failed=self._on_job_failed,
        )

    def _on_job_found(self, found: Found) -> None:
        self._found = found
        known = opening.known_spacing(found, self._spacing_override_um, self._remembered_spacing)
        if known is None:
            self.spacing_requested.emit(found.volume, offered_spacing_um(found.volume.shape))
        else:
            self._prepare(*known)

    def _on_job_prepared(self, opened: Opened) -> None:
        self._job = self._request = self._found = None
        self.opened.emit(opened)

    def _on_job_failed(self, error: Exception) -> None:
        if isinstance(error, DatasetChoiceNeeded) and self._request is not None:
            self.dataset_requested.emit(self._request[0].volume_path, error.choices)
            return
        self._job = self._request = self._found = None
        self.failed.emit(error)
