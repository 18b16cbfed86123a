"""What a view shows of a slice until the disk has brought all of it."""

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPointF
from PySide6.QtGui import QEnterEvent
from pytestqt.qtbot import QtBot

from annotator.session import Session
from annotator.slices import slice_readers
from annotator.slices.fetching import SliceFetcher
from annotator.slices.slice_view import SliceView
from tests.annotator.slices.disk import Disk


@pytest.fixture
def small_view(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher, monkeypatch: pytest.MonkeyPatch
) -> SliceView:
    """A view that shows one in four by five of 40 × 60 voxels: all that has been read of plane 45 yet."""
    monkeypatch.setattr(slice_readers, "PAUSE_AFTER_OVERVIEW_S", 60.0)
    view = SliceView(session, 2, slow)
    qtbot.addWidget(view)
    view.setFixedSize(12, 12)
    # Away from the cursor.
    view.move(100, 100)
    view.show()
    disk.gate.set()
    session.look(crosshair_um=(0.0, 0.0, 45 * 9.4))
    qtbot.waitUntil(lambda: view.is_fine)
    assert not view.is_sharp
    return view


def test_views_show_the_coarse_level_at_once_and_become_sharp(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher
) -> None:
    view = SliceView(session, 2, slow)
    qtbot.addWidget(view)
    view.resize(300, 300)
    view.show()
    session.look(crosshair_um=(0.0, 0.0, 30 * 9.4))

    # The gate is shut: all that follows is drawn without the disk.
    assert view.index == 30
    assert not view.is_sharp
    middle = view.grab().toImage().pixelColor(150, 150)
    assert middle.lightness() > 100, "the bright slab is in the coarse level"
    assert view._header(view.viewport).remark == "…"  # type: ignore[arg-type]

    disk.gate.set()
    qtbot.waitUntil(lambda: view.is_sharp)
    assert view._header(view.viewport).remark == ""  # type: ignore[arg-type]


def test_a_view_asks_for_what_it_can_show_and_for_more_when_a_person_looks_closer(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher, small_view: SliceView
) -> None:
    view = small_view
    assert view._image is not None
    every = view.viewport.voxels_per_pixel(1.0)  # type: ignore[union-attr]
    assert np.array_equal(view._image.data, disk._array[:: every[0], :: every[1], 45])
    assert view._header(view.viewport).remark == ""  # type: ignore[arg-type]
    overview = view._image

    # Another level is coarser than what stands there.
    session.levels_changed.emit()
    assert view._image is overview

    view.zoom(8.0, 6.0, 6.0)
    assert not view.is_fine
    # Still a level is of a plane nearby, or of means.
    session.levels_changed.emit()
    assert view._image is overview
    assert view._header(view.viewport).remark == "…"  # type: ignore[arg-type]
    qtbot.waitUntil(lambda: view.is_sharp)
    assert np.array_equal(view._image.data, disk._array[:, :, 45])

    # One that comes late does not take its place.
    slow.slice_arrived.emit(overview)
    assert view.is_sharp


def test_a_cursor_over_a_view_wants_every_voxel(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher, small_view: SliceView
) -> None:
    view = small_view

    at = QPointF(6, 6)
    view.enterEvent(QEnterEvent(at, at, at))
    qtbot.waitUntil(lambda: view.is_sharp)

    # After a jump, too.
    session.look(crosshair_um=(0.0, 0.0, 5 * 9.4))
    qtbot.waitUntil(lambda: view.is_sharp)
    view.leaveEvent(QEvent(QEvent.Type.Leave))


def test_the_coarse_picture_is_drawn_without_a_byte_of_the_file(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher
) -> None:
    """Not even through a mapping, whose cold pages would make the window wait for the disk."""
    assert session.volume is not None
    view = SliceView(session, 2, slow)
    qtbot.addWidget(view)
    view.resize(300, 300)
    np.load(session.volume.path, mmap_mode="r+")[:] = 0

    session.look(crosshair_um=(0.0, 0.0, 30 * 9.4))

    assert not view.is_sharp
    assert view.grab().toImage().pixelColor(150, 150).lightness() > 100


def test_scrolling_goes_on_while_the_disk_hangs(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher
) -> None:
    view = SliceView(session, 0, slow)
    qtbot.addWidget(view)
    for index in range(40):
        session.look(crosshair_um=(index * 15.9, 0.0, 0.0))
        assert view.index == index
        assert not view.is_sharp
        view.grab()

    disk.gate.set()
    qtbot.waitUntil(lambda: view.is_sharp)


def test_a_view_keeps_the_coarse_image_and_says_so_when_reading_fails(
    qtbot: QtBot, session: Session, disk: Disk, slow: SliceFetcher
) -> None:
    view = SliceView(session, 1, slow)
    qtbot.addWidget(view)
    disk.error = OSError(5, "Input/output error")
    with qtbot.waitSignal(slow.reading_failed):
        disk.gate.set()
        session.look(crosshair_um=(0.0, 7 * 13.5, 0.0))

    assert not view.is_sharp
    assert view._image is not None
    assert "cannot be read" in view._header(view.viewport).remark  # type: ignore[arg-type]
