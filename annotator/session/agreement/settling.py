"""The session's consensus: proposed from the annotators' documents, and settled by a reviewer."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotations.documents import edits
from annotations.documents.annotation import Annotation, Part, is_untouched
from annotations.documents.record import Method
from annotations.documents.study import CONSENSUS
from annotator.session.agreement.opinion_watch import FileMarks, OpinionWatch, opinion_marks
from annotator.session.agreement.others import Others
from annotator.session.agreement.proposals import moved_um, ranked, said_of_proposal
from annotator.session.jobs import Job
from annotator.session.state import SessionState
from annotator.session.volumes.worklist import ItemStatus

if TYPE_CHECKING:
    from annotations.agreement.consensus import Consensus, PartConsensus
    from annotations.agreement.triage import Settled, TriageEntry

Edit = Callable[[str, Callable[[Annotation], Annotation]], bool]
OpenList = Callable[[str, Method, str | None], None]

_SETTLED: "Mapping[ItemStatus, Settled]" = {"new": "no", "in_progress": "in_progress", "done": "done"}


class Settling(QObject):
    """Shows a reviewer what the annotators agree on, and takes down what the reviewer makes of it.

    The consensus is a document like any other, of the annotator `CONSENSUS`: it is edited, undone and saved
    by the session. The annotators' own documents are only read, and drawn over it once settling begins.

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
        ``is_settling``, ``consensus``, ``is_reading`` or ``reason`` may have changed.
    triaged
        ``entries`` or ``is_triaging`` has changed.
    """

    changed = Signal()
    triaged = Signal()

    def __init__(
        self,
        session: SessionState,
        others: Others,
        edit: Edit,
        open_list: OpenList,
        fail: Callable[[Exception], None],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._others = others
        self._edit = edit
        self._open_list = open_list
        self._fail = fail
        self._consensus: Consensus | None = None
        self._reading: Job | None = None
        self._triaging: Job | None = None
        self._entries: tuple[TriageEntry, ...] = ()
        self._triaged_folder: tuple[Path, Method] | None = None
        self._shows_others = False
        self._to_propose: str | None = None
        self._moved_um: Mapping[str, float] = {}
        self._watch = OpinionWatch(session.jobs, self)
        self._watch.noticed.connect(self._on_watch_noticed)
        session.document_changed.connect(self._on_session_document_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        session.worklist_changed.connect(self._on_session_worklist_changed)

    # What there is

    @property
    def is_settling(self) -> bool:
        """Whether the open list is that of the study's consensus."""
        worklist = self._session.worklist
        return worklist.annotator == CONSENSUS and worklist.study is not None

    @property
    def is_reading(self) -> bool:
        """Whether the annotators' documents are being read."""
        return self._reading is not None

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
        if study.blind and person in study.annotators and self._has_own_work_left():
            # The list of the consensus, and what it is about, name the volumes.
            return "You annotate this study blind: its consensus is for you once all your own work is done"
        return ""

    @property
    def is_stale(self) -> bool:
        """Whether an annotator has changed something since the open consensus was proposed."""
        return bool(self.changed_since)

    @property
    def changed_since(self) -> tuple[str, ...]:
        """Whose annotation is another than that from which the open consensus was proposed, as last read."""
        document, consensus, path = self._session.document, self._consensus, self._session.annotation_path
        if document is None or consensus is None or path is None:
            return ()
        from annotations.agreement.consensus import changed_since  # late: few sessions settle

        return changed_since(document, consensus.contributions(path))

    @property
    def moved_um(self) -> Mapping[str, float]:
        """How far, in µm, each part was moved by proposing again, until the document is changed otherwise."""
        return self._moved_um

    def look_for_changes(self) -> None:
        """Look at once whether an annotator has changed something; ``changed`` follows where that is so."""
        self._watch.look()

    def part(self, name: str) -> "PartConsensus | None":
        """Return what the annotators agree on about a keypoint or a link's box."""
        return self._consensus.parts.get(name) if self._consensus is not None else None

    def opinions_on(self, name: str) -> Mapping[str, Part]:
        """Return the keypoint or box of that name of everyone who placed it, by annotator."""
        agreed = self.part(name)
        if self._consensus is None or agreed is None:
            return {}
        return {
            opinion.document.annotator: opinion.document.part(name)
            for opinion in self._consensus.opinions
            if opinion.document.annotator in (*agreed.used, *agreed.set_aside)
        }

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
        """Open the study's consensus at a volume, else at the open one; where nothing is yet, propose it."""
        if self.reason:
            self._session.post_message(self.reason)
            return
        present = self._volume_id()
        volume_id = volume_id or present
        if self.is_settling and volume_id == present:
            return
        self._to_propose = volume_id
        self._open_list(CONSENSUS, self._session.method, volume_id)

    def next_volume_id(self) -> str | None:
        """Return what is to be settled after the open volume: by the triage, else by the list; or None."""
        ids = [entry.volume for entry in self._entries if entry.settled != "done"]
        order = [entry.volume for entry in self._entries]
        if not order:
            order = [item.volume_id for item in self._session.items if item.volume_id is not None]
            ids = [item.volume_id for item in self._session.items if item.volume_id and item.status != "done"]
        present = self._volume_id()
        here = order.index(present) + 1 if present in order else 0
        return next((each for each in order[here:] + order[:here] if each in ids and each != present), None)

    def settle_next(self) -> None:
        """Open the consensus on the volume that is to be settled next."""
        following = self.next_volume_id()
        if following is None:
            self._session.post_message("Every volume is settled")
        else:
            self.settle(following)

    def leave(self) -> None:
        """Go back to the reviewer's own list, at the same volume."""
        if self.is_settling:
            self._open_list(self._session.person, self._session.method, self._volume_id())

    def propose(self) -> None:
        """Read the annotators' documents anew, and put what they agree on where no reviewer has decided.

        One edit that can be undone.
        """
        if self.is_settling and not self._session.read_only_reason:
            self._to_propose = self._volume_id()
            self._read()

    def adopt(self, name: str, annotator: str) -> None:
        """Take one annotator's keypoint or box as it is; one edit that can be undone."""
        part = self.opinions_on(name).get(annotator)
        if self.is_settling and part is not None:
            self._edit(f"Take {annotator}'s {name}", lambda document: edits.adopt(document, part, annotator))

    def cancel_triage(self) -> None:
        """Give up ranking the volumes."""
        if self._triaging is not None:
            self._session.jobs.cancel(self._triaging)

    def triage(self) -> None:
        """Rank the volumes of the study that the person may see in the background; ``triaged`` follows."""
        worklist = self._session.worklist
        study, folder, method = worklist.study, worklist.folder, self._session.method
        if study is None or self.reason or self._triaging is not None:
            self._session.post_message(self.reason or "The volumes are being ranked already")
            return
        person, tool_folders = self._session.person, self._session.tool_folders

        self._triaging = self._session.jobs.start(
            "Ranking the volumes",
            lambda progress, cancelled: ranked(
                study, folder, person, method, tool_folders, progress, cancelled
            ),
            done=lambda entries: self._take_entries((folder, method), entries),
            failed=self._on_triaging_failed,
            cancelled=self._on_triaging_cancelled,
        )
        self.triaged.emit()

    def _has_own_work_left(self) -> bool:
        """Say whether anything is to do for the person, as far as their own list, which is open, tells."""
        worklist = self._session.worklist
        if worklist.annotator != self._session.person:
            return False
        done = sum(item.status == "done" for item in worklist.items) + sum(worklist.done_elsewhere.values())
        return done < len(worklist.items) * (1 + len(worklist.done_elsewhere))

    def _volume_id(self) -> str | None:
        index = self._session.current_index
        return self._session.items[index].volume_id if index is not None else None

    def _read(self) -> None:
        session = self._session
        volume_id, tool = self._volume_id(), session.tool
        if not self.is_settling or volume_id is None or tool is None or session.document is None:
            return
        if self._reading is not None:
            session.jobs.cancel(self._reading)
        folder, method = session.worklist.folder, session.document.method

        def work(_progress: object, _cancelled: object) -> "tuple[Consensus, FileMarks]":
            from annotations.agreement.consensus import propose  # late: few sessions settle
            from annotations.agreement.opinions import read_opinions

            # Before they are read: what changes meanwhile is noticed.
            marks = opinion_marks(folder, volume_id, method)
            return propose(read_opinions(folder, volume_id, method, tool)), marks

        def take(read: "tuple[Consensus, FileMarks]") -> None:
            consensus, marks = read
            self._watch.watch(folder, volume_id, method, marks)
            self._take_consensus(consensus)

        self._reading = session.jobs.start(
            "Reading what the annotators say",
            work,
            done=take,
            failed=self._on_reading_failed,
            shown=False,
        )

    def _put_proposal(self, consensus: "Consensus") -> None:
        path = self._session.annotation_path
        if path is None:
            return
        contributions = consensus.contributions(path)
        if not contributions:
            self._session.post_message(f"Nobody has annotated this volume by {self._session.method} yet")
            return
        parts = {name: part.proposed for name, part in consensus.parts.items()}
        before = self._session.document
        if before is None:
            return
        proposed = edits.propose_consensus(before, parts, contributions)
        if proposed is before:
            self._session.post_message("The proposal is what is here already")
            return
        self._session.expect_proposal(proposed)
        if self._edit("Propose the consensus", lambda _document: proposed):
            self._moved_um = moved_um(before, proposed)
            self._session.post_message(said_of_proposal(before, self._moved_um))

    def _is_untouched(self) -> bool:
        """Say whether nothing is in the open document yet, and something could be."""
        document = self._session.document
        return document is not None and not self._session.read_only_reason and is_untouched(document)

    def _forget(self) -> None:
        self._watch.stop()
        self._moved_um = {}
        if self._reading is not None:
            self._session.jobs.cancel(self._reading)
        self._reading = self._consensus = None

    def _take_entries(self, ranked: tuple[Path, Method] | None, entries: "tuple[TriageEntry, ...]") -> None:
        self._triaging = None
        self._triaged_folder, self._entries = ranked, entries
        self.triaged.emit()

    def _take_consensus(self, consensus: "Consensus") -> None:
        self._reading = None
        self._consensus = consensus
        if self._to_propose == self._volume_id():
            self._put_proposal(consensus)
        self._to_propose = None
        self._follow_items()
        self.changed.emit()
        if not self._shows_others:
            self._shows_others = True
            self._others.want()

    def _on_reading_failed(self, error: Exception) -> None:
        self._reading = self._to_propose = None
        self.changed.emit()
        self._fail(error)

    def _on_triaging_failed(self, error: Exception) -> None:
        self._triaging = None
        self.triaged.emit()
        self._fail(error)

    def _on_triaging_cancelled(self) -> None:
        self._triaging = None
        self.triaged.emit()

    def _on_watch_noticed(self) -> None:
        self._read()
        self._others.reload()

    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        self._moved_um = {}

    def _on_session_volume_changed(self) -> None:
        if self.is_settling and self._session.view.mode != "navigate":
            # Who came to look must not place anything by the first click.
            self._session.look(mode="navigate")
        self._forget()
        if not self._is_untouched() or self._to_propose != self._volume_id():
            self._to_propose = None
        self._shows_others = self._shows_others and self.is_settling
        self._read()
        self.changed.emit()

    def _on_session_worklist_changed(self) -> None:
        present = (self._session.worklist.folder, self._session.method)
        if self._triaged_folder is not None and (self._triaged_folder != present or self.reason):
            # They are of another study, by another method, or not for this person.
            self._take_entries(None, ())
        elif self.is_settling:
            self._follow_items()
        self.changed.emit()

    def _follow_items(self) -> None:
        """Say in the triage how far the consensus is by now."""
        status = {item.volume_id: item.status for item in self._session.items}
        entries = tuple(
            replace(entry, settled=self._settled(entry, status[entry.volume]))
            if entry.volume in status
            else entry
            for entry in self._entries
        )
        if entries != self._entries:
            self._entries = entries
            self.triaged.emit()

    def _settled(self, entry: "TriageEntry", status: ItemStatus) -> "Settled":
        """Say how far a consensus is; only of the open one is it known whether its sources have changed."""
        if status != "done":
            return _SETTLED[status]
        if entry.volume != self._volume_id() or self._consensus is None:
            return "stale" if entry.settled == "stale" else "done"
        return "stale" if self.is_stale else "done"
