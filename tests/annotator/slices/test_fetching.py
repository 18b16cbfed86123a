"""Reading in the background, with a disk that answers when the test lets it."""

import threading
import weakref

import numpy as np
import pytest
from PySide6.QtCore import QObject
from pytestqt.qtbot import QtBot

from annotations.volumes import SliceImage, VolumeError
from annotator.looks.redrawing import Redrawing
from annotator.session import Session
from annotator.slices import slice_readers, slice_reading
from annotator.slices.fetching import SliceFetcher
from tests.annotator.slices.disk import Disk


def _bytes_across_z(session: Session) -> int:
    assert session.volume is not None
    return session.volume.shape[0] * session.volume.shape[1] * session.volume.dtype.itemsize


def test_asking_never_waits_and_the_slice_arrives_later(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher
) -> None:
    assert session.volume is not None
    # Were this call to read, it would never come back: nobody else opens the gate.
    assert slow.fetch(0, 7) is None

    with qtbot.waitSignal(slow.slice_arrived) as blocker:
        disk.gate.set()

    image: SliceImage = blocker.args[0]
    assert (image.axis, image.index, image.sharp) == (0, 7, True)
    assert np.array_equal(image.data, np.load(session.volume.path)[7])
    assert slow.fetch(0, 7) is image


def test_of_another_volume_nothing_is_read_before_its_first_picture(
    qtbot: QtBot, session: Session, disk: Disk
) -> None:
    fetcher = SliceFetcher(session)
    # What is drawn first of another volume.
    owner = QObject()
    Redrawing(lambda: was_read.append(bool(disk.regions)), owner).ask_apart(first=True)
    was_read: list[bool] = []
    fetcher.fetch(0, 7)
    disk.gate.set()
    with qtbot.waitSignal(fetcher.slice_arrived):
        assert not disk.arrived.wait(0.05), "the threads wait, not only this one"
    assert was_read == [False]

    # So it is of the next one.
    disk.regions.clear()
    disk.arrived.clear()
    session.volume_changed.emit()
    fetcher.fetch(0, 7)
    with qtbot.waitSignal(fetcher.slice_arrived):
        assert not disk.arrived.wait(0.05)
    fetcher.close()


def test_only_the_newest_wish_of_an_axis_is_fulfilled(qtbot: QtBot, disk: Disk, slow: SliceFetcher) -> None:
    arrived: list[int] = []
    slow.slice_arrived.connect(lambda image: arrived.append(image.index))
    slow.fetch(0, 30)
    qtbot.waitUntil(disk.arrived.is_set)
    # While the first is being read, the hand goes on.
    for index in (5, 17, 3):
        slow.fetch(0, index)

    with qtbot.waitSignal(slow.slice_arrived, check_params_cb=lambda image: image.index == 3):
        disk.gate.set()

    assert arrived in ([30, 3], [3])


def test_a_slow_axis_holds_up_no_other(qtbot: QtBot, session: Session, disk: Disk) -> None:
    """The reading across z hangs; the one across x is answered."""
    array = np.load(session.volume.path) if session.volume else np.zeros(0)

    def read(region: tuple[slice, slice, slice]) -> np.ndarray:
        if region[2].stop - region[2].start == 1:
            disk.arrived.set()
            assert disk.gate.wait(30)
        return array[region]

    disk.read = read  # type: ignore[method-assign]
    fetcher = SliceFetcher(session)
    fetcher.fetch(2, 10)
    qtbot.waitUntil(disk.arrived.is_set)

    with qtbot.waitSignal(fetcher.slice_arrived, check_params_cb=lambda image: image.axis == 0):
        fetcher.fetch(0, 12)

    disk.gate.set()
    fetcher.close()


def test_slices_ahead_are_read_before_they_are_asked_for(
    qtbot: QtBot, session: Session, fetcher: SliceFetcher
) -> None:
    fetcher.fetch(0, 10)
    with qtbot.waitSignal(fetcher.slice_arrived):
        fetcher.fetch(0, 11)

    source = fetcher._source
    assert source is not None
    qtbot.waitUntil(lambda: all((0, index) in source.cache for index in range(11, 16)))
    assert (0, 9) not in source.cache


def test_after_a_jump_the_window_is_drawn_before_the_slices_beside_it_are_read(
    qtbot: QtBot, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slice_readers, "PAUSE_AFTER_JUMP_S", 60.0)
    fetcher = SliceFetcher(session)
    source = fetcher._source
    assert source is not None
    with qtbot.waitSignal(fetcher.slice_arrived):
        fetcher.fetch(2, 7)
    qtbot.wait(50)
    assert [index for index in range(50) if (2, index) in source.cache] == [7]

    # Whoever scrolls on does not wait for that minute to end.
    with qtbot.waitSignal(fetcher.slice_arrived):
        fetcher.fetch(2, 8)
    qtbot.waitUntil(lambda: all((2, index) in source.cache for index in range(7, 12)))
    fetcher.close()


