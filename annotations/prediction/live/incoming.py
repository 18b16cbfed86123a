"""A folder that receives volumes: which of them are whole, and since when.

When a volume is taken to be whole:

- A ``.npy`` file says in its header how long it is. One that was seen growing is whole as soon as it has that
  length. One that has it when it is first seen was moved here under its name, or written within milliseconds;
  or its writer has reserved the space and still fills it. It is whole when something was done to it after its
  last write, such as a renaming (its time of change is later than that of its content), else once it has
  rested: its size, its times and a few blocks of it stayed as they are.
- Any other file does not tell how long it will be. It is whole when something was done to it after its last
  write, or once it has rested, and it opens.
- A Zarr folder is whole once nothing in it has changed for a while, and it opens.

How long a rest is enough depends on what is known: see `IncomingFolder._rest_s`.

So the sure way to hand a volume over, whatever its format, is to write it under a hidden name (``.v7.npy``),
or in another folder of the same disk, and then to rename it: it is taken at once, and only when it is whole.
"""

import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from annotations.errors import UserError
from annotations.prediction.live.arrival import Arrival, News, Unfinished, arrived
from annotations.prediction.live.probe import Probe, probe_of
from annotations.prediction.live.writers import has_writer
from annotations.volumes import VolumeError
from annotations.volumes.opening import SUFFIXES, is_zarr
from annotations.volumes.readers import npy
from annotations.volumes.volume import unreadable

QUIET_NPY_S = 0.03
QUIET_FILE_S = 0.25
QUIET_FOLDER_S = 0.5
QUIET_HELD_S = 0.5
"""Of a file that somebody has open for writing."""
QUIET_BLANK_S = 1.0
"""Of one that has its length, but perhaps not its values."""
PATIENCE_S = 1.0
"""How long a file that cannot be opened is taken for one that is still being written."""
ABANDONED_S = 10.0
"""How long one that was seen being written, or that is open for writing and not filled yet."""
_RESTS_PER_PAUSE = 4.0
_LONGEST_REST_S = 2.0
"""Asked of a file because of the pauses of its writer."""

_TICK_NS = 1_000_000


@dataclass(frozen=True)
class _State:
    """By which a change of a file is noticed."""

    inode: int
    size: int
    written_ns: int
    changed_ns: int
    is_folder: bool

    def has_content_of(self, other: "_State") -> bool:
        """Say whether nothing was written between the two; links and permissions may have changed."""
        return (self.inode, self.size, self.written_ns) == (other.inode, other.size, other.written_ns)

    @property
    def is_moved_in(self) -> bool:
        """Whether something was done to it after its last write. Never so on Windows, which cannot tell."""
        return os.name != "nt" and self.changed_ns > self.written_ns + _TICK_NS

    @property
    def moment_s(self) -> float:
        """When it became what it is, as its file system has it."""
        return max(self.written_ns, self.changed_ns if os.name != "nt" else 0) / 1e9


@dataclass
class _Entry:
    """What is known of a name in the folder."""

    state: _State
    since_s: float
    """Of the look before the one that noticed the state: the change was later than that."""
    noticed_s: float
    begun_s: float
    """When the first of the changes that led to the state was noticed."""
    is_timed: bool
    is_settled: bool = False
    """Whether it was handed out, or its error told, or it was there before."""
    was_settled: bool = False
    """Whether that is so of what the same file held before."""
    extent: tuple[int, int] | None = None
    """Lengths in bytes of the header and of the whole, where a NumPy header says so."""
    has_grown: bool = False
    """Whether it was seen with a part of its values."""
    pause_s: float = 0.0
    """The longest one between two of its changes; 0 where there was one change only."""
    probe: Probe | None = None

    def follow(self, before: "_Entry") -> None:
        """Take over what the same file's last entry knows."""
        if before.is_settled:
            self.was_settled = True
            return
        self.was_settled, self.begun_s, self.extent = before.was_settled, before.begun_s, before.extent
        self.pause_s = max(before.pause_s, self.noticed_s - before.noticed_s)
        header, whole = before.extent or (0, 0)
        self.has_grown = before.has_grown or header < before.state.size < whole

    @property
    def share(self) -> float | None:
        """How much of its values there is, of one that grows."""
        if self.extent is None or self.state.size >= self.extent[1]:
            return None
        header, whole = self.extent
        return max(0, self.state.size - header) / (whole - header)


