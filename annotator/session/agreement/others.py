"""The other annotators' documents of the open volume: loaded only where they are wanted and may be seen."""

import contextlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject, Signal

from annotations.documents.annotation import Annotation
from annotations.documents.files import load_annotation
from annotations.documents.record import Method
from annotations.documents.representations import keypoint_positions_um
from annotations.documents.study import (
    CONSENSUS,
    AnnotationName,
    annotation_name,
    annotation_path,
    study_folder_of,
)
from annotations.errors import Cancelled, UserError
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, vector
from annotations.geometry.tool import ToolSpecification
from annotator.session.agreement.agreeing import Agreeing
from annotator.session.agreement.annotator_names import has_placed, in_order, initials, people_of
from annotator.session.agreement.differences import Difference, differences
from annotator.session.editing.seeing import Seeing
from annotator.session.jobs import Job
from annotator.session.remembered import Remembered
from annotator.session.state import SessionState
from annotator.session.viewing.view import View

_NOBODY = "Nobody else has annotated this volume by {}"


@dataclass(frozen=True)
class OtherAnnotation:
    """What another annotator says of the open volume, by the same method, in the first pass.

    Attributes
    ----------
    annotator : str
    document : Annotation
    positions_um : mapping of str to (float, float, float)
        Of the keypoints; of boxes those at their ends.
    boxes : mapping of str to Box
        By link; empty for a document of keypoints.
    number : int
        Place in the order of all the annotators, which says how it is drawn.
    initials : str
    visible : bool
        Whether a person has left it visible.
    """

    annotator: str
    document: Annotation
    positions_um: Mapping[str, Vector]
    boxes: Mapping[str, Box]
    number: int
    initials: str
    visible: bool = True