def test_after_a_jump_what_the_screen_can_show_comes_before_the_slice(
    qtbot: QtBot, session: Session, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slice_readers, "PAUSE_AFTER_OVERVIEW_S", 60.0)
    disk.gate.set()
    fetcher = SliceFetcher(session)
    with qtbot.waitSignal(fetcher.slice_arrived) as blocker:
        fetcher.fetch(2, 7, (3, 4))
    overview: SliceImage = blocker.args[0]
    assert (overview.axis, overview.index, overview.sharp) == (2, 7, False)
    assert np.array_equal(overview.data, disk._array[::3, ::4, 7])
    assert overview.spacing_um == (3 * 15.9, 4 * 13.5)
    assert overview.origin_um == (0.0, 0.0)

    # Whoever goes on does not wait for that minute to end, and then, as one scrolls, for no overview.
    with qtbot.waitSignal(fetcher.slice_arrived) as blocker:
        fetcher.fetch(2, 8, (3, 4))
    assert blocker.args[0].sharp

    # Nor for one of a slice that is in memory.
    with qtbot.waitSignal(fetcher.slice_arrived) as blocker:
        assert fetcher.fetch(2, 8, (3, 4)) is not None
    assert blocker.args[0].sharp
    fetcher.close()


def test_while_the_rest_of_a_slice_waits_other_axes_read_ahead(
    qtbot: QtBot, session: Session, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slice_readers, "PAUSE_AFTER_OVERVIEW_S", 60.0)
    disk.gate.set()
    fetcher = SliceFetcher(session)
    with qtbot.waitSignal(fetcher.slice_arrived):
        fetcher.fetch(2, 7, (3, 4))
    fetcher.fetch(0, 10)
    with qtbot.waitSignal(fetcher.slice_arrived, check_params_cb=lambda image: image.index == 11):
        fetcher.fetch(0, 11)

    source = fetcher._source
    assert source is not None
    qtbot.waitUntil(lambda: all((0, index) in source.cache for index in range(11, 16)))
    fetcher.close()


def test_a_slice_that_is_asked_for_again_is_no_jump(qtbot: QtBot, session: Session, disk: Disk) -> None:
    """As when the view moves what it shows, or gets another size, while a person scrolls."""
    fetcher = SliceFetcher(session)
    steps: list[int] = []
    fetcher._readers.wish = lambda axis, index, step, every: steps.append(step)  # type: ignore[method-assign]
    for index in (7, 8, 8, 10, 10, 40, 40):
        fetcher.fetch(2, index, (3, 4))
    assert steps == [0, 1, 1, 2, 2, 0, 0]
    fetcher.close()


def test_the_slice_follows_what_the_screen_can_show_of_it(
    qtbot: QtBot, session: Session, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slice_readers, "PAUSE_AFTER_OVERVIEW_S", 0.02)
    disk.gate.set()
    fetcher = SliceFetcher(session)
    arrived: list[bool] = []
    fetcher.slice_arrived.connect(lambda image: arrived.append(image.sharp))
    fetcher.fetch(1, 7, (3, 3))
    qtbot.waitUntil(lambda: arrived == [False, True])
    fetcher.close()


@pytest.mark.parametrize(("axis", "every"), [(0, (9, 9)), (2, (2, 9)), (1, (9, 2))])
def test_there_is_no_overview_where_it_would_only_put_the_slice_off(
    qtbot: QtBot, session: Session, disk: Disk, axis: int, every: tuple[int, int]
) -> None:
    disk.gate.set()
    fetcher = SliceFetcher(session)
    with qtbot.waitSignal(fetcher.slice_arrived) as blocker:
        fetcher.fetch(axis, 7, every)
    assert blocker.args[0].sharp
    fetcher.close()


def test_scrolling_through_what_is_in_memory_leaves_reading_ahead_alone(
    qtbot: QtBot, session: Session, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slice_reading, "PORTION_BYTES", 1)
    monkeypatch.setattr(slice_reading, "TOGETHER_BYTES", 4 * _bytes_across_z(session))
    fetcher = SliceFetcher(session)
    source = fetcher._source
    assert source is not None
    disk.gate.set()
    fetcher.fetch(2, 0)
    qtbot.waitUntil(lambda: all((2, index) in source.cache for index in range(4)))
    disk.gate.clear()
    disk.arrived.clear()
    fetcher.fetch(2, 1)
    assert disk.arrived.wait(30), "the next four slices are being read"

    fetcher.fetch(2, 2)
    disk.gate.set()
    qtbot.waitUntil(lambda: (2, 7) in source.cache)

    begun = [region for region in disk.regions if region[2].start == 4 and region[0].start == 0]
    assert len(begun) == 1, "what was read of them was not thrown away"
    fetcher.close()


