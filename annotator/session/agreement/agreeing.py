"""The session's agreement: how far apart the annotators of the open study or folder are."""

from collections import Counter
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotations.documents.annotation import Annotation
from annotations.documents.permission import check_may_see_all
from annotations.documents.study import CONSENSUS, STUDY_FILE, Study, annotation_name
from annotations.errors import UserError
from annotator.session.agreement.calibrating import annotated_folder
from annotator.session.agreement.opinion_watch import FileMarks, file_marks
from annotator.session.files.saving import SessionSaving
from annotator.session.jobs import WHEN_SHOWN_MS, Job
from annotator.session.remembered import Remembered
from annotator.session.volumes.worklist import NAMELESS, WorkItem

if TYPE_CHECKING:
    from annotations.agreement.results import Agreement

_NOTHING_OPEN = "Open a study, or a folder of volumes, to compare its annotators"
_OPEN_STUDY = "This annotation belongs to a study: open the study to compare its annotators"
_NEVER = "In this study annotators see neither each other's work nor predictions: its reviewers do"
_UNFINISHED = (
    "You see how far apart the annotators are once your own work in this study is done: {} to do by {}"
)
_SHOWS_ALL = "the comparison shows what the others found in volumes that are not done by you"
_REVIEWERS_EXPORT = "The report of this study is exported by its reviewers"


