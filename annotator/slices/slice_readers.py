"""One thread an axis that reads the slice wished for last, then the ones to come."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from annotations.geometry.frames import Vector
from annotations.volumes import SliceImage, Volume, VolumeError
from annotator.slices.projection import Plane
from annotator.slices.slice_cache import SliceCache
from annotator.slices.slice_reading import ReadingPlan, read_slices


class SliceSource:
    """A volume to read slices from, how to read them, and the ones that are in memory.

    Parameters
    ----------
    volume : Volume
    spacing_um : (float, float, float)
        Of the volume's voxels.
    cache_bytes : int
        What its slices may take in memory.
    """

    def __init__(self, volume: Volume, spacing_um: Vector, cache_bytes: int) -> None:
        self.volume = volume
        self.spacing_um = spacing_um
        self.cache = SliceCache(cache_bytes)
        self.plans = tuple(ReadingPlan.of(volume, axis) for axis in range(3))
        self.planes = tuple(
            Plane.across(axis, volume.shape, spacing_um, volume.depth_axis) for axis in range(3)
        )

    def read(self, axis: int, indices: range, given_up: Callable[[], bool]) -> tuple[SliceImage, ...]:
        """Read slices into the cache and return them; none if given up.

        They keep the volume's own type, so that the intensity under the cursor is the file's, and are laid
        out as they are drawn.
        """
        images = self._read(axis, indices, (1, 1), given_up)
        for image in images:
            self.cache.put(image)
        return images

    def overview(
        self, axis: int, index: int, every: tuple[int, int], given_up: Callable[[], bool]
    ) -> SliceImage | None:
        """Read some of a slice's voxels, one in so many along each of its axes; None if given up."""
        return next(iter(self._read(axis, range(index, index + 1), every, given_up)), None)

    def _read(
        self, axis: int, indices: range, every: tuple[int, int], given_up: Callable[[], bool]
    ) -> tuple[SliceImage, ...]:
        slices = read_slices(
            self.volume,
            self.plans[axis],
            indices,
            every=every,
            transposed=self.planes[axis].is_transposed,
            given_up=given_up,
        )
        first, second = (other for other in range(3) if other != axis)
        return tuple(
            SliceImage(
                data=data,
                spacing_um=(every[0] * self.spacing_um[first], every[1] * self.spacing_um[second]),
                origin_um=(0.0, 0.0),
                axis=axis,
                index=index,
                every=every,
            )
            for index, data in zip(indices, slices or (), strict=slices is not None)
        )


# After a jump, or when another volume has been opened, the window draws its panels, and threads take Python's
# lock away from it, a few milliseconds each time: for so long they put off what nobody waits for.
PAUSE_AFTER_JUMP_S = 0.2
# What the screen can show is there by then, and of a volume just opened all else that is waited for comes
# first.
PAUSE_AFTER_OVERVIEW_S = 1.0
# An overview pays where it has, along both axes, one voxel of so many, or of more: else it may cost as many
# pages as the slice, and only puts that off.
_OVERVIEW_OF = 3


@dataclass(frozen=True, eq=False)
class Wish:
    """A slice that a view wants to draw now.

    Attributes
    ----------
    source : SliceSource
    axis, index : int
    step : int
        How far, and which way, the view scrolled to get there; 0 after a jump.
    was_missing : bool
        Whether it was not in memory then: the view waits until it is told that it has come.
    every : (int, int)
        Of the slice's voxels along its two axes, each how many-th has a pixel of the screen.
    """

    source: SliceSource
    axis: int
    index: int
    step: int
    was_missing: bool
    every: tuple[int, int] = (1, 1)

    @property
    def is_for_overview(self) -> bool:
        """Whether some of the slice is worth reading first: all that is seen of it comes sooner, then.

        Who scrolls on waits for slices that have been foreseen.
        """
        is_worth_it = min(self.every) >= _OVERVIEW_OF and self.source.plans[self.axis].is_scattered
        return is_worth_it and self.step == 0 and (self.axis, self.index) not in self.source.cache


