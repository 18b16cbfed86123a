"""A folder that receives volumes: which of them are whole, and since when.

When a volume is taken to be whole:

- A ``.npy`` file says in its header how long it is. One that was seen growing is whole as soon as it has that
  length. One that has it when it is first seen was moved here under its name, or written within milliseconds;
  or its writer has reserved the space and still fills it. It is whole when something was done to it after its
  last write, such as a renaming (its time of change is later than that of its content), else once it has
  stayed as it is for 30 ms.
- Any other file does not tell how long it will be. It is whole when something was done to it after its last
  write, or it has stayed as it is for a quarter of a second, and it opens.
- A Zarr folder is whole when nothing in it has changed for half a second, and it opens.

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
from annotations.prediction.live.arrival import Arrival, News, arrived
from annotations.volumes import VolumeError
from annotations.volumes.opening import SUFFIXES, is_zarr
from annotations.volumes.readers import npy
from annotations.volumes.volume import unreadable

QUIET_NPY_S = 0.03
QUIET_FILE_S = 0.25
QUIET_FOLDER_S = 0.5
PATIENCE_S = 1.0
"""How long a file that cannot be opened is taken for one that is still being written."""

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
    is_timed: bool
    is_settled: bool = False
    """Whether it was handed out, or its error told, or it was there before."""
    extent: tuple[int, int] | None = None
    """Lengths in bytes of the header and of the whole, where a NumPy header says so."""
    has_grown: bool = False
    """Whether it was seen with a part of its values."""


class IncomingFolder:
    """Finds the volumes that come into a folder; look at it often.

    Parameters
    ----------
    folder : Path
    clock : callable, optional
        Gives the time in seconds, as `time.time`.
    """

    def __init__(self, folder: Path, clock: Callable[[], float] = time.time) -> None:
        self._folder = folder.absolute()
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
        return News(tuple(sorted(arrivals, key=lambda arrival: arrival.appeared_s)), tuple(errors))

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
            name: _Entry(state, now_s, now_s, is_timed=False, is_settled=name != newest)
            for name, state in states.items()
        }

    def _notice(self, name: str, state: _State, now_s: float) -> None:
        assert self._entries is not None
        entry = self._entries.get(name)
        if entry is not None and entry.state.has_content_of(state):
            entry.state = state
            return
        fresh = _Entry(state, self._looked_s, now_s, is_timed=True)
        if entry is not None and entry.state.inode == state.inode and not entry.is_settled:
            fresh.extent = entry.extent
            header, whole = entry.extent or (0, 0)
            fresh.has_grown = entry.has_grown or header < entry.state.size < whole
        self._entries[name] = fresh

    def _whole(self, name: str, entry: _Entry, now_s: float) -> Arrival | None:
        """Return a volume that is whole, or None where it may not be; raise where it never will be."""
        path, quiet_s = self._folder / name, now_s - entry.noticed_s
        try:
            if not self._may_be_whole(path, entry, quiet_s):
                return None
            return arrived(path, self._appeared_s(entry), is_timed=entry.is_timed)
        except FileNotFoundError:
            return None
        except (VolumeError, OSError) as error:
            if quiet_s < PATIENCE_S or not path.exists():
                return None
            raise error if isinstance(error, UserError) else unreadable(path, error) from error

    def _may_be_whole(self, path: Path, entry: _Entry, quiet_s: float) -> bool:
        state = entry.state
        if state.is_folder:
            return quiet_s >= QUIET_FOLDER_S
        if entry.extent is None:
            entry.extent = _npy_extent(path)
        if entry.extent is None:
            return state.is_moved_in or quiet_s >= QUIET_FILE_S
        if state.size < entry.extent[1]:
            # Given up after a while: opening it says what is wrong.
            return quiet_s >= PATIENCE_S
        return state.is_moved_in or entry.has_grown or quiet_s >= QUIET_NPY_S

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
