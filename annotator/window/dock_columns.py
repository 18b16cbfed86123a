"""How the panels share the window: beside, below or behind each other, each as large as it asks for."""

from collections.abc import Callable, Mapping
from functools import partial

from PySide6.QtCore import QObject, Qt, QTimer, Signal, Slot
from PySide6.QtWidgets import QDockWidget, QMainWindow, QStyle, QWidget

from annotations.documents.record import Method

# Part of the window's width, at the first start, that the panels on the left take.
_LEFT_WIDTH = 0.14
# Part of their column's height that they take at most: the rest is for what follows from them. Boxes ask for
# more, and scroll.
_MOST_HEIGHT: Mapping[Method, float] = {"keypoints": 0.6, "boxes": 0.5}
# In lines of text: a narrower window has no room for a column of panels on either side of the panes,
_TWO_COLUMNS_LINES = 90
# and a lower one none for the pose below the keypoints or boxes.
_TWO_PANELS_LINES = 36
# Nor has one as low as this any for tables across the window, below the panes,
_TABLES_LINES = 48
# which take this part of its height at first.
_TABLES_HEIGHT = 0.34
# What is lower than this has not been given its height by anybody yet.
_LEAST_TABLES_LINES = 15


class DockColumns(QObject):
    """Arranges the panels once, and makes room for the method that is shown.

    Parameters
    ----------
    docks : mapping
        The panels' docks by the names of their panels.
    centre : QWidget
        What is between the columns, and as high as they are.
    method : str
        The method whose parts are shown at first.
    """

    _next_asked = Signal(object)

    def __init__(
        self, docks: Mapping[str, QDockWidget], centre: QWidget, method: Method, window: QMainWindow
    ) -> None:
        super().__init__(window)
        self._window = window
        self._centre = centre
        self._docks = docks
        self._method = method
        self._shares: dict[Method, float] = {}
        self._is_arranged = False
        self._was_narrow = False
        self._has_moved_worklist = False
        # Below the panes where there is room for them.
        self._has_moved_predictions = False
        self._has_hidden_keypoints = False
        # What is asked for while Qt lays out comes before it paints; a timer's turn comes after that.
        self._next_asked.connect(self._on_next_asked, Qt.ConnectionType.QueuedConnection)
        docks["predictions"].visibilityChanged.connect(self._on_predictions_visibility_changed)
        docks["keypoints"].visibilityChanged.connect(self._on_keypoints_visibility_changed)

    def stack(self) -> None:
        """Put panels behind each other where the window is too small.

        Before it is laid out: else it would be made as large as they need beside and below each other.
        """
        docks, window = self._docks, self._window
        line = window.fontMetrics().height()
        self._was_narrow = self._is_narrow()
        if self._was_narrow:
            window.tabifyDockWidget(docks["display"], docks["worklist"])
            docks["pose"].raise_()
        self._has_moved_predictions = True
        if not self._was_narrow:
            self._move_predictions_back()
        if window.height() < _TWO_PANELS_LINES * line:
            window.tabifyDockWidget(docks["pose"], docks["keypoints"])
            docks["keypoints"].raise_()

    def arrange(self) -> None:
        """Give the panes most of the window, and the panels what they ask for; once its size is known."""
        docks, window = self._docks, self._window
        window.resizeDocks(
            [docks["worklist"], docks["keypoints"]],
            [round(_LEFT_WIDTH * window.width()), docks["keypoints"].sizeHint().width()],
            Qt.Orientation.Horizontal,
        )
        self._is_arranged = True
        if self._is_above_pose():
            self._share(self._asked_share(self._method))

    def follow_restored(self) -> None:
        """Put the volumes behind the pose where a layout was restored that is made for a wider window."""
        if not self._is_narrow():
            return
        if self._is_on_the_left() and self._centre.width() < self._window.width() / 2:
            self._move_worklist_behind()
        self._move_predictions_behind()

    def follow(self) -> None:
        """Put panels behind the pose once the window is too narrow, and back again once it is not.

        Only when it becomes so: in between they are where the person puts them.
        """
        is_narrow = self._is_narrow()
        if not self._is_arranged or is_narrow == self._was_narrow:
            return
        self._was_narrow = is_narrow
        if is_narrow:
            if self._is_on_the_left():
                self._move_worklist_behind()
            self._move_predictions_behind()
            return
        if self._has_moved_worklist:
            self._move_worklist_back()
        self.show_keypoints()
        if self._has_moved_predictions:
            self._move_predictions_back()

    def change_method(self, method: Method) -> None:
        """Make room for the panel of a method, which is shown from now on."""
        if self._is_above_pose():
            # As the person left the panel that goes; it has not been laid out for the other one yet.
            self._shares[self._method] = self._docks["keypoints"].height() / self._column_height()
        self._method = method
        # What a panel needs that has not been seen before is known only once it is laid out.
        QTimer.singleShot(0, self, partial(self._make_room, method))

    def show_keypoints(self) -> None:
        """Show what made room for the predictions again."""
        if self._has_hidden_keypoints:
            self._has_hidden_keypoints = False
            self._docks["keypoints"].show()

    def uncover_pose(self) -> None:
        """Bring the pose to the front if it is behind another tab; where it is closed it stays so."""
        if self._docks["pose"].visibleRegion().isEmpty():
            self._docks["pose"].raise_()

    def _is_narrow(self) -> bool:
        return self._window.width() < _TWO_COLUMNS_LINES * self._window.fontMetrics().height()

    def _is_on_the_left(self) -> bool:
        dock, left = self._docks["worklist"], Qt.DockWidgetArea.LeftDockWidgetArea
        return not (dock.isFloating() or dock.isHidden()) and self._window.dockWidgetArea(dock) == left

    def _move_worklist_behind(self) -> None:
        pose = self._docks["pose"]
        together = [pose, *self._window.tabifiedDockWidgets(pose)]
        in_front = [dock for dock in together if not dock.visibleRegion().isEmpty()]
        self._window.tabifyDockWidget(pose, self._docks["worklist"])
        self._has_moved_worklist = True
        for dock in in_front:
            dock.raise_()
        if self._is_above_pose():
            # Most windows that become narrow become lower, too.
            QTimer.singleShot(0, self, lambda: self._share(self._asked_share(self._method)))

    def _move_worklist_back(self) -> None:
        dock, window = self._docks["worklist"], self._window
        self._has_moved_worklist = False
        if dock in window.tabifiedDockWidgets(self._docks["pose"]):
            window.addDockWidget(Qt.DockWidgetArea.LeftDockWidgetArea, dock)
            width = round(_LEFT_WIDTH * window.width())
            window.resizeDocks([dock], [width], Qt.Orientation.Horizontal)

    def _are_predictions_below(self) -> bool:
        dock, below = self._docks["predictions"], Qt.DockWidgetArea.BottomDockWidgetArea
        return not dock.isFloating() and self._window.dockWidgetArea(dock) == below

    def _move_predictions_behind(self) -> None:
        if self._are_predictions_below():
            dock = self._docks["predictions"]
            is_seen = not dock.isHidden()
            self._window.tabifyDockWidget(self._docks["pose"], dock)
            self._has_moved_predictions = True
            if is_seen:
                dock.raise_()
            else:
                dock.hide()

    def _move_predictions_back(self) -> None:
        dock, window = self._docks["predictions"], self._window
        if window.height() < _TABLES_LINES * window.fontMetrics().height():
            return
        self._has_moved_predictions = False
        # As hidden as it is: then it is not told behind which others it is.
        is_in_column = window.dockWidgetArea(dock) == window.dockWidgetArea(self._docks["pose"])
        if is_in_column and not dock.isFloating():
            is_seen = not dock.isHidden()
            window.addDockWidget(Qt.DockWidgetArea.BottomDockWidgetArea, dock)
            dock.setVisible(is_seen)

    def _on_predictions_visibility_changed(self, is_visible: bool) -> None:
        if self._is_arranged:
            # Once it is laid out, and before it is painted.
            self._next_asked.emit(partial(self._make_room_for_review, is_visible))

    def _on_keypoints_visibility_changed(self, is_visible: bool) -> None:
        if is_visible:
            # Whoever hides them from now on does so for good.
            self._has_hidden_keypoints = False

    @Slot(object)
    def _on_next_asked(self, work: Callable[[], None]) -> None:
        work()

    def _make_room_for_review(self, is_reviewing: bool) -> None:
        """Give predictions a height in which tables can be read: of a low column all, while they are seen."""
        dock, line = self._docks["predictions"], self._window.fontMetrics().height()
        if not is_reviewing:
            self.show_keypoints()
        elif self._are_predictions_below():
            if dock.height() < _LEAST_TABLES_LINES * line:
                height = round(_TABLES_HEIGHT * self._window.height())
                self._window.resizeDocks([dock], [height], Qt.Orientation.Vertical)
                if (layout := self._window.layout()) is not None:
                    layout.activate()
                # What is above has been made lower by the same part, whatever it needs. After the painting:
                # both together would hold the window up.
                self._next_asked.emit(partial(self._make_room, self._method))
        elif self._column_height() < _TABLES_LINES * line and self._shares_column_with_predictions():
            self._has_hidden_keypoints = True
            self._docks["keypoints"].hide()

    def _shares_column_with_predictions(self) -> bool:
        keypoints, predictions = self._docks["keypoints"], self._docks["predictions"]
        is_alone = keypoints.isFloating() or keypoints.isHidden() or predictions.isFloating()
        is_behind = predictions in self._window.tabifiedDockWidgets(keypoints)
        return not is_alone and not is_behind and keypoints.x() == predictions.x()

    def _make_room(self, method: Method) -> None:
        """Give a panel the height that it had, or asks for; what is wider is as the person wants it."""
        dock = self._docks["keypoints"]
        if self._is_above_pose():
            width = max(dock.sizeHint().width(), dock.width())
            self._window.resizeDocks([dock], [width], Qt.Orientation.Horizontal)
            self._share(self._shares.get(method, self._asked_share(method)))

    def _is_above_pose(self) -> bool:
        """Say whether the panel of keypoints or boxes shares its column with the one below it."""
        dock = self._docks["keypoints"]
        is_behind = self._docks["pose"] in self._window.tabifiedDockWidgets(dock)
        return self._is_arranged and not dock.isFloating() and not is_behind

    def _column_height(self) -> int:
        """Return the height that the panels of a column share, the tabs below the lower ones among it."""
        between = self._window.style().pixelMetric(QStyle.PixelMetric.PM_DockWidgetSeparatorExtent)
        return self._centre.height() - between

    def _asked_share(self, method: Method) -> float:
        asked = self._docks["keypoints"].sizeHint().height() / self._column_height()
        return min(asked, _MOST_HEIGHT[method])

    def _share(self, share: float) -> None:
        """Give the panel of keypoints or boxes a part of its column, and the one below it the rest."""
        height = round(share * self._column_height())
        self._window.resizeDocks(
            [self._docks["keypoints"], self._docks["pose"]],
            [height, max(self._column_height() - height, 1)],
            Qt.Orientation.Vertical,
        )