def test_a_slice_that_comes_with_a_foreseen_block_is_told_before_the_next_block_is_read(
    qtbot: QtBot, session: Session, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slice_reading, "PORTION_BYTES", 1)
    monkeypatch.setattr(slice_reading, "TOGETHER_BYTES", 4 * _bytes_across_z(session))
    begun, own_block, next_block = threading.Event(), threading.Event(), threading.Event()
    read = disk.read

    def read_block_by_block(region: tuple[slice, slice, slice]) -> np.ndarray:
        if region[2].start == 9:
            begun.set()
            assert own_block.wait(30)
        if region[2].start >= 12:
            assert next_block.wait(30)
        return read(region)

    disk.read = read_block_by_block  # type: ignore[method-assign]
    disk.gate.set()
    fetcher = SliceFetcher(session)
    with qtbot.waitSignal(fetcher.slice_arrived):
        fetcher.fetch(2, 7)
    source = fetcher._source
    assert source is not None
    qtbot.waitUntil(lambda: (2, 4) in source.cache)
    fetcher.fetch(2, 8)
    assert begun.wait(30), "the others of its block are being read"
    assert fetcher.fetch(2, 10) is None

    with qtbot.waitSignal(fetcher.slice_arrived, check_params_cb=lambda image: image.index == 10):
        own_block.set()

    next_block.set()
    fetcher.close()


def test_a_failing_disk_is_told_once_and_tried_again(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher
) -> None:
    told: list[Exception] = []
    session.error_raised.connect(told.append)
    disk.gate.set()
    disk.error = OSError(5, "Input/output error")
    for index in (3, 20):
        with qtbot.waitSignal(slow.reading_failed):
            slow.fetch(0, index)
    assert slow.is_failing
    assert len(told) == 1
    assert isinstance(told[0], VolumeError)
    assert "v001.npy" in str(told[0])

    disk.error = None
    with qtbot.waitSignal(slow.slice_arrived):
        slow.fetch(0, 3)
    assert not slow.is_failing


def test_nothing_of_the_old_volume_arrives_after_another_is_open(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher
) -> None:
    arrived: list[SliceImage] = []
    told: list[Exception] = []
    slow.slice_arrived.connect(arrived.append)
    session.error_raised.connect(told.append)
    slow.fetch(0, 3)
    qtbot.waitUntil(disk.arrived.is_set)

    assert session.close_volume()
    disk.gate.set()
    slow.close()
    qtbot.wait(0)

    assert slow.fetch(0, 3) is None
    assert arrived == []
    assert told == []


def test_closing_ends_the_threads(session: Session) -> None:
    before = set(threading.enumerate())
    fetcher = SliceFetcher(session)
    started = set(threading.enumerate()) - before
    assert len(started) == 3

    fetcher.close()

    assert not any(thread.is_alive() for thread in started)


def test_closing_does_not_wait_for_a_disk_that_hangs(
    qtbot: QtBot, session: Session, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("annotator.slices.fetching.CLOSING_PATIENCE_S", 0.01)
    fetcher = SliceFetcher(session)
    fetcher.fetch(0, 3)
    qtbot.waitUntil(disk.arrived.is_set)

    # Comes back although the gate is shut; what is read later goes nowhere.
    fetcher.close()

    assert not disk.gate.is_set()


def test_a_fetcher_destroyed_without_closing_ends_its_threads(qtbot: QtBot, session: Session) -> None:
    before = set(threading.enumerate())
    fetcher = SliceFetcher(session)
    started = set(threading.enumerate()) - before

    fetcher.deleteLater()

    qtbot.waitUntil(lambda: not any(thread.is_alive() for thread in started))


def test_memory_for_slices_is_bounded(qtbot: QtBot, session: Session) -> None:
    slice_bytes = 60 * 50
    fetcher = SliceFetcher(session, cache_bytes=5 * slice_bytes)
    for index in range(0, 40, 3):
        with qtbot.waitSignal(fetcher.slice_arrived, check_params_cb=lambda image, i=index: image.index == i):
            fetcher.fetch(0, index)
    assert fetcher._source is not None
    held = fetcher._source.cache._slices.values()
    assert 0 < sum(image.data.nbytes for image in held) <= 5 * slice_bytes
    fetcher.close()


def test_the_slices_of_another_volume_are_given_back_in_a_reading_thread(
    qtbot: QtBot, session: Session
) -> None:
    fetcher = SliceFetcher(session)
    with qtbot.waitSignal(fetcher.slice_arrived):
        fetcher.fetch(0, 3)
    given_back_in: list[threading.Thread] = []
    source = fetcher._source
    weakref.finalize(source, lambda: given_back_in.append(threading.current_thread()))
    del source
    session.close_volume()
    qtbot.waitUntil(lambda: bool(given_back_in))
    assert given_back_in[0].name.startswith("slices-")
    fetcher.close()
