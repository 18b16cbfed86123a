"""A scene on the small volume, started and drawn, and what tests do with it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QMouseEvent
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from annotations.geometry import rotations
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.volumes import write_sidecar
from annotator.scene.picking import Picture
from annotator.scene.scene_view import SceneView
from annotator.session import Session
from annotator.session.editing.handles import Handle

SIZE = (420, 320)
SLAB_TOP_UM: Vector = (19.5 * 15.9, 29.5 * 13.5, 20 * 9.4)
"""The middle of the slab's face towards the scanner."""

ROOMY_UM = (440.0, 440.0, 300.0)
"""Spacing of the small volume in which the whole tool has room, as in the scanner's workspace."""

# Along y, with the hinges along the light: it bends in the plane that is seen from the scanner.
POSE = ToolPose(
    (8000.0, 8000.0, 7500.0),
    rotations.from_matrix(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
    {"theta1": 20.0, "theta2": 35.0},
)


class Scene:
    """A scene that is on the screen, driven by mouse and keys."""

    def __init__(self, qtbot: QtBot, session: Session) -> None:
        self.qtbot = qtbot
        self.session = session
        self.view = SceneView(session)
        self.view.resize(*SIZE)
        qtbot.addWidget(self.view)
        with qtbot.waitExposed(self.view):
            self.view.show()
        self.view.start()
        self.settle()

    @property
    def canvas(self) -> QWidget:
        """What the mouse is over."""
        canvas = self.view.findChild(QWidget, "scene_canvas")
        assert canvas is not None
        return canvas

    @property
    def document_positions(self) -> dict[str, Vector]:
        """What the document holds."""
        assert self.session.document is not None
        return dict(self.session.document.positions_um)

    @property
    def picture(self) -> Picture:
        """What positions are projected by."""
        assert self.view.camera is not None
        return Picture(self.view.camera, self.canvas.width(), self.canvas.height())

    def place_of(self, position_um: Vector) -> QPoint:
        """Return the pixel at which a position appears."""
        x, y, _ = self.picture.project([position_um])[0]
        return QPoint(int(x), int(y))

    def handle(self, name: str) -> Handle:
        """Return a handle that can be taken hold of now; KeyError where it cannot."""
        return {handle.name: handle for handle in self.session.handles()}[name]

    def drag_handle(self, name: str, way: QPoint) -> None:
        """Drag a handle from where it appears."""
        self.drag(self.place_of(self.handle(name).position_um), way)

    def press(self, at: QPoint) -> None:
        """Press the left button, and hold it."""
        self.qtbot.mousePress(self.canvas, Qt.MouseButton.LeftButton, pos=at)

    def move(self, to: QPoint) -> None:
        """Move with the left button held."""
        _move(self.canvas, QPointF(to), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier)

    def release(self, at: QPoint) -> None:
        """Let go of the left button."""
        self.qtbot.mouseRelease(self.canvas, Qt.MouseButton.LeftButton, pos=at)

    def click(self, at: QPoint, button: Qt.MouseButton = Qt.MouseButton.LeftButton) -> None:
        """Press and release."""
        self.qtbot.mouseClick(self.canvas, button, pos=at)

    def double_click(self, at: QPoint) -> None:
        """Send what a double click sends: a click, and a press that is called one, with its release."""
        self.qtbot.mouseClick(self.canvas, Qt.MouseButton.LeftButton, pos=at)
        self.qtbot.mouseDClick(self.canvas, Qt.MouseButton.LeftButton, pos=at)
        self.qtbot.mouseRelease(self.canvas, Qt.MouseButton.LeftButton, pos=at)

    def drag(
        self,
        start: QPoint,
        way: QPoint,
        button: Qt.MouseButton = Qt.MouseButton.LeftButton,
        modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier,
    ) -> None:
        """Press, move in steps, release."""
        self.qtbot.mousePress(self.canvas, button, modifier, start)
        for step in range(1, 6):
            # qtbot's own move carries no buttons.
            _move(self.canvas, QPointF(start) + QPointF(way) * step / 5, button, modifier)
        self.qtbot.mouseRelease(self.canvas, button, modifier, start + way)

    def hover(self, at: QPoint) -> None:
        """Move the mouse without a button."""
        _move(self.canvas, QPointF(at), Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier)

    def settle(self) -> None:
        """Wait until the volume is drawn at its best."""
        self.qtbot.waitUntil(lambda: self.view.is_at_rest)

    def pixels(self) -> np.ndarray:
        """Return the scene's picture, shape (height, width, 3)."""
        return pixels(self.view.picture())


def pixels(image: QImage) -> np.ndarray:
    """Return an image's colours, shape (height, width, 3)."""
    plain = image.convertToFormat(QImage.Format.Format_RGBA8888)
    shape = (plain.height(), plain.width(), 4)
    return np.frombuffer(plain.constBits(), np.uint8).reshape(shape)[..., :3].astype(int)


def _move(canvas: QWidget, at: QPointF, button: Qt.MouseButton, modifier: Qt.KeyboardModifier) -> None:
    event = QMouseEvent(
        QEvent.Type.MouseMove,
        at,
        canvas.mapToGlobal(at),
        Qt.MouseButton.NoButton,
        button,
        modifier,
    )
    QCoreApplication.sendEvent(canvas, event)


@pytest.fixture
def scene(qtbot: QtBot, session: Session) -> Iterator[Scene]:
    """The scene of the open small volume, at rest."""
    made = Scene(qtbot, session)
    yield made
    made.view.close()


@pytest.fixture
def roomy(qtbot: QtBot, request: pytest.FixtureRequest, volume_path: Path) -> Iterator[Scene]:
    """The scene of a volume in which the tool has room, with nothing placed."""
    write_sidecar(volume_path, ROOMY_UM, 2)
    made = Scene(qtbot, request.getfixturevalue("session"))
    yield made
    made.view.close()


@pytest.fixture
def posed(roomy: Scene) -> Scene:
    """The roomy scene with every keypoint where the pose has it, navigating."""
    assert roomy.session.tool is not None
    for name, position_um in keypoints_um(POSE, roomy.session.tool).items():
        roomy.session.place(position_um, keypoint=name)
    roomy.session.set_mode("navigate")
    return roomy


@pytest.fixture
def unboxed(qtbot: QtBot, roomy: Scene) -> Scene:
    """The roomy scene in a document of boxes without any, in place mode."""
    session = roomy.session
    session.set_method("boxes")
    qtbot.waitUntil(lambda: session.document is not None and session.document.method == "boxes")
    qtbot.waitUntil(lambda: not session.jobs.running)
    session.set_mode("place")
    roomy.settle()
    return roomy


@pytest.fixture
def boxed(unboxed: Scene) -> Scene:
    """The roomy scene with every box where the pose has it, the first one active, in place mode."""
    session = unboxed.session
    assert session.tool is not None
    for link, box in link_boxes(POSE, session.tool).items():
        session.type_box(link, box)
    session.activate("link0")
    unboxed.settle()
    return unboxed
