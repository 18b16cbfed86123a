"""Three linked slice views on the small volume, and hands to work on them."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QHBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotations.volumes import write_sidecar
from annotator.session import Session
from annotator.slices.fetching import SliceFetcher
from annotator.slices.handle_marks import handle_marks
from annotator.slices.linked_zoom import link_zoom
from annotator.slices.slice_view import SliceView
from tests.annotator.slices.disk import Disk

BRIGHT_VOXEL = (7, 41, 12)
# The small volume with these voxels is 17 × 26 × 11 mm, as large as a real one.
ROOMY_UM = (430.0, 430.0, 215.0)
POSE = ToolPose(
    (6000.0, 7500.0, 5000.0), from_yaw_pitch_roll(65.0, 10.0, 30.0), {"theta1": -20.0, "theta2": 25.0}
)


class Hand:
    """Works on slice views with real mouse events."""

    def pixel(self, view: SliceView, position_um: Vector) -> QPoint:
        """Return the whole pixel of a view at which a position lies."""
        assert view.viewport is not None
        x, y = view.viewport.pixel(position_um)
        return QPoint(round(x), round(y))

    def position_um(self, view: SliceView, at: QPoint) -> Vector:
        """Return the position, on the plane that is shown, of a pixel."""
        assert view.viewport is not None
        return view.viewport.position_um(at.x(), at.y(), view.viewport.plane.depth_um(view.index))

    def handle(self, session: Session, view: SliceView, name: str) -> QPoint:
        """Bring the slices through a handle, and return the whole pixel of a view at which it is drawn."""
        (handle,) = (each for each in session.handles() if each.name == name)
        session.look(crosshair_um=handle.position_um)
        assert view.viewport is not None
        shown = handle_marks(session.handles(), session.solids(), session.view, view.viewport, view.index)
        (mark,) = (each for each in shown if each.handle.name == name)
        return QPoint(round(mark.x), round(mark.y))

    def way_um(self, view: SliceView, way: QPoint) -> Vector:
        """Return how far, in µm, a move by some pixels leads within a view's plane."""
        assert view.viewport is not None
        return view.viewport.plane.lifted((way.x() / view.viewport.scale, way.y() / view.viewport.scale), 0.0)

    def click(self, view: SliceView, at: QPoint) -> None:
        QTest.mouseClick(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, at)

    def move(self, view: SliceView, at: QPoint) -> None:
        """Move the mouse, without asking the window system where its own cursor is."""
        local = QPointF(at)
        event = QMouseEvent(
            QEvent.Type.MouseMove,
            local,
            QPointF(view.mapToGlobal(local)),
            Qt.MouseButton.NoButton,
            Qt.MouseButton.NoButton,
            Qt.KeyboardModifier.NoModifier,
        )
        QApplication.sendEvent(view, event)

    def drag(
        self,
        view: SliceView,
        start: QPoint,
        *way: QPoint,
        button: Qt.MouseButton = Qt.MouseButton.LeftButton,
        modifiers: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier,
        release: bool = True,
    ) -> None:
        QTest.mousePress(view, button, modifiers, start)
        for at in way:
            self.move(view, at)
        if release:
            QTest.mouseRelease(view, button, modifiers, way[-1])

    def wheel(
        self,
        view: SliceView,
        angle: int,
        at: QPoint | None = None,
        modifiers: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier,
    ) -> None:
        """Turn the wheel by some eighths of a degree, away from oneself if positive."""
        local = QPointF(at or view.rect().center())
        event = QWheelEvent(
            local,
            QPointF(view.mapToGlobal(local)),
            QPoint(),
            QPoint(0, angle),
            Qt.MouseButton.NoButton,
            modifiers,
            Qt.ScrollPhase.NoScrollPhase,
            False,
        )
        QApplication.sendEvent(view, event)


@pytest.fixture
def hand() -> Hand:
    return Hand()


@pytest.fixture
def fetcher(empty_session: Session) -> Iterator[SliceFetcher]:
    fetcher = SliceFetcher(empty_session)
    yield fetcher
    fetcher.close()


