"""The session's consensus: proposed from the annotators' documents, and settled by a reviewer."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotations.documents import edits
from annotations.documents.annotation import Annotation, Part
from annotations.documents.permission import permission
from annotations.documents.record import Method
from annotations.documents.study import CONSENSUS
from annotator.session.jobs import Job
from annotator.session.state import SessionState

if TYPE_CHECKING:
    from annotations.agreement.consensus import Consensus, PartConsensus
    from annotations.agreement.triage import TriageEntry

Edit = Callable[[str, Callable[[Annotation], Annotation]], bool]
OpenList = Callable[[str, Method, str | None], None]


class Settling(QObject):
    """Shows a reviewer what the annotators agree on, and takes down what the reviewer makes of it.

    The consensus is a document like any other, of the annotator `CONSENSUS`: it is edited, undone and saved
    by the session. The annotators' own documents are only read.

    Parameters
    ----------
    edit : callable
        Makes one edit of the open document, by its text and a pure function; False if it was refused.
    open_list : callable
        Opens the list of somebody's documents, by one method, at a volume.
    fail : callable
        Takes what went wrong in the background.

    Signals
    -------
    changed
        ``is_settling``, ``consensus`` or ``reason`` may have changed.
    triaged
        ``entries`` has changed.
    """

    changed = Signal()
    triaged = Signal()

    def __init__(
        self,
        session: SessionState,
        edit: Edit,
        open_list: OpenList,
        fail: Callable[[Exception], None],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._edit = edit
        self._open_list = open_list
        self._fail = fail
        self._consensus: Consensus | None = None
        self._reading: Job | None = None
        self._triaging: Job | None = None
        self._entries: tuple[TriageEntry, ...] = ()
        self._triaged_folder: tuple[Path, Method] | None = None
        session.volume_changed.connect(self._on_session_volume_changed)
        session.worklist_changed.connect(self._on_session_worklist_changed)

    # What there is

    @property
    def is_settling(self) -> bool:
        """Whether the open list is that of the study's consensus."""
        return self._session.worklist.annotator == CONSENSUS

    @property
    def consensus(self) -> "Consensus | None":
        """What follows from the annotators' documents of the open volume; None until they are read."""
        return self._consensus

    @property
    def reason(self) -> str:
        """Why this person cannot settle a consensus here, as a sentence without its full stop; or empty."""
        study, person = self._session.worklist.study, self._session.person
        if study is None:
            return "A consensus belongs to a study: open one"
        if not study.is_reviewer(person):
            return "The study's consensus is settled by its reviewers"
        return ""

    @property
    def is_stale(self) -> bool:
        """Whether an annotator has changed something since the open consensus was proposed."""
        document, consensus, path = self._session.document, self._consensus, self._session.annotation_path
        if document is None or consensus is None or path is None or not document.consensus_of:
            return False
        return document.consensus_of != consensus.contributions(path)

    def part(self, name: str) -> "PartConsensus | None":
        """Return what the annotators agree on about a keypoint or a link's box."""
        return self._consensus.parts.get(name) if self._consensus is not None else None

    def opinions_on(self, name: str) -> Mapping[str, Part]:
        """Return the keypoint or box of that name of everyone who placed it, by annotator."""
        if self._consensus is None:
            return {}
        parts = {
            opinion.document.annotator: opinion.document.part(name) for opinion in self._consensus.opinions
        }
        return {annotator: part for annotator, part in parts.items() if part.anchor_um is not None}

    @property
    def entries(self) -> "tuple[TriageEntry, ...]":
        """The volumes by what needs a reviewer first, as of the last triage of this study and method."""
        return self._entries

    @property
    def is_triaging(self) -> bool:
        """Whether the volumes are being ranked."""
        return self._triaging is not None

    # What a reviewer does

    def settle(self, volume_id: str | None = None) -> None:
        """Open the study's consensus at a volume: the given one, else the open one."""
        if self.reason:
            self._session.post_message(self.reason)
            return
        if volume_id is None and (index := self._session.current_index) is not None:
            volume_id = self._session.items[index].volume_id
        study, folder = self._session.worklist.study, self._session.worklist.folder
        if study is not None and volume_id is not None and self._session.person in study.annotators:
            allowed = permission(study, folder, self._session.person, volume_id)
            if not allowed.may_see:
                self._session.post_message(allowed.reason)
                return
        self._open_list(CONSENSUS, self._session.method, volume_id)

    def leave(self) -> None:
        """Go back to the reviewer's own list, at the same volume."""
        index = self._session.current_index
        volume_id = self._session.items[index].volume_id if index is not None else None
        self._open_list(self._session.person, self._session.method, volume_id)

    def propose(self) -> None:
        """Put the proposed consensus where the reviewer has not decided; one edit that can be undone."""
        consensus, path = self._consensus, self._session.annotation_path
        if not self.is_settling or consensus is None or path is None:
            return
        if not consensus.opinions:
            self._session.post_message(f"Nobody has annotated this volume by {self._session.method} yet")
            return
        parts = {name: part.proposed for name, part in consensus.parts.items()}
        contributions = consensus.contributions(path)
        self._edit(
            "Propose the consensus",
            lambda document: edits.propose_consensus(document, parts, contributions),
        )

    def adopt(self, name: str, annotator: str) -> None:
        """Take one annotator's keypoint or box as it is; one edit that can be undone."""
        part = self.opinions_on(name).get(annotator)
        if self.is_settling and part is not None:
            self._edit(f"Take {annotator}'s {name}", lambda document: edits.adopt(document, part, annotator))

    def triage(self) -> None:
        """Rank the volumes of the study in the background; ``triaged`` follows."""
        worklist = self._session.worklist
        if self.reason or self._triaging is not None:
            self._session.post_message(self.reason or "The volumes are being ranked already")
            return
        folder, method = worklist.folder, self._session.method
        tool_folders = self._session.tool_folders

        def work(
            progress: Callable[[float], None], cancelled: Callable[[], bool]
        ) -> "tuple[TriageEntry, ...]":
            from annotations.agreement.comparison import agreement_of  # late: few sessions compare
            from annotations.agreement.triage import triage

            agreement = agreement_of(
                folder,
                tool_folders,
                progress=lambda share: progress(share / 2),
                cancelled=cancelled,
            )
            if method not in agreement.methods:
                return ()
            return triage(
                agreement,
                method,
                folder,
                tool_folders,
                progress=lambda share: progress((1 + share) / 2),
                cancelled=cancelled,
            )

        self._triaging = self._session.jobs.start(
            "Ranking the volumes",
            work,
            done=lambda entries: self._take_entries((folder, method), entries),
            failed=self._on_triaging_failed,
            cancelled=self._on_triaging_cancelled,
        )

    def _read(self) -> None:
        session = self._session
        index, tool = session.current_index, session.tool
        volume_id = session.items[index].volume_id if index is not None else None
        if not self.is_settling or volume_id is None or tool is None or session.document is None:
            return
        folder, method = session.worklist.folder, session.document.method

        def work(_progress: object, _cancelled: object) -> "Consensus":
            from annotations.agreement.consensus import propose  # late: few sessions settle
            from annotations.agreement.opinions import read_opinions

            return propose(read_opinions(folder, volume_id, method, tool))

        self._reading = session.jobs.start(
            "Reading what the annotators say",
            work,
            done=self._on_reading_done,
            failed=self._on_reading_failed,
            shown=False,
        )

    def _forget(self) -> None:
        if self._reading is not None:
            self._session.jobs.cancel(self._reading)
        self._reading = self._consensus = None

    def _take_entries(self, ranked: tuple[Path, Method] | None, entries: "tuple[TriageEntry, ...]") -> None:
        self._triaging = None
        self._triaged_folder, self._entries = ranked, entries
        self.triaged.emit()

    def _on_reading_done(self, consensus: "Consensus") -> None:
        self._reading = None
        self._consensus = consensus
        self.changed.emit()

    def _on_reading_failed(self, error: Exception) -> None:
        self._reading = None
        self._fail(error)

    def _on_triaging_failed(self, error: Exception) -> None:
        self._triaging = None
        self.triaged.emit()
        self._fail(error)

    def _on_triaging_cancelled(self) -> None:
        self._triaging = None
        self.triaged.emit()

    def _on_session_volume_changed(self) -> None:
        self._forget()
        self._read()
        self.changed.emit()

    def _on_session_worklist_changed(self) -> None:
        present = (self._session.worklist.folder, self._session.method)
        if self._triaged_folder is not None and self._triaged_folder != present:
            # They are of another study, or by another method.
            self._take_entries(None, ())
        self.changed.emit()
