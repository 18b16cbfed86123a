"""The session's live view: volumes that arrive one after the other, and what a checkpoint says of each."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Qt, Signal

from annotations.errors import UserError
from annotator.session.editing.seeing import Seeing
from annotator.session.predictions.kept_volumes import KeptVolumes, kept_from_view
from annotator.session.predictions.predicting import Predicting
from annotator.session.state import SessionState
from annotator.session.volumes.spacing_answer import SpacingAnswer

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.live.arrival import Arrival
    from annotations.prediction.live.frame import LiveFrame
    from annotations.prediction.live.run import LiveRun
    from annotations.prediction.live.statistics import LiveStatistics

_PATIENCE_S = 2.0
_NO_CHECKPOINT = "Load a checkpoint first"


@dataclass(frozen=True)
class Playback:
    """How a recorded sequence is played.

    Attributes
    ----------
    rate_hz : float
        Volumes a second.
    loops : bool
        Whether the first follows the last.
    """

    rate_hz: float = 20.0
    loops: bool = True


class Living(QObject):
    """Lets the checkpoint in use look at volumes as they come, in a process of its own.

    Nothing is written, unless a person wants the predictions kept.

    Parameters
    ----------
    is_settled : callable
        See `read_path`.

    Signals
    -------
    running_changed
        ``is_running``, ``is_ready`` or ``is_restarting`` changed.
    frame_came
        `take_frame` has a frame.
    failed : UserError
        A volume cannot be shown, or the network's process has crashed; or that is why it is not started.
    stopped : UserError
        It was running, and that has ended it.
    kept_from_view
        What was shown is not to be seen any more, nor what was said: ``failed`` follows, and says why.
    grid_requested : Arrival
        Nobody says how far apart the voxels of such volumes are: answer with `provide_grid`, `decline_grid`,
        or `put_grid_off`.
    """

    running_changed = Signal()
    frame_came = Signal()
    failed = Signal(object)
    stopped = Signal(object)
    kept_from_view = Signal()
    grid_requested = Signal(object)
    _delivered = Signal(object)

    def __init__(
        self,
        session: SessionState,
        predicting: Predicting,
        seeing: Seeing,
        is_settled: Callable[[Path, str], bool],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._predicting = predicting
        self._seeing = seeing
        self._is_settled = is_settled
        self._run: LiveRun | None = None
        self._left: list[LiveRun] = []
        self._folder: Path | None = None
        self._kept: KeptVolumes | None = None
        self._checkpoint: Checkpoint | None = None
        self._is_ready = self._is_restarting = False
        self._grids: dict[tuple[Path, tuple[int, int, int]], SpacingAnswer] = {}
        self._statistics: LiveStatistics | None = None
        self._delivered.connect(self._on_delivered, Qt.ConnectionType.QueuedConnection)
        seeing.permission_changed.connect(self._on_seeing_permission_changed)

    @property
    def is_running(self) -> bool:
        """Whether volumes are shown as they come, or will be once the network is ready."""
        return self._run is not None

    @property
    def is_ready(self) -> bool:
        """Whether the network is ready."""
        return self._is_ready

    @property
    def is_restarting(self) -> bool:
        """Whether the network has crashed, and is being made ready anew."""
        return self._is_restarting

    @property
    def checkpoint(self) -> "Checkpoint | None":
        """The checkpoint that looks at volumes, or would if it were started."""
        return self._checkpoint if self._run is not None else self._predicting.current

    @property
    def statistics(self) -> "LiveStatistics | None":
        """How the present run keeps up, or how the last one did; None before the first."""
        if self._run is not None:
            self._statistics = self._run.statistics()
        return self._statistics

    def refusal(self, folder: Path) -> str:
        """Return why volumes of a folder may not be shown, without a full stop; empty where they may."""
        study = self._session.worklist
        if study.study is not None and (self._session.is_blind or not self._seeing.may_see_others()):
            there, own = folder.resolve(), study.folder.resolve()
            if own in (there, *there.parents) or there in own.parents:
                return kept_from_view(study.study, self._session.person)
        return self._kept_volumes().refusal_of_all(folder)

    def start(self, folder: Path, playback: Playback | None, *, keeps: bool) -> None:
        """Show volumes as they come; ``failed`` says why where that is not possible.

        Parameters
        ----------
        folder : Path
        playback : Playback or None
            Of the sequence in the folder; None for the volumes that arrive there.
        keeps : bool
            Whether the predictions are written, into ``predictions/<checkpoint>/`` in the folder.
        """
        from annotations.prediction.inference_process import (
            InferenceProcess,
        )  # late: few look at live volumes
        from annotations.prediction.live.incoming import IncomingFolder
        from annotations.prediction.live.run import Listener, LiveRun
        from annotations.prediction.live.sequence import RecordedSequence

        self.stop()
        checkpoint, refusal = self._predicting.current, self.refusal(folder)
        if refusal or checkpoint is None:
            self.failed.emit(UserError(refusal or _NO_CHECKPOINT))
            return
        try:
            source = (
                IncomingFolder(folder)
                if playback is None
                else RecordedSequence(folder, playback.rate_hz, loops=playback.loops)
            )
        except UserError as error:
            self.failed.emit(error)
            return

        def told(call: Callable[..., object]) -> Callable[..., None]:
            return lambda *given: self._delivered.emit((run, lambda: call(*given)))

        listener = Listener(
            ready=told(self._on_run_ready),
            restarting=told(self._on_run_restarting),
            frame_came=told(self.frame_came.emit),
            failed=told(self._on_run_failed),
            grid_needed=told(self._on_run_grid_needed),
            ended=told(self._on_run_ended),
        )
        network = InferenceProcess(checkpoint.path, sha256=checkpoint.sha256)
        run = LiveRun(source, network, listener, folder if keeps else None)
        self._run, self._folder, self._checkpoint = run, folder, checkpoint
        self._kept = self._kept_volumes()
        run.start()
        self.running_changed.emit()

    def stop(self) -> None:
        """Show no more volumes, and end the process; does nothing where it is not running."""
        if self._run is None:
            return
        # Nothing comes any more.
        self._statistics = replace(self._run.statistics(), rate_hz=0.0, unfinished=())
        self._run.stop()
        self._left = [*(run for run in self._left if run.is_alive), self._run]
        self._run, self._is_ready, self._is_restarting = None, False, False
        self.running_changed.emit()

    def leave(self) -> None:
        """Stop, where what was shown is gone as well: nothing of it can become what is not to be seen."""
        self.stop()
        self._folder = None

    def close(self) -> None:
        """Stop, and wait a moment for the process to end."""
        self.stop()
        for run in self._left:
            run.join(_PATIENCE_S)
        self._left.clear()

    def take_frame(self) -> "LiveFrame | None":
        """Return the newest frame that was not taken yet; `note_shown` follows when it is on screen."""
        frame = None if self._run is None else self._run.take()
        return None if frame is None or self._withdraw(frame.volume_path) else frame

    def note_shown(self) -> None:
        """Count the frame that was taken last as one that is on screen now."""
        if self._run is not None:
            self._run.note_shown()

    def provide_grid(self, arrival: "Arrival", answer: SpacingAnswer) -> None:
        """Answer ``grid_requested``, for as long as the program runs, for all of this shape in the folder."""
        self._grids[arrival.volume_path.parent, arrival.shape] = answer
        self._tell_grid(arrival, answer)

    def decline_grid(self, arrival: "Arrival") -> None:
        """Answer ``grid_requested``: until the next start no volume of this shape is shown."""
        if self._run is not None:
            self._run.decline_grid(arrival.shape)

    def put_grid_off(self, arrival: "Arrival") -> None:
        """Answer ``grid_requested`` for a volume that is gone: the next one of its shape is asked about."""
        if self._run is not None:
            self._run.put_grid_off(arrival.shape)

    def _tell_grid(self, arrival: "Arrival", answer: SpacingAnswer) -> None:
        from annotations.prediction.live.voxel_grids import VoxelGrid

        if self._run is not None:
            self._run.tell_grid(arrival.shape, VoxelGrid(answer.spacing_um, answer.depth_axis))

    def _on_delivered(self, told: "tuple[LiveRun, Callable[[], object]]") -> None:
        run, call = told
        if run is self._run:
            call()

    def _on_run_ready(self) -> None:
        self._is_ready, self._is_restarting = True, False
        self.running_changed.emit()

    def _on_run_restarting(self) -> None:
        self._is_ready, self._is_restarting = False, True
        self.running_changed.emit()

    def _on_run_failed(self, error: UserError) -> None:
        # Its name alone may tell which volume it is.
        if error.where is None or not self._withdraw(Path(str(error.where))):
            self.failed.emit(error)

    def _on_run_grid_needed(self, arrival: "Arrival") -> None:
        if self._withdraw(arrival.volume_path):
            return
        answer = self._grids.get((arrival.volume_path.parent, arrival.shape))
        if answer is None:
            self.grid_requested.emit(arrival)
        else:
            self._tell_grid(arrival, answer)

    def _on_run_ended(self, error: Exception | None) -> None:
        # What came last may not have been taken yet.
        self.frame_came.emit()
        self.stop()
        if isinstance(error, UserError):
            if error.where is None or not self._withdraw(Path(str(error.where))):
                self.stopped.emit(error)
        elif error is not None:
            raise error

    def _kept_volumes(self) -> KeptVolumes:
        return KeptVolumes(self._session.worklist, self._session.person, self._is_settled)

    def _withdraw(self, volume_path: Path) -> bool:
        """Stop where a volume that has come is kept from view, as one that was linked to since may be."""
        refusal = "" if self._kept is None else self._kept.refusal(volume_path)
        if refusal:
            self._keep_from_view(refusal)
        return bool(refusal)

    def _keep_from_view(self, refusal: str) -> None:
        self.stop()
        self._folder = None
        self.kept_from_view.emit()
        self.failed.emit(UserError(refusal))

    def _on_seeing_permission_changed(self) -> None:
        # A run that has ended may have left its picture. What studies that are not open say has not changed.
        if self._folder is not None and self._session.worklist.study is not None:
            self._kept = self._kept_volumes()
            if refusal := self.refusal(self._folder):
                self._keep_from_view(refusal)