class Agreeing(QObject):
    """Compares the annotators in the background; the last result stays until another folder is open.

    Parameters
    ----------
    user_tool_folder : Path
        Where tools are looked for besides those of the study and the shipped ones.

    Signals
    -------
    changed
        ``result``, ``is_stale``, ``has_changed_files``, ``is_computing`` or one of the refusals may have
        changed.
    computed
        A comparison has succeeded.
    """

    changed = Signal()
    computed = Signal()

    def __init__(self, session: SessionSaving, user_tool_folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._user_tool_folder = user_tool_folder
        self._session = session
        self._result: Agreement | None = None
        self._folder: Path | None = None
        self._computed_at: datetime | None = None
        self._is_stale = False
        self._marks: FileMarks = frozenset()
        self._has_changed_files = False
        self._looking: Job | None = None
        self._after_looking: list[Callable[[], object]] = []
        self._computing: Job | None = None
        self._ids: Remembered[Mapping[str, str]] = Remembered()
        self._placed: Remembered[Mapping[str, int]] = Remembered()
        session.worklist_changed.connect(self._on_session_worklist_changed)
        session.document_changed.connect(self._on_session_document_changed)

    @property
    def result(self) -> "Agreement | None":
        """What was computed last for the folder that is open."""
        return self._result

    @property
    def folder(self) -> Path | None:
        """What was compared, to which the paths in the result are relative."""
        return self._folder

    @property
    def computed_at(self) -> datetime | None:
        """When that was, in local time."""
        return self._computed_at

    @property
    def is_stale(self) -> bool:
        """Whether an annotation was edited in this window since."""
        return self._is_stale

    @property
    def has_changed_files(self) -> bool:
        """Whether other people's annotation files have changed since, as of the last look at them."""
        return self._has_changed_files

    def look_for_changes(self, then: Callable[[], object] = lambda: None) -> None:
        """Look in the background whether other people's files are as they were compared; then go on."""
        folder, before, own = self._folder, self._marks, self._own_folders()
        if self._result is None or folder is None:
            then()
            return
        self._after_looking.append(then)
        if self._looking is not None:
            return

        def go_on() -> None:
            self._looking = None
            waiting, self._after_looking = self._after_looking, []
            for each in waiting:
                each()

        def on_looked(has_changed: bool) -> None:
            if folder == self._folder and before == self._marks and has_changed != self._has_changed_files:
                self._has_changed_files = has_changed
                self.changed.emit()
            go_on()

        self._looking = self._session.jobs.start(
            "Looking at the annotations",
            lambda _progress, _cancelled: _compared_marks(folder, own) != before,
            done=on_looked,
            # A share that does not answer now: whoever reads the files will say so.
            failed=lambda _error: go_on(),
            shown=False,
        )

    def _own_folders(self) -> frozenset[str]:
        """Return the folders whose changes are known otherwise, or are none of what was compared."""
        return frozenset({CONSENSUS, self._session.person, self._session.worklist.annotator})

    @property
    def is_computing(self) -> bool:
        """Whether a comparison is under way."""
        return self._computing is not None

    @property
    def refusal(self) -> str:
        """Why the person may not see the comparison, as far as the open list tells; empty where they may."""
        worklist = self._session.worklist
        if not worklist.items:
            return _NOTHING_OPEN
        if worklist.study is None:
            # Its rules are known only where the study itself is open.
            return _OPEN_STUDY if worklist.lies_in_study else ""
        if self._person not in worklist.study.annotators:
            return "" if worklist.study.is_reviewer(self._person) else _NEVER
        if worklist.study.viewing.others == "always":
            return ""
        if not worklist.study.ever_shows_others_to(self._person):
            return _NEVER
        to_do = sum(item.status != "done" for item in worklist.items)
        is_unfinished = to_do and worklist.annotator == self._person
        return _UNFINISHED.format(to_do, worklist.method) if is_unfinished else ""

    @property
    def export_refusal(self) -> str:
        """Why the person may not export the report; empty where they may."""
        worklist = self._session.worklist
        if self.refusal or worklist.study is None or worklist.study.is_reviewer(self._person):
            return self.refusal
        return _REVIEWERS_EXPORT

    @property
    def _person(self) -> str:
        # The consensus is nobody's own.
        worklist = self._session.worklist
        return self._session.person if worklist.annotator == CONSENSUS else worklist.annotator

    @property
    def is_blind(self) -> bool:
        """Whether volumes are shown by their neutral numbers alone."""
        return self._session.worklist.is_blind

    @property
    def open_volume(self) -> str | None:
        """The name, in the result, of the volume that is open."""
        places = {place: volume for volume, place in self._places().items()}
        current = self._session.current_index
        return None if current is None else places.get(current)

    def volume_label(self, volume: str) -> str:
        """Return how a volume of the result is called where it is shown to the person."""
        if not self.is_blind:
            return volume
        place = self.index_of(volume)
        return NAMELESS if place is None else self._session.items[place].label

    def index_of(self, volume: str) -> int | None:
        """Return where the first pass over a volume of the result stands among the session's items."""
        return self._places().get(volume)

    def _places(self) -> Mapping[str, int]:
        ids = self._ids.result(_ids_by_volume, self._result)
        return self._placed.result(_places_of, ids, self._session.items)

    def compute(self) -> None:
        """Compare the annotators, after what is open has been saved; ``computed`` follows."""
        if self.refusal:
            self._session.post_message(self.refusal)
            return
        if self._session.unsaved and not self._session.save():
            return
        worklist, folder = self._session.worklist, annotated_folder(self._session.worklist)
        study, person, tools = worklist.study, self._person, self._user_tool_folder
        own = self._own_folders()
        self.cancel()
        self._is_stale = False
        self._computing = self._session.jobs.start(
            "Comparing the annotators",
            lambda progress, cancelled: (
                # Before they are read: what changes meanwhile is noticed.
                _compared_marks(folder, own),
                _compared(folder, study, person, tools, progress, cancelled),
            ),
            done=lambda made: self._take(*made, folder),
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
            delay_ms=WHEN_SHOWN_MS,
        )
        self.changed.emit()

    def cancel(self) -> None:
        """Give up what is being compared."""
        if self._computing is not None:
            self._session.jobs.cancel(self._computing)

    def _take(self, marks: FileMarks, result: "Agreement", folder: Path) -> None:
        self._computing = None
        if folder != annotated_folder(self._session.worklist):
            self.changed.emit()
            return
        self._result, self._folder, self._marks = result, folder, marks
        self._has_changed_files = False
        self._computed_at = datetime.now().astimezone()
        self.changed.emit()
        self.computed.emit()

    def _forget(self) -> None:
        self._result = self._folder = self._computed_at = None
        self._is_stale = self._has_changed_files = False

    def _on_job_failed(self, error: Exception) -> None:
        self._computing = None
        self.changed.emit()
        if not isinstance(error, UserError):
            raise error
        self._session.report(error)

    def _on_job_cancelled(self) -> None:
        if self._computing is not None and self._computing.state == "cancelled":
            self._computing = None
            self.changed.emit()

    def _on_session_worklist_changed(self) -> None:
        if self._folder is not None and (
            self._folder != annotated_folder(self._session.worklist) or self.refusal
        ):
            self._forget()
        self.changed.emit()

    def _on_session_document_changed(self, before: Annotation | None, after: Annotation | None) -> None:
        # Another volume's document is no edit, and the consensus is not compared.
        if before is None or after is None or self._is_stale or subject_of(before) != subject_of(after):
            return
        if after.annotator == CONSENSUS:
            return
        if before != after:
            self._is_stale = True
            self.changed.emit()


def _ids_by_volume(result: "Agreement | None") -> Mapping[str, str]:
    """Return what files call the volumes of a result, by what the result calls them."""
    names = {
        each.volume: annotation_name(Path(each.path))
        for each in (result.inputs if result is not None else ())
    }
    return {volume: name.volume_id for volume, name in names.items() if name is not None}


def _places_of(ids: Mapping[str, str], items: tuple[WorkItem, ...]) -> Mapping[str, int]:
    names = [annotation_name(item.annotation_path) for item in items]
    first_passes = {
        name.volume_id: place for place, name in enumerate(names) if name is not None and not name.repeat
    }
    # Beside loose volumes a list may call them otherwise than the files that were compared do.
    loose = [(item.volume_path.name.split(".")[0], place) for place, item in enumerate(items)]
    often = Counter(name for name, _ in loose)
    by_name = {name: at for name, at in loose if often[name] == 1 and items[at].volume_id is None}
    places = {volume: first_passes.get(known, by_name.get(known)) for volume, known in ids.items()}
    return {volume: place for volume, place in places.items() if place is not None}


def subject_of(document: Annotation) -> tuple[object, ...]:
    """Return what a document is about: two of one subject are one document, before and after an edit."""
    return (document.volume, document.annotator, document.method, document.repeat)


def _compared(
    folder: Path,
    study: Study | None,
    person: str,
    user_tool_folder: Path,
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> "Agreement":
    from annotations.agreement.comparison import agreement_of  # late: few sessions compare

    if study is not None:
        # The open list tells of one method alone.
        check_may_see_all(study, folder, person, _SHOWS_ALL, cancelled)
    return agreement_of(folder, (user_tool_folder,), progress=progress, cancelled=cancelled)


def _compared_marks(folder: Path, own: frozenset[str]) -> FileMarks:
    """Return the marks of the files that a comparison reads, without those in some annotators' folders."""
    from annotations.agreement.found_files import files_below, files_of_study  # late: few sessions compare

    files, _ = files_of_study(folder) if (folder / STUDY_FILE).is_file() else files_below(folder)
    return file_marks(folder / each for each in files if Path(each).parent.name not in own)
