"""The session's studies: new ones are made here, and the open one is changed and checked."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal, SignalInstance

from annotations.documents.seen_volumes import FoundVolume, look_at_volumes
from annotations.documents.study import STUDY_FILE, Study, StudyError, load_study, study_folder_of
from annotations.documents.study_building import (
    create_study,
    drawn_seed,
    replace_study,
    volumes_at,
    with_volumes,
)
from annotations.documents.study_checks import check_study
from annotations.documents.study_contents import Located
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tools
from annotator.session.jobs import Job, Result
from annotator.session.state import SessionState


@dataclass(frozen=True)
class StudyProposal:
    """What a new study can be made of.

    Attributes
    ----------
    folder : Path
        Of the volumes, and of the study unless a person chooses another one.
    found : tuple of FoundVolume
        The volumes, and what cannot be read of what is called like one.
    tools : mapping of str to ToolSpecification
        Those that can be chosen, by name.
    seed : int
        Of the order and the repeats.
    belongs_to : str
        The studies that have these volumes already, by their titles; empty where there is none.
    """

    folder: Path
    found: tuple[FoundVolume, ...]
    tools: Mapping[str, ToolSpecification]
    seed: int
    belongs_to: str = ""

    def study_in(self, folder: Path, paths: Sequence[Path]) -> Study:
        """Return a study of volumes that is kept in a folder; StudyError where that cannot be."""
        empty = Study(title="", tool=next(iter(self.tools)), order="shuffled", seed=self.seed)
        return with_volumes(empty, folder, paths).study


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
    create_failed : Exception
        Instead.
    volumes_found : tuple of FoundVolume
        After `find`.
    search_failed : Exception
        Instead.
    changed
        The open study has been changed, and is read anew.
    change_failed : Exception
        Instead; `StudyChanged` where somebody else has changed it.
    checked : StudyReport
        After `check`.
    """

    proposed = Signal(object)
    created = Signal(object)
    create_failed = Signal(object)
    volumes_found = Signal(object)
    search_failed = Signal(object)
    changed = Signal()
    change_failed = Signal(object)
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
        person, user_tool_folder = self._session.annotator_name, self._user_tool_folder
        present = {self.folder: self.study} if self.folder is not None and self.study is not None else {}
        self._session.jobs.start(
            "Looking for volumes",
            lambda progress, cancelled: _proposal(
                folder, user_tool_folder, person, present, progress, cancelled
            ),
            done=self.proposed.emit,
            failed=self._failed,
        )

    def find(self, paths: Sequence[Path]) -> None:
        """Look for volumes to add: those named, and those in the folders named; ``volumes_found`` follows."""
        study, folder = self.study, self.folder
        known = [folder / volume.path for volume in study.volumes] if study and folder else []
        self._session.jobs.start(
            "Looking for volumes",
            lambda progress, cancelled: look_at_volumes(
                volumes_at(paths), known=known, progress=progress, cancelled=cancelled
            ),
            done=self.volumes_found.emit,
            failed=lambda error: self._tell(error, self.search_failed),
        )

    def create(self, study: Study, folder: Path, tool: ToolSpecification) -> None:
        """Write a new study; ``created`` follows."""
        self._start(
            "Making the study",
            lambda: create_study(study, folder, tool),
            lambda _: self.created.emit(folder),
            self.create_failed,
        )

    def change(self, before: Study, after: Study) -> None:
        """Write the open study as it is to be, unless somebody else has changed it; ``changed`` follows."""
        folder = self.folder
        if folder is not None and before != after:
            self._start(
                "Changing the study",
                lambda: replace_study(after, folder, expected=before),
                self._on_job_changed,
                self.change_failed,
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

    def _start(
        self, title: str, work: Callable[[], Result], done: Callable[[Result], None], failed: SignalInstance
    ) -> None:
        self._session.jobs.start(
            title,
            lambda _progress, _cancelled: work(),
            done=done,
            failed=lambda error: self._tell(error, failed),
            # The dialog waits for the end of it, and half of a study is none: nobody is to cancel it.
            shown=False,
        )

    def _tell(self, error: Exception, whoever_waits: SignalInstance) -> None:
        whoever_waits.emit(error)
        if not isinstance(error, UserError):
            # It is for the log as well.
            self._failed(error)

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


def _proposal(
    folder: Path,
    user_tool_folder: Path,
    person: str,
    present: Mapping[Path, Study],
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> StudyProposal:
    """Look for what a study can be made of; of whoever is blind to the volumes, none is looked at.

    Parameters
    ----------
    present : mapping of Path to Study
        Studies that are known, by their folders; others are found in the folders around the volumes.
    """
    if (folder / STUDY_FILE).exists():
        raise StudyError(
            "this folder is a study already",
            where=folder,
            remedy="Open it and change its settings, or choose another folder",
        )
    paths = volumes_at([folder])
    studies = _studies_of(paths, present)
    for study in studies:
        if study.is_blind_for(person):
            raise StudyError(
                f"these volumes belong to the study “{study.title}”, in which you annotate without knowing "
                "them by name",
                remedy="Leave a new study of them to somebody who does not annotate there",
            )
    found = look_at_volumes(paths, progress=progress, cancelled=cancelled)
    tools = find_tools((folder / "tools", user_tool_folder))
    titles = " and ".join(f"the study “{study.title}”" for study in studies)
    return StudyProposal(folder, found, tools, drawn_seed(), titles)


def _studies_of(paths: Sequence[Path], present: Mapping[Path, Study]) -> tuple[Study, ...]:
    """Return the studies in whose folders volumes lie, and those known ones that have any of them."""
    resolved = {path.resolve() for path in paths}
    studies = {
        folder.resolve(): study
        for folder, study in present.items()
        if any((folder / volume.path).resolve() in resolved for volume in study.volumes)
    }
    for around in dict.fromkeys(study_folder_of(path) for path in paths):
        if around is not None:
            # It may be newer than the open one; of one that cannot be read nobody knows whether it is blind.
            studies[around.resolve()] = load_study(around)
    return tuple(studies.values())