class Others(QObject):
    """Holds the others' annotations of the open volume while the layer ``others`` is shown.

    Signals
    -------
    changed
        ``shown`` or ``reason`` may have changed.
    """

    changed = Signal()

    def __init__(
        self, session: SessionState, seeing: Seeing, agreeing: Agreeing, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._agreeing = agreeing
        self._session = session
        self._seeing = seeing
        self._shown: tuple[OtherAnnotation, ...] = ()
        self._own_number: int | None = None
        self._hidden: frozenset[str] = frozenset()
        self._job: Job | None = None
        self._loaded: object = None
        self._reason = ""
        self._differences: Remembered[tuple[Difference, ...]] = Remembered()
        session.volume_changed.connect(self._on_session_volume_changed)
        session.view_changed.connect(self._on_session_view_changed)
        seeing.permission_changed.connect(self._on_seeing_permission_changed)
        agreeing.computed.connect(self.reload)

    @property
    def is_wanted(self) -> bool:
        """Whether a person has asked for the others' annotations."""
        return "others" in self._session.view.layers

    @property
    def shown(self) -> tuple[OtherAnnotation, ...]:
        """The others' annotations in the order of the annotators, those switched off among them."""
        return self._shown

    @property
    def drawn(self) -> tuple[OtherAnnotation, ...]:
        """Those that are drawn into the volume."""
        return tuple(other for other in self._shown if other.visible)

    @property
    def unnamed(self) -> frozenset[str]:
        """The keypoints that are to be named beside the others' marks, as one's own have no place."""
        if "names" not in self._session.view.layers:
            return frozenset()
        theirs = {name for other in self.drawn for name in other.positions_um}
        return frozenset(theirs - self._session.shown_positions_um().keys())

    @property
    def reason(self) -> str:
        """Why nothing is shown though it is wanted, as a sentence without its full stop; else empty."""
        return self._reason

    def differences(self) -> tuple[Difference, ...]:
        """Return the lines from where each annotator has a keypoint to what it is compared with."""
        own_um = self._session.shown_positions_um()
        return self._differences.result(_differences, self._own_number, own_um, self._shown)

    def worst(self) -> str | None:
        """Return the keypoint on which those that are shown disagree most; None with fewer than two."""
        apart_um: dict[str, list[float]] = {}
        for line in self.differences():
            apart_um.setdefault(line.keypoint, []).append(math.dist(line.position_um, line.reference_um))
        return max(apart_um, key=lambda name: float(np.mean(apart_um[name])), default=None)

    def mean_um(self, name: str) -> Vector | None:
        """Return the mean of where those that are drawn have a keypoint or a box; None where none has it."""
        places_um = [
            other.boxes[name].center_um if name in other.boxes else other.positions_um.get(name)
            for other in self.drawn
            if other.annotator != CONSENSUS
        ]
        placed_um = [place_um for place_um in places_um if place_um is not None]
        return vector(np.mean(placed_um, axis=0)) if placed_um else None

    def want(self) -> None:
        """Show the others' annotations if they may be seen; ``reason`` says why not."""
        if not self.is_wanted:
            self._session.look(layers=self._session.view.layers | {"others"})

    def set_visible(self, annotator: str, visible: bool) -> None:
        """Show or hide one annotator's annotation, in this volume and those after it."""
        self._hidden = self._hidden - {annotator} if visible else self._hidden | {annotator}
        self._show(
            tuple(replace(other, visible=other.annotator not in self._hidden) for other in self._shown)
        )

    def reload(self) -> None:
        """Read the others' files again, if they are shown."""
        self._loaded = None
        self._follow()

    def _follow(self) -> None:
        """Load, keep or put away, by what is wanted and may be seen now."""
        session = self._session
        path, tool = session.annotation_path, session.tool
        if not self.is_wanted or session.document is None or path is None or tool is None:
            self._put_away("")
            return
        refusal = self._seeing.refusal
        if refusal:
            self._put_away(refusal)
            return
        wanted = (path, session.document.method)
        if wanted == self._loaded:
            return
        self._put_away("")
        self._loaded = wanted
        listed = self._listed()
        self._job = session.jobs.start(
            "Reading the other annotations",
            lambda _progress, cancelled: _read(path, tool, session.method, listed, cancelled),
            done=self._on_job_done,
            failed=self._on_job_failed,
            shown=False,
        )

    def _listed(self) -> tuple[str, ...]:
        """Return the annotators in the order of the report, so that both draw them alike."""
        result, study = self._agreeing.result, self._session.worklist.study
        compared = result.annotators if result is not None else ()
        return (*compared, *(study.annotators if study is not None else ()))

    def _put_away(self, reason: str) -> None:
        if self._job is not None:
            self._session.jobs.cancel(self._job)
        self._job = self._loaded = self._own_number = None
        is_new = reason != self._reason
        self._reason = reason
        if self._shown or is_new:
            self._show(())

    def _show(self, shown: tuple[OtherAnnotation, ...]) -> None:
        self._shown = shown
        self.changed.emit()

    def _on_job_done(self, read: "_Read") -> None:
        self._job = None
        session = self._session
        path = session.annotation_path
        if not self.is_wanted or path is None or self._seeing.refusal:
            self._follow()
            return
        if read.others and not self._seeing.note_shown("annotations"):
            self._loaded = None
            return
        self._own_number = read.own_number
        if not read.others:
            self._reason = _NOBODY.format(session.method)
            session.post_message(self._reason)
        self._show(
            tuple(replace(other, visible=other.annotator not in self._hidden) for other in read.others)
        )

    def _on_job_failed(self, error: Exception) -> None:
        self._job = self._loaded = None
        if isinstance(error, UserError):
            self._session.report(error)
        else:
            raise error

    def _on_session_volume_changed(self) -> None:
        # Even where the same volume was opened anew: nothing of the one before is left.
        self._put_away("")
        self._follow()

    def _on_session_view_changed(self, before: View, after: View) -> None:
        if ("others" in before.layers) != ("others" in after.layers):
            self._follow()
            if self._reason:
                self._session.post_message(self._reason)

    def _on_seeing_permission_changed(self) -> None:
        self._follow()


@dataclass(frozen=True)
class _Read:
    own_number: int | None
    others: tuple[OtherAnnotation, ...]


def _read(
    path: Path,
    tool: ToolSpecification,
    method: Method,
    listed: tuple[str, ...],
    cancelled: Callable[[], bool],
) -> _Read:
    """Read the others' documents of a volume, which lie in the folders beside that of one's own document."""
    name = annotation_name(path)
    if name is None or len(path.parents) < 3 or path.parents[1].name != "annotations":
        return _Read(None, ())
    me, folder = path.parent.name, path.parents[2]
    first_pass = AnnotationName(name.volume_id, method)
    people = people_of(folder)
    documents: dict[str, Annotation] = {}
    for person in people:
        if cancelled():
            raise Cancelled
        document = _document(folder, person, first_pass) if person != me else None
        if document is not None and document.tool == tool.name and has_placed(document):
            documents[person] = document
    ordered = in_order(people, listed)
    if me not in ordered:
        # After all whom the report counts: nobody is drawn otherwise because of who is looking.
        ordered = (*ordered, me)
    short = initials(ordered)
    others = tuple(
        OtherAnnotation(
            person,
            documents[person],
            keypoint_positions_um(documents[person], tool),
            documents[person].placed_boxes,
            number,
            short[person],
        )
        for number, person in enumerate(ordered)
        if person in documents
    )
    return _Read(None if me == CONSENSUS else ordered.index(me), others)


def _document(folder: Path, person: str, name: AnnotationName) -> Annotation | None:
    volume_ids = [name.volume_id]
    if study_folder_of(folder / "annotations") is None:
        # Beside loose volumes some name their files after the volume without its ending.
        volume_ids.append(name.volume_id.split(".")[0])
    for volume_id in volume_ids:
        # Absent, or one that its own author is told about.
        with contextlib.suppress(UserError):
            return load_annotation(annotation_path(folder, person, volume_id, name.method))[0]
    return None


def _differences(
    own_number: int | None, own_um: Mapping[str, Vector], shown: tuple[OtherAnnotation, ...]
) -> tuple[Difference, ...]:
    # The consensus is made from the others: it counts in no mean of them.
    compared = [other for other in shown if other.visible and other.annotator != CONSENSUS]
    return differences(own_number, own_um, {other.number: other.positions_um for other in compared})