class IncomingFolder:
    """Finds the volumes that come into a folder; look at it often.

    Parameters
    ----------
    folder : Path
    clock : callable, optional
        Gives the time in seconds, as `time.time`.

    Raises
    ------
    VolumeError
        There is no such folder, or it cannot be read.
    """

    def __init__(self, folder: Path, clock: Callable[[], float] = time.time) -> None:
        self._folder = folder.absolute()
        try:
            os.scandir(self._folder).close()
        except OSError as error:
            raise unreadable(self._folder, error) from error
        self._clock = clock
        self._entries: dict[str, _Entry] | None = None
        self._looked_s = 0.0

    def look(self) -> News:
        """Return the volumes that have become whole since the last look.

        At the first look that is the newest of those that are there, if it is whole; the others are left out.

        Raises
        ------
        VolumeError
            The folder cannot be read.
        """
        now_s = self._clock()
        states = dict(self._states())
        if self._entries is None:
            self._entries = self._present(states, now_s)
        entries = self._entries
        for name in entries.keys() - states.keys():
            del entries[name]
        for name, state in states.items():
            self._notice(name, state, now_s)
        self._looked_s = now_s
        arrivals, errors = [], []
        for name, entry in entries.items():
            if entry.is_settled:
                continue
            try:
                arrival = self._whole(name, entry, now_s)
            except UserError as error:
                errors.append(error)
                entry.is_settled = True
            else:
                if arrival is not None:
                    arrivals.append(arrival)
                    entry.is_settled = True
        unfinished = tuple(
            Unfinished(self._folder / name, entry.share)
            for name, entry in entries.items()
            if not entry.is_settled and now_s - entry.begun_s >= PATIENCE_S
        )
        return News(
            tuple(sorted(arrivals, key=lambda arrival: arrival.appeared_s)),
            tuple(errors),
            unfinished=unfinished,
        )

    def _states(self) -> Iterator[tuple[str, _State]]:
        try:
            with os.scandir(self._folder) as found:
                for each in found:
                    if each.name.startswith("."):
                        continue
                    try:
                        state = self._state(each)
                    except OSError:
                        # Gone since, or not ours to look at.
                        continue
                    if state is not None:
                        yield each.name, state
        except FileNotFoundError as error:
            raise VolumeError(
                "the folder that receives the volumes is gone",
                where=self._folder,
                remedy="Make it again, or connect its disk, and start the view again",
            ) from error
        except OSError as error:
            raise unreadable(self._folder, error) from error

    def _state(self, entry: "os.DirEntry[str]") -> _State | None:
        is_folder = entry.is_dir()
        if not is_folder and os.path.splitext(entry.name)[1].lower() not in SUFFIXES:  # noqa: PTH122 - faster
            return None
        # On Windows this is what the folder says, which is of when the file was last closed: the better.
        own = entry.stat()
        written_ns, size = own.st_mtime_ns, own.st_size
        if is_folder:
            path = Path(entry.path)
            if not is_zarr(path):
                return None
            for inside in path.rglob("*"):
                found = inside.stat()
                written_ns, size = max(written_ns, found.st_mtime_ns), size + found.st_size
        return _State(own.st_ino, size, written_ns, own.st_ctime_ns, is_folder)

    def _present(self, states: dict[str, _State], now_s: float) -> dict[str, _Entry]:
        newest = max(states, key=lambda name: states[name].moment_s, default=None)
        return {
            name: _Entry(state, now_s, now_s, now_s, is_timed=False, is_settled=name != newest)
            for name, state in states.items()
        }

    def _notice(self, name: str, state: _State, now_s: float) -> None:
        assert self._entries is not None
        entry = self._entries.get(name)
        if entry is not None and entry.state.has_content_of(state):
            entry.state = state
            return
        fresh = _Entry(state, self._looked_s, now_s, now_s, is_timed=True)
        if entry is not None and entry.state.inode == state.inode:
            fresh.follow(entry)
        self._entries[name] = fresh

    def _whole(self, name: str, entry: _Entry, now_s: float) -> Arrival | None:
        """Return a volume that is whole, or None where it may not be; raise where it never will be."""
        path = self._folder / name
        try:
            if not self._may_be_whole(path, entry, now_s):
                return None
            return arrived(path, self._appeared_s(entry), is_timed=entry.is_timed)
        except FileNotFoundError:
            return None
        except (VolumeError, OSError) as error:
            patience_s = PATIENCE_S if entry.pause_s == 0 else ABANDONED_S
            if now_s - entry.noticed_s < patience_s or not path.exists():
                return None
            raise error if isinstance(error, UserError) else unreadable(path, error) from error

    def _may_be_whole(self, path: Path, entry: _Entry, now_s: float) -> bool:
        state = entry.state
        if state.size == 0:
            return False
        if not state.is_folder and entry.extent is None:
            entry.extent = _npy_extent(path)
        if entry.extent is not None and (state.size < entry.extent[1] or entry.has_grown):
            return state.size >= entry.extent[1]
        if not state.is_folder and state.is_moved_in:
            return True
        if entry.probe is None and entry.extent is not None:
            entry.probe = probe_of(path, *entry.extent)
        quiet_s = now_s - entry.noticed_s
        if quiet_s < QUIET_NPY_S or quiet_s < self._rest_s(path, entry):
            return False
        if entry.extent is None or (probe := probe_of(path, *entry.extent)) == entry.probe:
            return True
        # Written through a mapping, which the times of a file do not tell everywhere.
        entry.probe, entry.pause_s = probe, max(entry.pause_s, quiet_s)
        entry.since_s, entry.noticed_s = self._looked_s, now_s
        return False

    def _rest_s(self, path: Path, entry: _Entry) -> float:
        """Return for how long a file has to stay as it is before it is taken to be whole.

        Several times the longest pause that its writer has made so far, up to `_LONGEST_REST_S`; and at least

        - `ABANDONED_S` where somebody has it open for writing, and an end of it is still blank,
        - `QUIET_HELD_S` where somebody has it open for writing, and that is not so,
        - `QUIET_BLANK_S` where an end is blank, and nobody can say who has it open, or parts are not stored,
        - `QUIET_FILE_S` where what it held before was shown already, and nobody can say who has it open,
        - else what is usual for its kind.
        """
        if entry.state.is_folder:
            least_s = QUIET_FOLDER_S
        else:
            is_held = has_writer(path)
            probe = entry.probe
            is_blank = probe is not None and probe.is_blank_at_an_end
            has_holes = probe is not None and probe.has_holes
            if is_held:
                least_s = ABANDONED_S if is_blank else QUIET_HELD_S
            elif is_blank and (is_held is None or has_holes):
                least_s = QUIET_BLANK_S
            elif entry.extent is None or (is_held is None and entry.was_settled):
                least_s = QUIET_FILE_S
            else:
                least_s = QUIET_NPY_S
        return max(least_s, min(_RESTS_PER_PAUSE * entry.pause_s, _LONGEST_REST_S))

    def _appeared_s(self, entry: _Entry) -> float:
        """Return when it became what it is: by its file system, as far as that fits what was seen."""
        return min(max(entry.state.moment_s, entry.since_s), entry.noticed_s)


def _npy_extent(path: Path) -> tuple[int, int] | None:
    """Return the lengths in bytes of the header and of all of a NumPy file; None for any other file."""
    with path.open("rb") as stream:
        if stream.read(len(npy.MAGIC)) != npy.MAGIC:
            return None
        stream.seek(0)
        try:
            header = npy.read_npy_header(stream, path)
        except (VolumeError, ValueError, EOFError):
            return None
    return header.length, header.length + math.prod(header.shape) * header.dtype.itemsize
