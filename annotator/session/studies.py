"""The session's studies: new ones are made here, and the open one is changed and checked."""

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from annotations.documents.study import STUDY_FILE, Study, StudyError
from annotations.documents.study_building import create_study, replace_study, volumes_at, with_volumes
from annotations.documents.study_checks import check_study
from annotations.documents.study_contents import Located
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tools
from annotator.session.jobs import Job, Result
from annotator.session.state import SessionState

_SEEDS = 1_000_000


@dataclass(frozen=True)
class StudyProposal:
    """What a new study can be made of.

    Attributes
    ----------
    folder : Path
        Of the volumes, and of the study unless a person chooses another one.
    paths : tuple of Path
        The volumes.
    tools : mapping of str to ToolSpecification
        Those that can be chosen, by name.
    seed : int
        Of the order and the repeats.
    """

    folder: Path
    paths: tuple[Path, ...]
    tools: Mapping[str, ToolSpecification]
    seed: int

    def study_in(self, folder: Path) -> Study:
        """Return a study of all the volumes that is kept in a folder; StudyError where that cannot be."""
        empty = Study(title="", tool=next(iter(self.tools)), order="shuffled", seed=self.seed)
        return with_volumes(empty, folder, self.paths).study


@dataclass(frozen=True)
class StudyReport:
    """What the check of a study has found.

    Attributes
    ----------
    study : Study
    folder : Path
    findings : tuple of (Path or None, Finding)
    """

    study: Study
    folder: Path
    findings: tuple[Located, ...]


class Studies(QObject):
    """Makes, changes and checks studies, all of it in jobs.

    Parameters
    ----------
    read_anew : callable
        Reads the open list again, with what is open staying open.
    failed : callable
        Takes an error.
    user_tool_folder : Path

    Signals
    -------
    proposed : StudyProposal
        After `propose`: `create` may follow.
    created : Path
        The folder of a new study.
    volumes_found : tuple of Path
        After `find`.
    search_failed : UserError
        Instead.
    changed
        The open study has been changed, and is read anew.
    checked : StudyReport
        After `check`.
    """

    proposed = Signal(object)
    created = Signal(object)
    volumes_found = Signal(object)
    search_failed = Signal(object)
    changed = Signal()
    checked = Signal(object)

    def __init__(
        self,
        session: SessionState,
        read_anew: Callable[[], None],
        failed: Callable[[Exception], None],
        user_tool_folder: Path,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._read_anew = read_anew
        self._failed = failed
        self._user_tool_folder = user_tool_folder
        self._checking: Job | None = None

    @property
    def study(self) -> Study | None:
        """The open study."""
        return self._session.worklist.study

    @property
    def folder(self) -> Path | None:
        """The open study's folder."""
        return self._session.worklist.folder if self.study is not None else None

    @property
    def is_kept_from_names(self) -> bool:
        """Whether the person is not to know the volumes by name, as settings and checks would show them."""
        return self._session.is_blind

    def propose(self, folder: Path) -> None:
        """Look for volumes to make a study of; ``proposed`` follows."""
        self._start("Looking for volumes", lambda: self._proposal(folder), self.proposed.emit)

    def find(self, paths: Sequence[Path]) -> None:
        """Look for volumes to add: those named, and those in the folders named; ``volumes_found`` follows."""

        def on_failed(error: Exception) -> None:
            if isinstance(error, UserError):
                self.search_failed.emit(error)
            else:
                self._failed(error)

        self._session.jobs.start(
            "Looking for volumes",
            lambda _progress, _cancelled: volumes_at(paths),
            done=self.volumes_found.emit,
            failed=on_failed,
        )

    def create(self, study: Study, folder: Path, tool: ToolSpecification) -> None:
        """Write a new study; ``created`` follows."""
        self._start(
            "Making the study",
            lambda: create_study(study, folder, tool),
            lambda _: self.created.emit(folder),
        )

    def change(self, before: Study, after: Study) -> None:
        """Write the open study as it is to be, unless somebody else has changed it; ``changed`` follows."""
        folder = self.folder
        if folder is not None and before != after:
            self._start(
                "Changing the study",
                lambda: replace_study(after, folder, expected=before),
                self._on_job_changed,
            )

    def check(self) -> None:
        """Check the open study as it is on disk; ``checked`` follows."""
        study, folder = self.study, self.folder
        if study is None or folder is None:
            return
        if self._checking is not None:
            self._session.jobs.cancel(self._checking)
        tool_folders = (folder / "tools", self._user_tool_folder)
        self._checking = self._session.jobs.start(
            "Checking the study",
            lambda progress, cancelled: _checked(folder, tool_folders, progress, cancelled),
            done=lambda findings: self.checked.emit(StudyReport(study, folder, findings)),
            failed=self._failed,
        )

    def _proposal(self, folder: Path) -> StudyProposal:
        if (folder / STUDY_FILE).exists():
            raise StudyError(
                "this folder is a study already",
                where=folder,
                remedy="Open it and change its settings, or choose another folder",
            )
        paths = volumes_at([folder])
        tools = find_tools((folder / "tools", self._user_tool_folder))
        # Every study shuffles in its own way, and says in its file which.
        seed = random.SystemRandom().randrange(_SEEDS)
        return StudyProposal(folder, paths, tools, seed)

    def _start(self, title: str, work: Callable[[], Result], done: Callable[[Result], None]) -> None:
        self._session.jobs.start(title, lambda _progress, _cancelled: work(), done=done, failed=self._failed)

    def _on_job_changed(self, _: None) -> None:
        self._read_anew()
        self.changed.emit()


def _checked(
    folder: Path,
    tool_folders: Sequence[Path],
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> tuple[Located, ...]:
    from annotations.fitting.implausible import implausible  # late: it brings what the fit needs

    judge = partial(implausible, tool_folders=tool_folders)
    return check_study(folder, tool_folders, judge=judge, progress=progress, cancelled=cancelled)