@pytest.fixture
def empty_views(
    qtbot: QtBot, empty_session: Session, fetcher: SliceFetcher
) -> Iterator[tuple[SliceView, ...]]:
    """Three linked views, 400 × 300 pixels each, on a session with nothing open."""
    window = QWidget()
    layout = QHBoxLayout(window)
    layout.setContentsMargins(0, 0, 0, 0)
    views = tuple(SliceView(empty_session, axis, fetcher, window) for axis in range(3))
    for view in views:
        view.setFixedSize(400, 300)
        layout.addWidget(view)
    link_zoom(views)
    qtbot.addWidget(window)
    with qtbot.waitExposed(window):
        window.show()
    # Held by this frame: a window without a parent lives no longer than somebody holds it.
    yield views
    window.close()


@pytest.fixture
def views(
    qtbot: QtBot, empty_views: tuple[SliceView, ...], session: Session
) -> tuple[SliceView, SliceView, SliceView]:
    """Three linked views on the small volume, sharp, with the crosshair on the voxel in its middle."""
    session.look(crosshair_um=(20 * 15.9, 30 * 13.5, 25 * 9.4))
    first, second, third = empty_views
    qtbot.waitUntil(lambda: all(view.is_sharp for view in empty_views))
    return (first, second, third)


@pytest.fixture
def roomy_views(
    qtbot: QtBot, request: pytest.FixtureRequest, empty_views: tuple[SliceView, ...], volume_path: Path
) -> tuple[SliceView, SliceView, SliceView]:
    """Three linked views on a volume in which the tool has room, with nothing placed, navigating."""
    write_sidecar(volume_path, ROOMY_UM, 2)
    session: Session = request.getfixturevalue("session")
    session.look(crosshair_um=POSE.position_um)
    first, second, third = empty_views
    qtbot.waitUntil(lambda: all(view.is_sharp for view in empty_views))
    return (first, second, third)


@pytest.fixture
def unboxed(qtbot: QtBot, roomy_views: tuple[SliceView, ...], empty_session: Session) -> Session:
    """A session on the roomy volume in a document of boxes without any, in place mode."""
    session = empty_session
    session.set_method("boxes")
    qtbot.waitUntil(lambda: session.document is not None and session.document.method == "boxes")
    qtbot.waitUntil(lambda: not session.jobs.running and all(view.is_sharp for view in roomy_views))
    session.look(crosshair_um=POSE.position_um)
    session.set_mode("place")
    session.activate("link0")
    return session


@pytest.fixture
def boxed(unboxed: Session) -> Session:
    """A session with every box where `POSE` has it, the first one active, in place mode."""
    assert unboxed.tool is not None
    for link, box in link_boxes(POSE, unboxed.tool).items():
        unboxed.type_box(link, box)
    unboxed.activate("link0")
    return unboxed


@pytest.fixture
def placed_tool(roomy_views: tuple[SliceView, ...], empty_session: Session) -> Session:
    """A session on the roomy volume with every keypoint where `POSE` has it, navigating."""
    session = empty_session
    assert session.tool is not None
    for name, position_um in keypoints_um(POSE, session.tool).items():
        session.place(position_um, keypoint=name)
    session.look(crosshair_um=POSE.position_um)
    return session


@pytest.fixture
def bright_voxel_path(tmp_path: Path) -> Path:
    """A volume that is dark but for one voxel."""
    path = tmp_path / "bright" / "voxel.npy"
    path.parent.mkdir()
    data = np.zeros((20, 60, 30), np.uint8)
    data[BRIGHT_VOXEL] = 255
    np.save(path, data)
    write_sidecar(path, (30.0, 13.5, 9.4), 2)
    return path


@pytest.fixture
def disk(session: Session) -> Iterator[Disk]:
    """The disk under the session's volume, its gate shut."""
    assert session.volume is not None
    disk = Disk(session.volume)
    object.__setattr__(session.volume, "_storage", disk)
    yield disk
    disk.gate.set()


@pytest.fixture
def slow(session: Session, disk: Disk) -> Iterator[SliceFetcher]:
    fetcher = SliceFetcher(session)
    yield fetcher
    disk.gate.set()
    fetcher.close()
