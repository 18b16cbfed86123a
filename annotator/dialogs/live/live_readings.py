"""The numbers beside a live view: the pose, how sure the network is, and how the view keeps up."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QVBoxLayout, QWidget

from annotations.geometry.targets import pose_targets
from annotations.geometry.tool import ToolSpecification
from annotations.prediction.live.frame import LiveFrame
from annotations.prediction.live.statistics import LiveStatistics
from annotator.looks.angles import angle_title, signed_text
from annotator.looks.labels import ColoredLabel
from annotator.looks.naming import named

_NOTHING = "—"
_NARROW = "\N{NARROW NO-BREAK SPACE}"
_WIDEST = "−00.00  −00.00  −00.00 mm"


class LiveReadings(QWidget):
    """Titles and values in places that stay, so that nothing jumps while the values change."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("live_readings")
        self._tool: ToolSpecification | None = None
        self._values: dict[str, ColoredLabel] = {}
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._pose, self._confidence = QWidget(), QWidget()
        self._speed = _grid(QWidget(), "How it keeps up")
        for name, title, tooltip in (
            ("rate", "Frames a second", "Over the last two seconds"),
            ("latency", "Latency", "From a volume's appearance to its pose on screen: half are faster"),
            ("latency_p99", "99 % within", "Of the last 600 volumes"),
            ("shown", "Shown", "Volumes that were on screen"),
            (
                "dropped",
                "Dropped",
                "Passed over because a newer one was there, or gone before they were read",
            ),
            ("skipped", "Not shown", "Volumes that could not be shown: the messages below say why"),
            ("waiting", "Waiting", "Volumes that wait until you say how far apart their voxels are"),
            ("restarts", "Restarts", "How often the network's process was started anew after a crash"),
        ):
            self._add_row(self._speed, name, title, tooltip)
        self._column.addWidget(self._pose)
        self._column.addWidget(self._confidence)
        self._column.addWidget(self._speed)
        self._column.addStretch(1)
        self.setMinimumWidth(self.fontMetrics().horizontalAdvance(f"Orientation {_WIDEST}") + 16)

    def show_tool(self, tool: ToolSpecification) -> None:
        """Make a row for each quantity of a tool."""
        if tool is self._tool:
            return
        self._tool = tool
        for old in (self._pose, self._confidence):
            self._column.removeWidget(old)
            old.deleteLater()
        self._values = {name: value for name, value in self._values.items() if value.parent() is self._speed}
        self._pose = _grid(QWidget(), "Pose")
        if tool.targets.position is not None:
            self._add_row(self._pose, "position", "Position", "In the volume's frame, along x, y and z")
        if tool.targets.orientation is not None:
            self._add_row(self._pose, "orientation", "Orientation", "Unit vector along the tool")
        for joint in tool.joints:
            self._add_row(
                self._pose, f"angle_{joint.name}", angle_title(joint.name), "Signed, by the fitted pose"
            )
        self._add_row(self._pose, "fit", "Fit", "How far the keypoints are off the fitted pose")
        self._confidence = _grid(QWidget(), "How sure the network is")
        for name in tool.keypoint_names:
            self._add_row(self._confidence, f"presence_{name}", name, "That the keypoint is there at all")
        self._column.insertWidget(0, self._pose)
        self._column.insertWidget(1, self._confidence)

    def show_frame(self, frame: LiveFrame) -> None:
        """Write the pose, and how sure the network is."""
        tool, pose = self._tool, frame.pose
        assert tool is not None
        targets = pose_targets({} if pose is None else pose.keypoints_um, tool)
        self._write(
            "position",
            None
            if targets.position_um is None
            else f"{'  '.join(f'{value / 1000:z.2f}' for value in targets.position_um)}{_NARROW}mm",
        )
        self._write(
            "orientation",
            None
            if targets.orientation is None
            else "  ".join(f"{value:z.3f}" for value in targets.orientation),
        )
        for joint in tool.joints:
            angle_deg = None if pose is None else pose.angles_deg.get(joint.name)
            self._write(f"angle_{joint.name}", None if angle_deg is None else signed_text(angle_deg, 1))
        self._write("fit", None if pose is None else f"± {pose.rms_um / 1000:.2f}{_NARROW}mm")
        for keypoint in frame.keypoints:
            name = f"presence_{keypoint.name}"
            words = {"placed": "", "out_of_view": "  outside", "unplaced": "  not seen"}[keypoint.state]
            self._write(name, f"{keypoint.confidence.presence:.0%}{words}")
            self._values[name].set_color(None if not words else lambda colors: colors.error)

    def clear(self) -> None:
        """Show no pose."""
        for name, value in self._values.items():
            if value.parent() is not self._speed:
                self._write(name, None)
                value.set_color(None)

    def show_statistics(self, statistics: LiveStatistics | None) -> None:
        """Write how the view keeps up."""
        figures = statistics or LiveStatistics()
        self._write("rate", f"{figures.rate_hz:.1f}" if figures.shown else None)
        self._write("latency", _milliseconds(figures.latency_s))
        self._write("latency_p99", _milliseconds(figures.latency_p99_s))
        self._write("shown", f"{figures.shown:,}")
        self._write("dropped", f"{figures.dropped:,}")
        self._write("skipped", f"{figures.skipped:,}")
        self._write("waiting", f"{figures.waiting:,}")
        self._write("restarts", f"{figures.restarts:,}")
        for name, count in (
            ("dropped", figures.dropped),
            ("skipped", figures.skipped),
            ("waiting", figures.waiting),
            ("restarts", figures.restarts),
        ):
            self._values[name].set_color((lambda colors: colors.warning) if count else None)

    def _add_row(self, group: QWidget, name: str, title: str, tooltip: str) -> None:
        grid = group.layout()
        assert isinstance(grid, QGridLayout)
        label = QLabel(title)
        label.setToolTip(tooltip)
        value = named(ColoredLabel(_NOTHING), f"live_{name}", title=title, tooltip=tooltip)
        value.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        row = grid.rowCount()
        grid.addWidget(label, row, 0)
        grid.addWidget(value, row, 1)
        self._values[name] = value

    def _write(self, name: str, text: str | None) -> None:
        value = self._values.get(name)
        if value is not None and value.text() != (text or _NOTHING):
            value.setText(text or _NOTHING)


def _grid(group: QWidget, title: str) -> QWidget:
    grid = QGridLayout(group)
    grid.setContentsMargins(0, 0, 0, 6)
    grid.setVerticalSpacing(2)
    grid.setColumnStretch(1, 1)
    heading = QLabel(title)
    font = heading.font()
    font.setBold(True)
    heading.setFont(font)
    grid.addWidget(heading, 0, 0, 1, 2)
    return group


def _milliseconds(seconds: float | None) -> str | None:
    return None if seconds is None else f"{1000 * seconds:.0f}{_NARROW}ms"
