"""The table of actions as Qt's actions, in menus and a tool bar, drawn from the session's state."""

from collections.abc import Callable, Iterable, Mapping

from PySide6.QtCore import SIGNAL, QEvent, QObject, QSize, Qt
from PySide6.QtGui import QAction, QActionEvent, QKeySequence, QPalette
from PySide6.QtWidgets import QMainWindow, QMenu, QMenuBar, QToolBar

from annotator.actions.action import Action
from annotator.actions.changing import changes_document
from annotator.actions.state import ActionState
from annotator.actions.table import ACTIONS, MENUS, TOOL_BAR
from annotator.looks.icons import has_icon, icon

_BUTTON_TEXTS = {
    "open_file": "Open",
    "navigate_mode": "Navigate",
    "place_mode": "Place",
    "pose_mode": "Pose",
    "next_unplaced": "Next unplaced",
    "mark_done": "Done",
}


class ActionSet(QObject):
    """Every action of the table, ready to be triggered by menu, key or button.

    Parameters
    ----------
    handlers : mapping
        What each action does, by its name; KeyError if one is missing.
    window : QMainWindow
        In whose menus and with whose focus they act.
    after : callable
        Called after each action, to draw what is checked: Qt turns a checkable action over by itself,
        whatever became of it.
    """

    def __init__(
        self, handlers: Mapping[str, Callable[[], object]], window: QMainWindow, after: Callable[[], None]
    ) -> None:
        super().__init__(window)
        self._window = window
        self._after = after
        self._drawn: ActionState | None = None
        self._actions = {entry.name: self._make(entry, handlers[entry.name]) for entry in ACTIONS}
        self._tooltips = {name: action.toolTip() for name, action in self._actions.items()}
        self._connections = _SingleConnections(self)

    def __getitem__(self, name: str) -> QAction:
        return self._actions[name]

    def fill_menu_bar(self, bar: QMenuBar) -> None:
        """Put every action into its menu."""
        menus: dict[str, QMenu] = {}
        for entry in sorted(ACTIONS, key=lambda entry: _position(entry.menu)):
            menu = _menu(bar, menus, entry.menu)
            if entry.separated:
                menu.addSeparator()
            menu.addAction(self._actions[entry.name])

    def fill_tool_bar(self, bar: QToolBar) -> None:
        """Put the most used actions into the tool bar."""
        for number, names in enumerate(TOOL_BAR):
            if number:
                bar.addSeparator()
            for name in names:
                bar.addAction(self._actions[name])
                button = bar.widgetForAction(self._actions[name])
                button.installEventFilter(self._connections)
                button.setObjectName(f"button_{name}")
                button.setAccessibleName(self._actions[name].text())
                button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
                if name in _BUTTON_TEXTS:
                    self._actions[name].setIconText(_BUTTON_TEXTS[name])
                    button.setProperty("toolButtonStyle", Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        height = bar.fontMetrics().height()
        bar.setIconSize(QSize(round(1.4 * height), round(1.4 * height)))

    def draw_icons(self, palette: QPalette) -> None:
        """Draw the icons in a palette's colours."""
        for name, action in self._actions.items():
            shape = "recent" if name.startswith("recent_") else name
            if has_icon(shape):
                action.setIcon(icon(shape, palette))

    def draw(self, state: ActionState, also_checked: Iterable[str] = ()) -> None:
        """Enable, check and name the actions; ``also_checked`` are on for reasons outside the session."""
        self._draw_checks(state.checked | set(also_checked))
        if state == self._drawn:
            return
        self._drawn = state
        for entry in ACTIONS:
            is_refused = state.is_read_only and changes_document(entry)
            self._actions[entry.name].setEnabled(entry.when in state.met and not is_refused)
        reasons = dict(state.reasons)
        for name, tooltip in self._tooltips.items():
            self._actions[name].setToolTip(f"{tooltip}\n{reasons[name]}" if name in reasons else tooltip)
        for name, text in state.texts:
            self._actions[name].setText(text.replace("&", "&&"))
            self._actions[name].setVisible(bool(text))

    def _draw_checks(self, checked: frozenset[str]) -> None:
        for entry in ACTIONS:
            if entry.checkable:
                self._actions[entry.name].setChecked(entry.name in checked)

    def _make(self, entry: Action, handler: Callable[[], object]) -> QAction:
        action = QAction(entry.text, self._window)
        action.setObjectName(f"action_{entry.name}")
        action.setShortcuts([QKeySequence(key) for key in entry.shortcuts])
        keys = " or ".join(key.toString(QKeySequence.SequenceFormat.NativeText) for key in action.shortcuts())
        action.setToolTip(f"{entry.tooltip.removesuffix('.')} ({keys})")
        action.setAutoRepeat(entry.repeats)
        action.setCheckable(entry.checkable)

        def on_action_triggered() -> None:
            handler()
            self._after()

        action.triggered.connect(on_action_triggered)
        self._window.addAction(action)
        return action


class _SingleConnections(QObject):
    """Holds each button of a tool bar to one connection with its action.

    A tool button (of Qt 6.11) connects itself to its action anew whenever that changes, and never lets go.
    Each edit changes the text of "Undo …", and thousands of edits later thousands of calls follow the next.
    """

    def eventFilter(self, button: QObject, event: QEvent) -> bool:
        if isinstance(event, QActionEvent) and event.type() == QEvent.Type.ActionChanged:
            # With this event, which comes to it next, the button connects itself again. None means any of its
            # slots, which the types of PySide do not know.
            QObject.disconnect(event.action(), SIGNAL("changed()"), button, None)  # type: ignore[call-overload]
        return False


def _position(menu: str) -> int:
    """Order the entries of the table by menu, and in a menu as they stand."""
    return MENUS.index(menu.split("/", maxsplit=1)[0])


def _menu(bar: QMenuBar, menus: dict[str, QMenu], title: str) -> QMenu:
    if title not in menus:
        parent, _, own = title.rpartition("/")
        menu = _menu(bar, menus, parent).addMenu(own) if parent else bar.addMenu(f"&{own}")
        menu.setObjectName("menu_" + title.lower().replace("/", "_").replace(" ", "_"))
        menu.setToolTipsVisible(True)
        menus[title] = menu
    return menus[title]
