"""The scene and the three slices side by side; any one of them can fill the window."""

from collections.abc import Sequence
from functools import partial

from PySide6.QtCore import QByteArray, QDataStream, QEvent, QIODevice, QSize, Qt, Signal, Slot
from PySide6.QtGui import QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QSplitter,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from annotator.actions.view_table import PANE_TITLES
from annotator.looks import theme
from annotator.looks.application import running_application
from annotator.looks.icons import icon
from annotator.looks.labels import ColoredLabel
from annotator.session import Session
from annotator.session.editing.click_meaning import click_meaning
from annotator.session.viewing.view import Pane, View
from annotator.slices.slice_view import SliceView

ARRANGEMENT: tuple[tuple[Pane, Pane], tuple[Pane, Pane]] = (("scene", "slice2"), ("slice1", "slice0"))
"""Upper and lower row: neighbouring slices share an axis, as in a drawing from three sides."""

SLICE_PANES: tuple[Pane, Pane, Pane] = ("slice0", "slice1", "slice2")
"""By the axis that the slice is across."""


class PaneHeader(QFrame):
    """The strip above a pane: what it shows, whether keys act in it, and the button that maximises it.

    Signals
    -------
    maximize_requested
        Double-clicked, or its button pressed.
    """

    maximize_requested = Signal()

    def __init__(self, pane: Pane, parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName(f"header_{pane}")
        self.setAccessibleName(f"{PANE_TITLES[pane]}, header")
        self.setToolTip("Double click: let this pane fill the window, or show all four")
        self._axis = SLICE_PANES.index(pane) if pane in SLICE_PANES else None
        self._shown: tuple[bool, bool, str] | None = None
        self._is_used = self._is_placing = self._is_maximized = False
        title = QLabel(PANE_TITLES[pane])
        title.setObjectName(f"title_{pane}")
        self._button = QToolButton()
        self._button.setObjectName(f"maximize_{pane}")
        self._button.setAccessibleName(f"Maximize: {PANE_TITLES[pane]}")
        self._button.setAutoRaise(True)
        self._button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._button.clicked.connect(self.maximize_requested)
        height = self.fontMetrics().height()
        self._button.setIconSize(QSize(height - 2, height - 2))
        self.setFixedHeight(height + 6)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(10, 0, 2, 2)
        layout.addWidget(title, 1)
        # The slices say it over their images.
        self._placing = ColoredLabel()
        self._placing.setObjectName(f"placing_{pane}")
        self._placing.set_color(lambda colors: colors.placing)
        font = self._placing.font()
        font.setBold(True)
        self._placing.setFont(font)
        self._placing.setVisible(False)
        layout.addWidget(self._placing)
        layout.addWidget(self._button)

    def show_state(self, *, is_used: bool, is_maximized: bool, placing: str) -> None:
        """Show whether the pane was used last, whether it fills the window, and what a click in it does."""
        shown = (is_used, is_maximized, placing)
        if shown == self._shown:
            # Asked for with every edit, which seldom changes it.
            return
        self._shown = shown
        is_turned = is_maximized != self._is_maximized
        self._is_used, self._is_placing, self._is_maximized = is_used, bool(placing), is_maximized
        if self._axis is None:
            self._placing.setText(placing)
            self._placing.setVisible(bool(placing))
        self._button.setToolTip("Show all four panes" if is_maximized else "Let this pane fill the window")
        if is_turned or self._button.icon().isNull():
            self._draw_icon()
        self.update()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        # The palette of the window that holds the header may not be the new one yet.
        if event.type() == QEvent.Type.PaletteChange:
            self._draw_icon()

    def _draw_icon(self) -> None:
        self._button.setIcon(icon("restore" if self._is_maximized else "maximize", self.palette()))

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.maximize_requested.emit()

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        colors = theme.colors(self.palette())
        painter = QPainter(self)
        if self._axis is not None:
            painter.fillRect(0, 3, 4, self.height() - 8, colors.axes[self._axis])
        # The slices have a border of their own while a click places.
        if self._is_used or (self._is_placing and self._axis is None):
            line = colors.placing if self._is_placing else self.palette().highlight().color()
            painter.fillRect(0, self.height() - 2, self.width(), 2, line)
        painter.end()


class FourUp(QWidget):
    """Arranges the panes as the session's view says.

    Parameters
    ----------
    scene : QWidget
    slices : sequence of SliceView
        Across axes 0, 1 and 2.
    """

    def __init__(
        self, session: Session, scene: QWidget, slices: Sequence[SliceView], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setObjectName("four_up")
        self._session = session
        self._used: Pane = "scene"
        self._used_axis = 2
        self._headers: dict[Pane, PaneHeader] = {}
        self._scene = scene
        self._waiting = QLabel("Preparing the scene …")
        self._waiting.setObjectName("scene_waiting")
        self._waiting.setAlignment(Qt.AlignmentFlag.AlignCenter)
        place = QWidget()
        layers = QVBoxLayout(place)
        layers.setContentsMargins(0, 0, 0, 0)
        layers.addWidget(self._waiting)
        layers.addWidget(scene)
        scene.hide()
        views: dict[Pane, QWidget] = {"scene": place, **dict(zip(SLICE_PANES, slices, strict=True))}
        self._frames = {pane: self._frame(pane, view) for pane, view in views.items()}
        self._columns = QSplitter(Qt.Orientation.Vertical)
        self._columns.setObjectName("pane_rows")
        self._rows: list[QSplitter] = []
        for number, panes in enumerate(ARRANGEMENT):
            row = QSplitter(Qt.Orientation.Horizontal)
            row.setObjectName(f"pane_row_{number}")
            for pane in panes:
                row.addWidget(self._frames[pane])
            row.setChildrenCollapsible(False)
            row.splitterMoved.connect(self._on_row_splitter_moved)
            self._rows.append(row)
            self._columns.addWidget(row)
        self._columns.setChildrenCollapsible(False)
        self.reset()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._columns)
        session.view_changed.connect(self._on_session_view_changed)
        session.document_changed.connect(self._on_session_document_changed)
        running_application().focusChanged.connect(self._on_application_focus_changed)
        self._draw()

    @property
    def used_pane(self) -> Pane:
        """The pane that fills the window, or else the one used last."""
        return self._session.view.maximized or self._used

    @property
    def used_axis(self) -> int:
        """The axis that the slice used last is across."""
        pane = self._session.view.maximized
        return SLICE_PANES.index(pane) if pane in SLICE_PANES else self._used_axis

    def show_scene(self) -> None:
        """Show the scene, which until then is hidden: as soon as it is shown it imports what it needs."""
        self._waiting.hide()
        self._scene.show()

    def state(self) -> QByteArray:
        """Pack how the panes share the space."""
        packed = QByteArray()
        stream = QDataStream(packed, QIODevice.OpenModeFlag.WriteOnly)
        for splitter in (self._columns, *self._rows):
            stream << splitter.saveState()
        return packed

    def restore(self, state: QByteArray) -> None:
        """Share the space as packed before; what cannot be read is left as it is."""
        stream = QDataStream(state)
        for splitter in (self._columns, *self._rows):
            packed = QByteArray()
            stream >> packed
            if not packed.isEmpty():
                splitter.restoreState(packed)

    def reset(self) -> None:
        """Share the space evenly."""
        for splitter in (self._columns, *self._rows):
            splitter.setSizes([1000, 1000])

    def _frame(self, pane: Pane, view: QWidget) -> QWidget:
        frame = QWidget()
        frame.setObjectName(f"pane_{pane}")
        header = PaneHeader(pane, frame)
        header.maximize_requested.connect(partial(self._toggle_maximized, pane))
        self._headers[pane] = header
        layout = QVBoxLayout(frame)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(header)
        layout.addWidget(view, 1)
        return frame

    def _toggle_maximized(self, pane: Pane) -> None:
        self._session.look(maximized=None if self._session.view.maximized == pane else pane)

    def _arrange(self) -> None:
        maximized = self._session.view.maximized
        for row, panes in zip(self._rows, ARRANGEMENT, strict=True):
            for pane in panes:
                self._frames[pane].setVisible(maximized in (None, pane))
            row.setVisible(maximized is None or maximized in panes)

    def _draw(self) -> None:
        view, placing = self._session.view, click_meaning(self._session)
        for pane, header in self._headers.items():
            header.show_state(
                is_used=pane == self.used_pane,
                is_maximized=pane == view.maximized,
                placing=placing,
            )

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.maximized != after.maximized:
            self._arrange()
        if (before.maximized, before.mode, before.active_part) != (
            after.maximized,
            after.mode,
            after.active_part,
        ):
            self._draw()

    @Slot(object, object)
    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        self._draw()

    @Slot()
    def _on_row_splitter_moved(self) -> None:
        # One cross, not two handles: both rows are divided at the same place.
        moved = self.sender()
        for row in self._rows:
            if row is not moved and isinstance(moved, QSplitter):
                row.setSizes(moved.sizes())

    @Slot(QWidget, QWidget)
    def _on_application_focus_changed(self, _: QWidget | None, new: QWidget | None) -> None:
        for pane, frame in self._frames.items():
            if new is not None and (frame is new or frame.isAncestorOf(new)):
                self._used = pane
                if pane in SLICE_PANES:
                    self._used_axis = SLICE_PANES.index(pane)
                self._draw()
