"""How soon the scene shows what a person does: edits, drags, undoing, and turning the volume."""

import statistics
import time
from collections.abc import Callable

from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication, QWidget

from annotations.fitting.pose_fit import fit_document
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.rotations import about_axis
from annotations.volumes import Level
from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import Figures, milliseconds

PEER_STRIDE = 14
_STEP_UM = 5.0
_TURN_PX = 12.0
_TURNS_BEFORE_REST = 8

_Button, _Type = Qt.MouseButton, QEvent.Type


def posed(driven: DrivenWindow) -> dict[str, Vector]:
    """Put the tool where the slices meet, and return the places of its keypoints in µm."""
    driven.session.pose_tool(
        ToolPose(
            driven.session.view.crosshair_um,
            about_axis((0, 0, 1), 90.0),
            {"theta1": 30.0, "theta2": 20.0},
        )
    )
    driven.settle()
    return dict(driven.session.shown_positions_um())


def moved_um(position_um: Vector, steps: float) -> Vector:
    """Return a position that is some steps of 5 µm further along y: the tool stays plausible."""
    return (position_um[0], position_um[1] + _STEP_UM * steps, position_um[2])


def measure_handling(driven: DrivenWindow, times: int) -> Figures:
    """Time edits and camera moves with the scene as large as the peer's canvas, at the finest level."""
    session = driven.session
    driven.show_pane("scene")
    positions_um = posed(driven)
    figures = _fitting(driven, times)

    def median(
        name: str, change: Callable[[int], object], count: int = times, *, rests: bool = False
    ) -> None:
        taken = []
        for step in range(1, count + 1):
            taken.append(driven.frame_ms(lambda step=step: change(step)))  # type: ignore[misc]
            if rests:
                # As after each of the peer's: nothing of it is left over for the next one.
                driven.settle()
        figures[f"{name}_ms"] = statistics.median(ms for ms, _ in taken)
        figures[f"{name}_cpu_ms"] = statistics.median(cpu_ms for _, cpu_ms in taken)
        driven.settle()

    def type_k0(step: int) -> None:
        session.type_position("k0", moved_um(positions_um["k0"], step))

    drawn = driven.window.scene.volume_draws
    # With the fit, its ghost, residuals and pose: everything that moves with a keypoint.
    median(
        "drag_to_frame",
        lambda step: session.begin_preview("k5", moved_um(positions_um["k5"], step), "dragged"),
    )
    session.drop_preview()
    driven.settle()
    median("edit_to_frame", type_k0, rests=True)
    median("undo_to_frame", lambda _: session.undo(), min(times, session.undo_stack.count), rests=True)
    figures["edit_to_panels_ms"] = statistics.median(
        _panels_ms(driven, lambda step=step: type_k0(step))  # type: ignore[misc]
        for step in range(times, 0, -1)
    )
    figures["edits_that_cast_the_volume"] = float(driven.window.scene.volume_draws - drawn)
    while session.undo_stack.can_redo:
        session.redo()
    driven.settle()
    figures["save_ms"] = milliseconds(session.save)
    session.type_position("k0", moved_um(positions_um["k0"], 0.5))
    figures["autosave_ms"] = milliseconds(session._on_autosave_save_requested)
    driven.settle()
    figures |= _turning(driven, times, "finest")
    finest = session._levels.averaged
    session._levels.averaged = _peer_level(driven)
    session.levels_changed.emit()
    driven.settle()
    figures |= _turning(driven, times, "same_data")
    session._levels.averaged = finest
    session.levels_changed.emit()
    driven.settle()
    picture = driven.window.scene.picture()
    figures |= {"scene_width_px": picture.width(), "scene_height_px": picture.height()}
    driven.show_pane(None)
    return figures


def measure_edits_in_slices(driven: DrivenWindow, times: int) -> Figures:
    """Time edits until all slices are painted, in the usual four panes."""
    session, paintings = driven.session, driven.paintings
    positions_um = posed(driven)
    taken_ms = []
    for step in range(1, times + 1):
        counts = [painting.count for painting in paintings]
        begun_s = time.perf_counter()
        session.type_position("k1", moved_um(positions_um["k1"], step))
        while any(painting.count == count for painting, count in zip(paintings, counts, strict=True)):
            driven.application.processEvents()
        taken_ms.append(1000 * (time.perf_counter() - begun_s))
    driven.settle()
    return {"edit_to_slices_ms": statistics.median(taken_ms)}