class SliceReaders:
    """Three threads, one an axis, so that a slow axis holds up no other. Only the newest wish counts.

    Parameters
    ----------
    on_arrived : callable of (SliceSource, SliceImage)
        Takes a slice that was wished for, and before it what is seen of one that takes long to read.
    on_failed : callable of (SliceSource, Exception)
        Hears why a slice that was wished for cannot be read. Both are called in the reading threads, never
        after `stop` has returned, and must not wait for anything.
    """

    def __init__(
        self,
        on_arrived: Callable[[SliceSource, SliceImage], None],
        on_failed: Callable[[SliceSource, Exception], None],
    ) -> None:
        self._on_arrived = on_arrived
        self._on_failed = on_failed
        self._stopped = False
        self._source: SliceSource | None = None
        self._wishes: dict[int, Wish] = {}
        self._has_begun = False
        self._done_with: list[SliceSource] = []
        self._being_read: set[int] = set()
        # One lock, and a condition for each thing to wait for: who is woken for nothing takes Python's lock
        # from the window.
        self._lock = threading.RLock()
        self._wished = tuple(threading.Condition(self._lock) for _ in range(3))
        self._calmed = threading.Condition(self._lock)
        self._threads = [
            threading.Thread(target=self._run, args=(axis,), name=f"slices-{axis}", daemon=True)
            for axis in range(3)
        ]
        for thread in self._threads:
            thread.start()

    def use(self, source: SliceSource | None) -> None:
        """Take wishes for another volume, or for none, from now on; those for the old one are forgotten.

        None is fulfilled before `begin`. Slices of the old one are given back by a thread that has no wish
        for a while: for a hundred megabytes it takes as long as the first picture of the other volume.
        """
        with self._lock:
            if self._source is not None:
                self._done_with.append(self._source)
                self._wished[0].notify()
            self._source = source
            self._has_begun = False
            self._wishes.clear()
            self._calmed.notify_all()

    def begin(self) -> None:
        """Fulfil the wishes for the volume in use: by now nobody needs the processor more."""
        with self._lock:
            self._has_begun = True
            for axis in self._wishes:
                self._wished[axis].notify()

    def wish(self, axis: int, index: int, step: int, every: tuple[int, int] = (1, 1)) -> None:
        """Read a slice next; an earlier wish for the same axis is forgotten.

        Parameters
        ----------
        axis, index : int
        step : int
            How far, and which way, scrolling led there; 0 after a jump.
        every : (int, int)
            Of the slice's voxels along its two axes, each how many-th has a pixel of the screen.
        """
        with self._lock:
            if self._source is not None:
                was_missing = (axis, index) not in self._source.cache
                self._wishes[axis] = Wish(self._source, axis, index, step, was_missing, every)
                if self._has_begun:
                    self._wished[axis].notify()
                self._calmed.notify_all()

    def stop(self) -> None:
        """Deliver nothing more, and let the threads end."""
        with self._lock:
            self._stopped = True
            self._source = None
            self._wishes.clear()
            self._done_with.clear()
            for condition in (*self._wished, self._calmed):
                condition.notify_all()

    def wait(self, patience_s: float) -> None:
        """Wait, after `stop`, until the threads have ended; a reading that hangs is left to itself."""
        for thread in self._threads:
            thread.join(patience_s)

    def _run(self, axis: int) -> None:
        while self._fulfil_next(axis):
            pass

    def _fulfil_next(self, axis: int) -> bool:
        """Wait for a wish and fulfil it; False when stopped. Holds on to no volume in between."""
        with self._lock:
            wished = self._wished[axis]
            wished.wait_for(lambda: self._stopped or self._due(axis) or self._done_with)
            if self._due(axis) is None:
                wished.wait_for(lambda: self._stopped or self._due(axis), PAUSE_AFTER_JUMP_S)
            if self._stopped:
                return False
            wish = self._due(axis)
            done_with: list[SliceSource] = []
            if wish is None:
                done_with, self._done_with = self._done_with, []
            else:
                self._being_read.add(axis)
        if wish is None:
            # Here, where nobody waits for the lock.
            done_with.clear()
            return True
        try:
            image = None if self._show_overview(wish) else self._read(wish)
        except Exception as error:  # noqa: BLE001 - whatever it is, a person must hear of it
            self._settle(wish, self._on_failed, error)
            return True
        if image is None:
            self._settle(wish)
            return True
        self._settle(wish, self._on_arrived, image)
        self._foresee(wish)
        return True

    def _due(self, axis: int) -> Wish | None:
        """Return the wish to be fulfilled now."""
        return self._wishes.get(axis) if self._has_begun else None

    def _show_overview(self, wish: Wish) -> bool:
        """Tell first what is seen of a slice, where that pays; True if a newer wish made it pointless."""
        if not wish.is_for_overview:
            return False
        block = range(wish.index, wish.index + 1)
        given_up = partial(self._is_pointless, wish, block)
        image = wish.source.overview(wish.axis, wish.index, wish.every, given_up)
        if image is None:
            return True
        with self._lock:
            if not self._stopped:
                self._on_arrived(wish.source, image)
            # Meanwhile the disk belongs to the others.
            self._being_read.discard(wish.axis)
            self._calmed.notify_all()
            if self._is_followed(wish, PAUSE_AFTER_OVERVIEW_S):
                return True
            self._being_read.add(wish.axis)
        return False

    def _read(self, wish: Wish) -> SliceImage | None:
        """Return the slice of a wish; None if a newer wish made it pointless meanwhile."""
        source, key = wish.source, (wish.axis, wish.index)
        found = source.cache.get(*key)
        if found is not None:
            return found
        block = source.plans[wish.axis].first(wish.index)
        return next(
            (
                image
                for image in source.read(wish.axis, block, partial(self._is_pointless, wish, block))
                if image.index == wish.index
            ),
            None,
        )

    def _settle(
        self, wish: Wish, tell: Callable[[SliceSource, Any], None] | None = None, what: object = None
    ) -> None:
        """Take a wish off the list, unless a newer one stands there, and tell what came of it."""
        with self._lock:
            self._being_read.discard(wish.axis)
            if self._wishes.get(wish.axis) is wish:
                del self._wishes[wish.axis]
            if tell is not None and not self._stopped:
                tell(wish.source, what)
            self._calmed.notify_all()

    def _foresee(self, wish: Wish) -> None:
        """Read what scrolling on will want, while nobody waits for anything."""
        source = wish.source
        if not wish.step and self._is_followed(wish, PAUSE_AFTER_JUMP_S):
            return
        for block in source.plans[wish.axis].ahead(wish.index, wish.step):
            missing = [index for index in block if (wish.axis, index) not in source.cache]
            if not missing:
                continue
            wanted = range(missing[0], missing[-1] + 1, block.step)
            try:
                if not source.read(wish.axis, wanted, partial(self._is_disturbed, wish, wanted)):
                    return
            except VolumeError:  # told when such a slice is wished for, not before
                return

    def _is_followed(self, wish: Wish, within_s: float) -> bool:
        """Wait a moment for another wish of the same axis; True as soon as it is there, or all is over."""
        with self._lock:
            return self._calmed.wait_for(
                lambda: self._source is not wish.source or self._wishes.get(wish.axis, wish) is not wish,
                within_s,
            )

    def _is_pointless(self, wish: Wish, block: range) -> bool:
        """Say whether the newest wish of the axis is one that this reading will not fulfil."""
        newest = self._wishes.get(wish.axis)
        return newest is None or newest.source is not wish.source or newest.index not in block

    def _is_disturbed(self, wish: Wish, block: range) -> bool:
        """Wait until nobody waits for the disk; True if foreseeing is not what is wanted any more.

        Whoever scrolls on through slices that are in memory disturbs nothing: the next ones are just those.
        """
        with self._lock:
            self._calmed.wait_for(
                lambda: (
                    self._source is not wish.source
                    or self._is_waited_for(wish)
                    or not self._being_read - {wish.axis}
                )
            )
            if self._source is not wish.source:
                return True
            return self._is_waited_for(wish) and self._is_pointless(wish, block)

    def _is_waited_for(self, wish: Wish) -> bool:
        """Say whether a view across the axis of a wish waits, after it, for a slice.

        Also for one that has come into memory since, with a block that was foreseen: it has yet to be told.
        """
        newest = self._wishes.get(wish.axis)
        return newest is not None and (
            newest.was_missing or (newest.axis, newest.index) not in wish.source.cache
        )
