"""Posing the tool by sliders and numbers: its joints, where it is, and how it is turned."""

from dataclasses import replace

from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QGridLayout, QLabel, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from annotations.geometry import rotations
from annotations.geometry.frames import vector
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool import Joint
from annotator.looks.angles import angle_title
from annotator.looks.labels import ColoredLabel, WrappedText, axis_color
from annotator.looks.naming import named
from annotator.panels.annotation.joint_slider import JointSlider
from annotator.panels.widgets.number_fields import NumberField, NumberFields
from annotator.session import Session

_POSITION_STEP_UM, _TURN_STEP_DEG = 10.0, 1.0
_TURNS = (
    ("yaw", "Turn about z in degrees, the first of the three"),
    ("pitch", "Turn about the y axis that the yaw leaves, in degrees"),
    ("roll", "Turn about the tool's own shaft in degrees, the last of the three"),
)


class PoseControls(QWidget):
    """Previews while a slider moves or a number is typed, and keeps it as one step.

    It is kept on letting the slider go, on Enter, on leaving, or once stepping rests; Esc drops it.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._joints: tuple[Joint, ...] = ()
        self.setObjectName("pose_controls")
        self._enter = named(QToolButton(), "pose_enter", title="Pose the tool as a whole")
        self._enter.setText("&Pose the tool as a whole")
        self._enter.setCheckable(True)
        self._enter.setToolTip("Pose mode: all keypoints or boxes follow the tool as one body")
        self._enter.clicked.connect(self._on_enter_clicked)
        self._locked = WrappedText(name="pose_locked")
        self._locked.set_color(lambda colors: colors.warning)
        self._controls = QWidget()
        self._sliders: list[JointSlider] = []
        self._numbers = NumberFields((), self)
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(8, 0, 0, 4)
        self._layout.addWidget(self._enter)
        self._layout.addWidget(self._locked)
        self._layout.addWidget(self._controls)
        self._make_controls(())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() != Qt.Key.Key_Escape:
            super().keyPressEvent(event)
            return
        # With nothing to drop, Esc goes on to the window: a person wants out of the field.
        event.setAccepted(self._session.view.draft is not None)
        if event.isAccepted():
            self._session.drop_preview()
        self.draw(over_typing=True)

    def draw(self, *, over_typing: bool = False) -> None:
        """Show the pose that is drawn; a number that is half typed stays, unless it is to go."""
        session = self._session
        if session.view.draft is None:
            # Dropped, kept or refused: what is still in hand must not bring it back.
            self._stop()
        tool, document = session.tool, session.document
        joints = tool.joints if tool is not None else ()
        if joints != self._joints:
            self._make_controls(joints)
        is_posing = session.view.mode == "pose"
        pose = session.tool_pose if is_posing else None
        self._enter.setChecked(is_posing)
        may_edit = not session.read_only_reason
        self._enter.setEnabled(tool is not None and bool(tool.links) and may_edit)
        locked = [] if document is None else [part.name for part in document.parts if part.locked]
        self._locked.setText(f"Locked: {', '.join(locked)}. Unlock to move the tool as a whole.")
        self._locked.setVisible(is_posing and bool(locked))
        self._controls.setVisible(pose is not None)
        self._controls.setEnabled(may_edit)
        if pose is None:
            return
        angles_deg = [pose.angles_deg.get(joint.name, 0.0) for joint in joints]
        for slider, angle_deg in zip(self._sliders, angles_deg, strict=True):
            slider.show_angle(angle_deg)
        numbers = [*angles_deg, *pose.position_um, *rotations.yaw_pitch_roll_deg(pose.rotation_wxyz)]
        steps = [_TURN_STEP_DEG] * len(joints) + [_POSITION_STEP_UM] * 3 + [_TURN_STEP_DEG] * 3
        for field, number, step in zip(self._numbers.fields, numbers, steps, strict=True):
            field.show_number(number, step, over_typing=over_typing)

    def _make_controls(self, joints: tuple[Joint, ...]) -> None:
        """Make a slider for each joint of a tool, and the fields for all numbers of its pose."""
        self._stop()
        self._joints = joints
        controls = QWidget()
        column = QVBoxLayout(controls)
        column.setContentsMargins(0, 0, 0, 0)
        of_joints, self._sliders = QGridLayout(), []
        of_joints.setColumnStretch(1, 1)
        fields = []
        for row, joint in enumerate(joints):
            low_deg, high_deg = joint.limits_deg
            title = angle_title(joint.name)
            slider = named(JointSlider(joint), f"pose_{joint.name}_slider", title=f"{title}, slider")
            slider.angle_requested.connect(self._on_slider_angle_requested)
            slider.settled.connect(self._on_slider_settled)
            field = NumberField(
                f"pose_{joint.name}_number", f"{title} in degrees", lowest=low_deg, highest=high_deg
            )
            field.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
            field.setSuffix("°")
            label = QLabel(title)
            label.setBuddy(field)
            for place, widget in enumerate((label, slider, field)):
                widget.setToolTip(f"From {joint.parent} to {joint.child}: {low_deg:g}° to {high_deg:g}°")
                of_joints.addWidget(widget, row, place)
            self._sliders.append(slider)
            fields.append(field)
        column.addLayout(of_joints)
        fields += _add_place_fields(column)
        self._numbers.deleteLater()
        self._numbers = NumberFields(fields, self)
        self._numbers.number_requested.connect(self._on_numbers_number_requested)
        self._numbers.settled.connect(self._on_numbers_settled)
        self._layout.replaceWidget(self._controls, controls)
        self._controls.deleteLater()
        self._controls = controls

    def _stop(self) -> None:
        self._numbers.stop()
        for slider in self._sliders:
            slider.stop()

    @Slot()
    def _on_enter_clicked(self) -> None:
        self._session.set_mode("pose" if self._enter.isChecked() else "navigate")
        # The session may have refused.
        self.draw()

    @Slot(float, bool)
    def _on_slider_angle_requested(self, angle_deg: float, is_typed: bool) -> None:
        slider = self.sender()
        if isinstance(slider, JointSlider):
            joint = self._joints[self._sliders.index(slider)]
            self._session.preview_angle(joint.name, angle_deg, is_typed=is_typed)
            # Where the session refused, everything goes back to how it is.
            self.draw()

    @Slot()
    def _on_slider_settled(self) -> None:
        draft = self._session.view.draft
        if draft is not None and draft.pose is not None:
            self._session.keep_draft()

    @Slot(int, float)
    def _on_numbers_number_requested(self, place: int, number: float) -> None:
        pose = self._session.tool_pose
        if pose is None:
            return
        if place < len(self._joints):
            self._session.preview_angle(self._joints[place].name, number, is_typed=True)
        else:
            self._session.preview_pose(_placed(pose, place - len(self._joints), number), is_typed=True)
        self.draw(over_typing=self._session.view.draft is None)

    @Slot()
    def _on_numbers_settled(self) -> None:
        draft = self._session.view.draft
        # By now something else may be in hand.
        if draft is not None and draft.is_typed and draft.pose is not None:
            self._session.keep_draft()


def _add_place_fields(column: QVBoxLayout) -> list[NumberField]:
    """Add fields for x, y, z in µm and yaw, pitch, roll in degrees to a layout, and return them."""
    grid, places, turns = QGridLayout(), [], []
    for axis, letter in enumerate("xyz"):
        field = NumberField(f"pose_{letter}", f"{letter} of the tool in µm")
        field.setToolTip(f"Where the middle of the tool's first link is along {letter}, in µm")
        label = ColoredLabel(letter)
        label.set_color(axis_color(axis))
        label.setBuddy(field)
        grid.addWidget(label, axis, 0)
        grid.addWidget(field, axis, 1)
        places.append(field)
    for row, (name, tooltip) in enumerate(_TURNS):
        field = NumberField(f"pose_{name}", f"{name} of the tool in degrees")
        field.setSuffix("°")
        field.setToolTip(tooltip)
        turn_label = QLabel(name)
        turn_label.setBuddy(field)
        grid.addWidget(turn_label, row, 2)
        grid.addWidget(field, row, 3)
        turns.append(field)
    grid.setColumnStretch(1, 1)
    grid.setColumnStretch(3, 1)
    column.addLayout(grid)
    return [*places, *turns]


def _placed(pose: ToolPose, place: int, number: float) -> ToolPose:
    """Return a pose with one of x, y, z in µm, or of yaw, pitch, roll in degrees, changed."""
    if place < 3:
        position_um = list(pose.position_um)
        position_um[place] = number
        return replace(pose, position_um=vector(position_um))
    turns_deg = list(rotations.yaw_pitch_roll_deg(pose.rotation_wxyz))
    turns_deg[place - 3] = number
    return replace(pose, rotation_wxyz=rotations.from_yaw_pitch_roll(*turns_deg))
