"""The scene and the three slices side by side; any one of them can fill the window."""

from collections.abc import Mapping

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

from annotator import theme
from annotator.application import running_application
from annotator.icons import icon
from annotator.view import Mode, Pane

ARRANGEMENT: tuple[tuple[Pane, Pane], tuple[Pane, Pane]] = (("scene", "slice2"), ("slice1", "slice0"))
"""Upper and lower row: neighbouring slices share an axis, as in a drawing from three sides."""

_TITLES: dict[Pane, str] = {
    "scene": "3D scene",
    "slice0": "Slice across x",
    "slice1": "Slice across y",
    "slice2": "Slice across z",
}


class PaneHeader(QFrame):
    """A pane's title, marked while the pane is the one used last, and the button that maximises it.

    Signals
    -------
    maximize_requested
    """

    maximize_requested = Signal()

    def __init__(self, pane: Pane, parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName(f"header_{pane}")
        self.setAccessibleName(f"Header of: {_TITLES[pane]}")
        self.setToolTip("Double click: let this pane fill the window, or show all four")
        self._axis = None if pane == "scene" else int(pane[-1])
        self._is_used = False
        self._is_maximized = False
        self._mode: Mode = "navigate"
        title = QLabel(_TITLES[pane])
        title.setObjectName(f"title_{pane}")
        self._button = QToolButton()
        self._button.setObjectName(f"maximize_{pane}")
        self._button.setAccessibleName(f"Maximize: {_TITLES[pane]}")
        self._button.setAutoRaise(True)
        self._button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._button.clicked.connect(self.maximize_requested)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(10, 1, 2, 1)
        layout.addWidget(title, 1)
        layout.addWidget(self._button)
        side = self.fontMetrics().height()
        self._button.setIconSize(QSize(side - 2, side - 2))
        self._draw_button()

    def show_state(self, *, is_used: bool, is_maximized: bool, mode: Mode) -> None:
        """Show whether the pane was used last and fills the window, and what a click in it does."""
        if (is_used, is_maximized, mode) == (self._is_used, self._is_maximized, self._mode):
            return
        self._is_used, self._is_maximized, self._mode = is_used, is_maximized, mode
        self._draw_button()
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.maximize_requested.emit()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._draw_button()

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        colors = theme.colors(self.palette())
        painter = QPainter(self)
        if self._axis is not None:
            painter.fillRect(0, 3, 4, self.height() - 6, colors.axes[self._axis])
        if self._is_used:
            highlight = colors.placing if self._mode == "place" else self.palette().highlight().color()
            painter.fillRect(0, self.height() - 2, self.width(), 2, highlight)
        painter.end()

    def _draw_button(self) -> None:
        self._button.setIcon(icon("restore" if self._is_maximized else "maximize", self.palette()))
        self._button.setToolTip(
            "Show all four panes" if self._is_maximized else "Let this pane fill the window"
        )


class FourUp(QWidget):
    """Arranges the panes; which of them fills the window is said from outside.

    Parameters
    ----------
    views : mapping
        The view of each pane.

    Signals
    -------
    maximize_requested : str or None
        The pane that should fill the window; None for all four.
    """

    maximize_requested = Signal(object)

    def __init__(self, views: Mapping[Pane, QWidget], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("four_up")
        self._maximized: Pane | None = None
        self._used: Pane = "scene"
        self._used_slice: Pane = "slice2"
        self._mode: Mode = "navigate"
        self._frames: dict[Pane, QWidget] = {}
        self._headers: dict[Pane, PaneHeader] = {}
        self._columns = QSplitter(Qt.Orientation.Vertical)
        self._columns.setObjectName("pane_rows")
        self._rows: list[QSplitter] = []
        for number, panes in enumerate(ARRANGEMENT):
            row = QSplitter(Qt.Orientation.Horizontal)
            row.setObjectName(f"pane_row_{number}")
            for pane in panes:
                row.addWidget(self._frame(pane, views[pane]))
            row.setChildrenCollapsible(False)
            row.setSizes([1000, 1000])
            row.splitterMoved.connect(self._on_row_splitter_moved)
            self._rows.append(row)
            self._columns.addWidget(row)
        self._columns.setChildrenCollapsible(False)
        self._columns.setSizes([1000, 1000])
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._columns)
        running_application().focusChanged.connect(self._on_application_focus_changed)
        self._draw()

    @property
    def used_pane(self) -> Pane:
        """The pane used last, or the one that fills the window."""
        return self._maximized or self._used

    @property
    def used_axis(self) -> int:
        """The axis that the slice used last is across."""
        pane = self._maximized if self._maximized not in (None, "scene") else self._used_slice
        return int(str(pane)[-1])

    def show_maximized(self, pane: Pane | None) -> None:
        """Let one pane fill the window, or show all four again."""
        self._maximized = pane
        for row, panes in zip(self._rows, ARRANGEMENT, strict=True):
            for other in panes:
                self._frames[other].setVisible(pane in (None, other))
            row.setVisible(pane is None or pane in panes)
        self._draw()

    def show_mode(self, mode: Mode) -> None:
        """Show in the headers whether a click places."""
        self._mode = mode
        self._draw()

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
        header.maximize_requested.connect(lambda: self._on_header_maximize_requested(pane))
        layout = QVBoxLayout(frame)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(header)
        layout.addWidget(view, 1)
        frame.setMinimumSize(120, 100)
        self._frames[pane] = frame
        self._headers[pane] = header
        return frame

    def _draw(self) -> None:
        for pane, header in self._headers.items():
            header.show_state(
                is_used=pane == self.used_pane, is_maximized=pane == self._maximized, mode=self._mode
            )

    def _on_header_maximize_requested(self, pane: Pane) -> None:
        self.maximize_requested.emit(None if self._maximized == pane else pane)

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
                if pane != "scene":
                    self._used_slice = pane
                self._draw()
