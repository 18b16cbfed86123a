"""The session's review of predictions: what the loaded checkpoints are worth, and the walk through it."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from annotations.documents.annotation import Annotation
from annotations.errors import UserError
from annotator.session.agreement.agreeing import Agreeing, subject_of
from annotator.session.agreement.opinion_watch import file_marks
from annotator.session.files.saving import SessionSaving
from annotator.session.jobs import WHEN_SHOWN_MS, Job
from annotator.session.predictions.predicting import Predicting
from annotator.session.predictions.review import Review, changed_review, computed_review, review_marks
from annotator.session.remembered import Remembered
from annotator.session.volumes.worklist import NAMELESS, WorkItem

if TYPE_CHECKING:
    from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable
    from annotations.prediction.report.material import JudgedCheckpoint

_NO_STUDY = "Open a study: predictions are held against what its people say"
_NO_CHECKPOINT = "Load a checkpoint first"
_NOTHING_TO_WALK = "There are no errors to walk through: let the checkpoint predict, and compute them"
_LAST, _FIRST = (
    "This is the last volume of the list of errors",
    "This is the first volume of the list of errors",
)
# After a save or a prediction others may follow at once.
_SETTLES_MS = 800
# Whoever comes back sees the panel first: hundreds of files are looked at beside the painting otherwise.
_LOOKS_AFTER_MS = 500


class Reviewing(QObject):
    """Holds what checkpoints predicted against what people say, and walks from the worst volume to the best.

    Somebody who looks at it sees it follow: predictions that are written, annotations that are saved here,
    and, each time that they come back to it, what others have changed.

    Signals
    -------
    changed
        Anything that this class tells may have changed.
    computed
        A review has succeeded.
    """

    changed = Signal()
    computed = Signal()

    def __init__(
        self,
        session: SessionSaving,
        predicting: Predicting,
        agreeing: Agreeing,
        open_item: Callable[[int], object],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._predicting = predicting
        self._agreeing = agreeing
        self._open_item = open_item
        self._review: Review | None = None
        self._is_stale = False
        self._is_due = True
        self._is_followed = False
        self._has_edited = False
        self._computing: Job | None = None
        self._looking: Job | None = None
        self._order: tuple[str, ...] | None = None
        self._going_to: str | None = None
        self._goes_to_worst = False
        self._places: Remembered[Mapping[str, int]] = Remembered()
        self._rows: Remembered[Mapping[str, ErrorsOfVolume]] = Remembered()
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(_SETTLES_MS)
        self._timer.timeout.connect(self._follow)
        self._before_look = QTimer(self)
        self._before_look.setSingleShot(True)
        self._before_look.setInterval(_LOOKS_AFTER_MS)
        self._before_look.timeout.connect(self._look_for_changes)
        predicting.checkpoints_changed.connect(self._on_predicting_checkpoints_changed)
        predicting.truth_changed.connect(self._on_something_written)
        predicting.predicted.connect(self._on_something_written)
        predicting.running_changed.connect(self._on_predicting_running_changed)
        session.document_changed.connect(self._on_session_document_changed)
        session.save_state_changed.connect(self._on_session_save_state_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        session.worklist_changed.connect(self._on_session_worklist_changed)

    # What there is

    @property
    def refusal(self) -> str:
        """Why the errors are not for this person here, as a sentence without its full stop; or empty."""
        if self._session.worklist.study is None:
            return _NO_STUDY
        return self._agreeing.refusal

    @property
    def may_compute(self) -> bool:
        """Whether there is a checkpoint whose errors may be computed."""
        return bool(self._predicting.checkpoints) and not self.refusal

    @property
    def review(self) -> Review | None:
        """What was computed last for the study that is open."""
        return self._review

    @property
    def current(self) -> "JudgedCheckpoint | None":
        """The part of the review that is about the checkpoint in use."""
        checkpoint = self._predicting.current
        if self._review is None or checkpoint is None:
            return None
        return self._review.by_sha256.get(checkpoint.sha256)

    @property
    def table(self) -> "ErrorTable | None":
        """The errors of the checkpoint in use."""
        return self.current.table if self.current is not None else None

    def row_of(self, volume: str | None) -> "ErrorsOfVolume | None":
        """Return the errors of the checkpoint in use in a volume; None where there are none."""
        rows = self._rows.result(_rows_of, self.table)
        return None if volume is None else rows.get(volume)

    @property
    def is_stale(self) -> bool:
        """Whether something has changed since the errors were computed."""
        return self._is_stale

    @property
    def is_computing(self) -> bool:
        """Whether errors are being computed."""
        return self._computing is not None

    def index_of(self, volume: str) -> int | None:
        """Return where the first pass over a volume stands among the session's items."""
        return self._places.result(_places_of, self._session.items).get(volume)

    def volume_label(self, volume: str) -> str:
        """Return how a volume is called where it is shown to the person: in blind work by its number."""
        if not self._session.is_blind:
            return volume
        place = self.index_of(volume)
        return NAMELESS if place is None else self._session.items[place].label

    @property
    def open_volume(self) -> str | None:
        """The id of the volume that is open."""
        index = self._session.current_index
        return None if index is None else self._session.items[index].volume_id

    # Computing

    def compute(self) -> None:
        """Compute the errors of all checkpoints, after what is open has been saved; ``computed`` follows."""
        reason = self.refusal or ("" if self._predicting.checkpoints else _NO_CHECKPOINT)
        if reason:
            self._session.post_message(reason)
            return
        if self._session.unsaved and not self._session.save():
            return
        self._predicting.show_open()
        self._start()

    def cancel(self) -> None:
        """Give up what is being computed."""
        self._timer.stop()
        # Whoever gives it up does not want it back before there is something new.
        self._is_due = False
        if self._computing is not None:
            self._session.jobs.cancel(self._computing)

    def follow(self, is_followed: bool) -> None:
        """Say whether somebody looks: only then is computed anew, by itself, what has changed."""
        self._is_followed = is_followed
        if is_followed:
            self._is_due = self._is_due or self._is_stale or self._review is None
            self._follow()
        else:
            self._before_look.stop()

    def look_for_changes(self) -> None:
        """Look soon, in the background, whether others' files are as they were read; if not, follow them."""
        self._before_look.start()

    # Walking

    @property
    def order(self) -> tuple[str, ...]:
        """The volumes, by their ids, in the order in which they are walked through."""
        if self._order is not None:
            return self._order
        return tuple(each.volume for each in self.current.ranking) if self.current is not None else ()

    def set_order(self, volumes: Sequence[str] | None) -> None:
        """Walk in the order of a list that is shown; None for that of the ranking."""
        self._order = None if volumes is None else tuple(volumes)

    @property
    def goes_to_worst(self) -> bool:
        """Whether the crosshair goes to the keypoint that is furthest off when a volume is opened."""
        return self._goes_to_worst

    def go_to_worst(self, wanted: bool) -> None:
        """Say whether it is to, from now on and in the open volume."""
        self._goes_to_worst = wanted
        if wanted:
            self._look_at_worst()
        self.changed.emit()

    def step(self, by: int) -> None:
        """Open the volume that stands so many places further in the order."""
        order = self.order
        if not order:
            self._session.post_message(_NOTHING_TO_WALK)
            return
        here = self._going_to or self.open_volume
        place = order.index(here) + by if here in order else (0 if by > 0 else len(order) - 1)
        if 0 <= place < len(order):
            self.open(order[place])
        else:
            self._session.post_message(_LAST if by > 0 else _FIRST)

    def open(self, volume: str) -> None:
        """Open a volume with its prediction over it; the camera and the other layers stay."""
        place = self.index_of(volume)
        if place is None:
            self._session.post_message(f"{self.volume_label(volume)} is not among the volumes that are open")
            return
        if place == self._session.current_index:
            self._show()
        else:
            # Only once it is open: what is open now is not to be shown with it on the way.
            self._going_to = volume
            self._open_item(place)

    def _show(self) -> None:
        self._session.look(layers=self._session.view.layers | {"prediction"})
        if self._goes_to_worst:
            self._look_at_worst()

    def _look_at_worst(self) -> None:
        volume, current = self.open_volume, self.current
        if current is None or volume is None:
            return
        row = self.row_of(volume)
        if row is None or not row.keypoints_um:
            return
        worst = max(row.keypoints_um, key=lambda name: row.keypoints_um[name])
        self._session.look(crosshair_um=current.predictions[volume].positions_um[worst])

    # Following

    def _look_for_changes(self) -> None:
        review = self._review
        if review is None or self._looking is not None or self._is_stale:
            return

        def on_looked(has_changed: bool) -> None:
            self._looking = None
            if has_changed and review is self._review:
                self._on_something_written()

        def on_given_up(_error: Exception | None = None) -> None:
            # A share that does not answer now: whoever reads the files will say so.
            self._looking = None

        self._looking = self._session.jobs.start(
            "Looking at the annotations and predictions",
            lambda _progress, _cancelled: review_marks(review.folder, review.checkpoints) != review.marks,
            done=on_looked,
            failed=on_given_up,
            cancelled=on_given_up,
            shown=False,
        )

    def _follow_saved(self) -> bool:
        """Compute the open volume's errors again after a save here; False where all is to be read again."""
        review, volume, document = self._review, self.open_volume, self._session.document
        path = self._session.annotation_path
        is_at_rest = self._computing is None and not self._is_stale and not self._is_due and self._is_followed
        if review is None or volume is None or document is None or path is None or not is_at_rest:
            return False
        if self.refusal or not review.is_spoken_by(volume, document, path):
            return False
        saved = file_marks([path])
        self._computing = self._session.jobs.start(
            "Computing the errors",
            lambda _progress, _cancelled: changed_review(review, volume, document, path, saved),
            done=self._take,
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
        )
        self.changed.emit()
        return True

    def _start(self) -> None:
        worklist, checkpoints = self._session.worklist, self._predicting.checkpoints
        study, folder, person = worklist.study, worklist.folder, self._session.person
        if study is None:
            return
        truth = self._predicting.truth
        self.cancel()
        self._is_stale = False
        self._computing = self._session.jobs.start(
            "Computing the errors",
            lambda progress, cancelled: computed_review(
                folder, study, person, checkpoints, truth, progress, cancelled
            ),
            done=self._take,
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
            delay_ms=WHEN_SHOWN_MS,
        )
        self.changed.emit()

    def _take(self, review: Review) -> None:
        self._computing = None
        # What has changed meanwhile.
        self._timer.start()
        if review.folder == self._session.worklist.folder and not self.refusal:
            self._review = review
            self._order = None
            self.changed.emit()
            self.computed.emit()
        else:
            # Of what was open before.
            self._is_due = True
            self.changed.emit()

    def _follow(self) -> None:
        """Compute what is due, where somebody looks and nothing is under way."""
        is_at_rest = self._computing is None and not self._predicting.is_predicting
        if self._is_due and self._is_followed and is_at_rest and self.may_compute:
            self._start()

    def _forget(self) -> None:
        self.cancel()
        self._review = self._order = self._going_to = None
        self._is_stale = False

    def _on_job_failed(self, error: Exception) -> None:
        self._computing = None
        self._is_stale = True
        self.changed.emit()
        if not isinstance(error, UserError):
            raise error
        self._session.report(error)

    def _on_job_cancelled(self) -> None:
        if self._computing is not None and self._computing.state == "cancelled":
            self._computing = None
            self._is_stale = self._review is not None
            self.changed.emit()

    def _on_something_written(self) -> None:
        self._is_due = True
        if self._review is not None or self._computing is not None:
            self._is_stale = True
        self._timer.start()
        self.changed.emit()

    def _on_predicting_checkpoints_changed(self) -> None:
        self._order = None
        known = self._review.checkpoints if self._review is not None else ()
        self._is_due = self._is_due or known != self._predicting.checkpoints
        self._timer.start()
        self.changed.emit()

    def _on_predicting_running_changed(self) -> None:
        self._timer.start()
        self.changed.emit()

    def _on_session_document_changed(self, before: Annotation | None, after: Annotation | None) -> None:
        # Another volume's document is no edit.
        self._has_edited = (
            before is not None and after is not None and subject_of(before) == subject_of(after)
        )

    def _on_session_save_state_changed(self) -> None:
        if self._has_edited and not self._session.unsaved:
            self._has_edited = False
            if not self._follow_saved():
                self._on_something_written()

    def _on_session_volume_changed(self) -> None:
        self._has_edited = False
        is_there = self._going_to is not None and self.open_volume == self._going_to
        if self._session.volume is not None:
            self._going_to = None
        if is_there:
            # After every view has drawn the new volume.
            QTimer.singleShot(0, self, self._show)
        self.changed.emit()

    def _on_session_worklist_changed(self) -> None:
        folder = self._session.worklist.folder
        if self._review is not None and (self._review.folder != folder or self.refusal):
            self._forget()
            self._is_due = True
        self._timer.start()
        self.changed.emit()


def _rows_of(table: "ErrorTable | None") -> "Mapping[str, ErrorsOfVolume]":
    return {} if table is None else {row.volume: row for row in table.rows}


def _places_of(items: tuple[WorkItem, ...]) -> Mapping[str, int]:
    return {
        item.volume_id: place
        for place, item in enumerate(items)
        if item.volume_id is not None and not item.repeat
    }
