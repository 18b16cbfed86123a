"""What the panels' tables have in common: rows without children, headings that explain themselves."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QPersistentModelIndex, Qt
from PySide6.QtGui import QFont

Index = QModelIndex | QPersistentModelIndex
SORT_ROLE = Qt.ItemDataRole.UserRole + 1
"""By what a cell sorts, for a proxy."""

RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
"""How numbers stand in their cells."""

_ROOT = QModelIndex()

R = TypeVar("R")


@dataclass(frozen=True)
class Heading:
    """What stands above a column.

    Attributes
    ----------
    title, tooltip : str
    is_number : bool
        Numbers are sorted from the largest down at first: the worst comes first.
    """

    title: str
    tooltip: str
    is_number: bool = field(default=True, kw_only=True)


@dataclass(frozen=True)
class Column(Heading, Generic[R]):
    """A column whose rows are all of one kind.

    Attributes
    ----------
    text : callable
        What stands in it, of a row.
    sort : callable
        By what a row is sorted.
    """

    text: Callable[[R], str]
    sort: Callable[[R], Any]


class TableModel(QAbstractTableModel):
    """A model says how many rows there are, what the columns are headed by, and what is in the cells."""

    def rowCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else self._row_count()

    def columnCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else self._column_count()

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        headings = self._headings()
        if orientation != Qt.Orientation.Horizontal or section >= len(headings):
            return None
        heading = headings[section]
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return heading.title
            case Qt.ItemDataRole.ToolTipRole:
                return heading.tooltip
            case Qt.ItemDataRole.InitialSortOrderRole if heading.is_number:
                return Qt.SortOrder.DescendingOrder
        return None

    def _row_count(self) -> int:
        raise NotImplementedError

    def _column_count(self) -> int:
        return len(self._headings())

    def _headings(self) -> Sequence[Heading]:
        """Return what stands above each column; not asked for where a model has headings of its own kind."""
        raise NotImplementedError

    def _redraw(self, rows: Iterable[int]) -> None:
        """Announce that what is in some rows has changed."""
        last = self.columnCount() - 1
        for row in rows:
            self.dataChanged.emit(self.index(row, 0), self.index(row, last))


def bold_font() -> QFont:
    """Return the font in which the open volume, or the active part, is written."""
    font = QFont()
    font.setBold(True)
    return font
