"""Names in a list that is too narrow for them: what sets them apart stays."""

from collections.abc import Callable, Sequence
from itertools import takewhile

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, Qt
from PySide6.QtGui import QFontMetrics
from PySide6.QtWidgets import QStyledItemDelegate, QStyleOptionViewItem, QWidget

_SEPARATORS = "_-. "


def shared_beginning(names: Sequence[str]) -> str:
    """Return what all names begin with, up to a separator: no number is cut in two."""
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
    shared = "".join(letters[0] for letters in alike) if len(names) > 1 else ""
    return shared[: max(shared.rfind(separator) for separator in _SEPARATORS) + 1]


def elided_name(name: str, shared: str, metrics: QFontMetrics, room_px: int) -> str:
    """Return a name as far as there is room: it loses what it shares with the others, then its middle."""
    if metrics.horizontalAdvance(name) <= room_px:
        return name
    own = name.removeprefix(shared)
    shown = name if own == name else f"…{own}"
    return metrics.elidedText(shown, Qt.TextElideMode.ElideMiddle, room_px)


class ElidedNameDelegate(QStyledItemDelegate):
    """Elides the names of a column.

    Parameters
    ----------
    shared : callable
        Returns what all the names of the list begin with (`shared_beginning`).
    """

    def __init__(self, shared: Callable[[], str], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._shared = shared

    def initStyleOption(
        self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        super().initStyleOption(option, index)
        taken = option.decorationSize.width() + option.fontMetrics.height()
        room_px = option.rect.width() - taken
        option.text = elided_name(option.text, self._shared(), option.fontMetrics, room_px)