def _panels_ms(driven: DrivenWindow, change: Callable[[], object]) -> float:
    taken_ms = driven.panels_ms(change)
    driven.settle()
    return taken_ms


def _fitting(driven: DrivenWindow, times: int) -> Figures:
    document, tool = driven.session.document, driven.session.tool
    assert document is not None
    assert tool is not None
    taken_ms = [milliseconds(lambda: fit_document(document, tool)) for _ in range(times)]
    return {"fit_ms": statistics.median(taken_ms)}


def _turning(driven: DrivenWindow, times: int, data: str) -> Figures:
    """Turn the volume with the mouse, and let it come to rest, several times."""
    scene, frames = driven.window.scene, driven.frames
    stage = scene._stage
    assert stage is not None
    assert frames is not None
    canvas = stage.canvas.widget
    moving, delays_ms, rests_ms, rests_cpu_ms, full_while_moving = [], [], [], [], 0
    for _ in range(max(1, times // _TURNS_BEFORE_REST)):
        # Not where the tool is, which the mouse would take hold of.
        at = QPointF(canvas.width() / 8, canvas.height() / 8)
        _mouse(canvas, _Type.MouseButtonPress, at)
        for step in range(1, _TURNS_BEFORE_REST + 1):
            to = at + QPointF(_TURN_PX * step, 0)
            last_s = time.perf_counter()
            moving.append(driven.frame_ms(lambda to=to: _mouse(canvas, _Type.MouseMove, to)))  # type: ignore[misc]
            full_while_moving += scene.is_at_rest
        count, begun_cpu_s = frames.count, time.process_time()
        driven.wait(lambda: scene.is_at_rest)
        frames.wait_for_gl()
        rests_cpu_ms.append(1000 * (time.process_time() - begun_cpu_s))
        began_s, ended_s = frames.spans_s[count][0], frames.spans_s[-1][1]
        delays_ms.append(1000 * (began_s - last_s))
        rests_ms.append(1000 * (ended_s - began_s))
        _mouse(canvas, _Type.MouseButtonRelease, to)
        driven.settle()
    return {
        f"camera_moving_{data}_ms": statistics.median(ms for ms, _ in moving),
        f"camera_moving_{data}_cpu_ms": statistics.median(cpu_ms for _, cpu_ms in moving),
        f"camera_at_rest_{data}_ms": statistics.median(rests_ms),
        f"camera_at_rest_{data}_cpu_ms": statistics.median(rests_cpu_ms),
        f"move_to_full_frame_{data}_ms": statistics.median(delays_ms),
        f"full_frames_while_moving_{data}": float(full_while_moving),
    }


def mouse_event(canvas: QWidget, kind: QEvent.Type, at: QPointF) -> QMouseEvent:
    """Return what Qt tells a widget of the left button, or of the mouse that moves with it held down."""
    button = _Button.NoButton if kind == _Type.MouseMove else _Button.LeftButton
    held = _Button.NoButton if kind == _Type.MouseButtonRelease else _Button.LeftButton
    return QMouseEvent(kind, at, canvas.mapToGlobal(at), button, held, Qt.KeyboardModifier.NoModifier)


def _mouse(canvas: QWidget, kind: QEvent.Type, at: QPointF) -> None:
    QApplication.sendEvent(canvas, mouse_event(canvas, kind, at))


def _peer_level(driven: DrivenWindow) -> Level:
    """Return the very voxels that the peer draws."""
    volume, spacing_um = driven.session.volume, driven.session.spacing_um
    assert volume is not None
    assert spacing_um is not None
    every = slice(None, None, PEER_STRIDE)
    return Level(
        data=volume.load((every, every, every)),
        spacing_um=tuple(PEER_STRIDE * spacing for spacing in spacing_um),  # type: ignore[arg-type]
        origin_um=(0.0, 0.0, 0.0),
        kind="strided",
        factors=(PEER_STRIDE, PEER_STRIDE, PEER_STRIDE),
    )
