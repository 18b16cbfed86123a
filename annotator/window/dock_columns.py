"""How the panels share the window: beside, below or behind each other, each as large as it asks for."""

from collections.abc import Mapping
from functools import partial

from PySide6.QtCore import QObject, Qt, QTimer
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
        if self._is_narrow() and self._is_on_the_left() and self._centre.width() < self._window.width() / 2:
            self._move_worklist_behind()

    def follow(self) -> None:
        """Put the volumes behind the pose once the window is too narrow, and beside the panes once it is not.

        Only when it becomes so: in between they are where the person puts them.
        """
        is_narrow = self._is_narrow()
        if not self._is_arranged or is_narrow == self._was_narrow:
            return
        self._was_narrow = is_narrow
        if is_narrow and self._is_on_the_left():
            self._move_worklist_behind()
        elif not is_narrow and self._has_moved_worklist:
            self._move_worklist_back()

    def change_method(self, method: Method) -> None:
        """Make room for the panel of a method, which is shown from now on."""
        if self._is_above_pose():
            # As the person left the panel that goes; it has not been laid out for the other one yet.
            self._shares[self._method] = self._docks["keypoints"].height() / self._column_height()
        self._method = method
        # What a panel needs that has not been seen before is known only once it is laid out.
        QTimer.singleShot(0, self, partial(self._make_room, method))

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
