"""Brings the slices of the open volume in full resolution, without ever letting the GUI wait for the disk."""

from PySide6.QtCore import QObject, Qt, Signal

from annotations.errors import UserError
from annotations.volumes import SliceImage
from annotator.looks.redrawing import Redrawing
from annotator.session import Session
from annotator.slices.slice_readers import SliceReaders, SliceSource

# 45 slices of a full volume across x.
CACHE_BYTES = 96 * 2**20
# A longer way to the next slice is a jump, and tells nothing about the one after.
LONGEST_STEP = 10
# The threads end at once but for one that hangs in a read; that one is let go.
CLOSING_PATIENCE_S = 1.0


class SliceFetcher(QObject):
    """Reads slices of the session's volume in the background, for all slice views of one window.

    A view asks for a slice and gets it at once if it is in memory; else it comes with ``slice_arrived``,
    unless the view has asked for another one meanwhile. A volume that cannot be read is told once, through
    the session's ``error_raised``; the next readings are tried all the same, for the disk may come back.

    Signals
    -------
    slice_arrived : SliceImage
        In full resolution, and where that takes long, before it once as the screen can show it.
    reading_failed
        ``is_failing`` became true.
    """

    slice_arrived = Signal(object)
    reading_failed = Signal()
    _read = Signal(object, object)
    _failed = Signal(object, object)

    def __init__(
        self, session: Session, parent: QObject | None = None, *, cache_bytes: int = CACHE_BYTES
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._cache_bytes = cache_bytes
        self._source: SliceSource | None = None
        self._last: dict[int, tuple[int, int]] = {}
        self._failing = False
        self._told = False
        self._read.connect(self._on_readers_read, Qt.ConnectionType.QueuedConnection)
        self._failed.connect(self._on_readers_failed, Qt.ConnectionType.QueuedConnection)
        readers = SliceReaders(self._read.emit, self._failed.emit)
        self._readers = readers
        self._beginning = Redrawing(readers.begin, self)
        # Without self in it: the threads must end with the object, however that comes about.
        self.destroyed.connect(readers.stop)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._on_session_volume_changed()

    @property
    def is_failing(self) -> bool:
        """Whether the last reading failed."""
        return self._failing

    def fetch(self, axis: int, index: int, every: tuple[int, int] = (1, 1)) -> SliceImage | None:
        """Return a slice in full resolution if it is in memory, and have it read if it is not.

        Either way the slices that scrolling on will want are read next.

        Parameters
        ----------
        axis, index : int
        every : (int, int)
            Of the slice's voxels along its two axes, in their order, each how many-th has a pixel of the
            screen.
        """
        if self._source is None:
            return None
        last_index, step = self._last.get(axis, (index, 0))
        # Who asks for the same one again still scrolls as before.
        if index != last_index:
            step = index - last_index if abs(index - last_index) <= LONGEST_STEP else 0
        self._last[axis] = (index, step)
        self._readers.wish(axis, index, step, every)
        return self._source.cache.get(axis, index)

    def close(self) -> None:
        """End the reading; nothing arrives any more."""
        self._source = None
        self._readers.stop()
        self._readers.wait(CLOSING_PATIENCE_S)

    def _on_session_volume_changed(self) -> None:
        volume, spacing_um = self._session.volume, self._session.spacing_um
        self._last.clear()
        self._failing = self._told = False
        self._source = None
        if volume is not None and spacing_um is not None:
            self._source = SliceSource(volume, spacing_um, self._cache_bytes)
        self._readers.use(self._source)
        # The first pictures have all processors for themselves, and then the threads that read.
        self._beginning.ask_apart()

    def _on_readers_read(self, source: SliceSource, image: SliceImage) -> None:
        if source is self._source:
            self._failing = False
            self.slice_arrived.emit(image)

    def _on_readers_failed(self, source: SliceSource, error: Exception) -> None:
        if source is not self._source:
            return
        self._failing = True
        self.reading_failed.emit()
        if self._told:
            return
        self._told = True
        if not isinstance(error, UserError):
            # Not foreseen, so it belongs into the log, and in this thread the application puts it there.
            raise error
        self._session.report(error)
