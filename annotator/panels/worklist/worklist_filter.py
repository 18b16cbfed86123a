"""Which volumes of the list are shown: by a text, and by how far they are."""

from typing import Literal, get_args

from PySide6.QtCore import QModelIndex, QObject, QPersistentModelIndex, QSortFilterProxyModel

from annotator.panels.worklist.worklist_model import WorklistModel, status_words
from annotator.session.volumes.worklist import ItemStatus, WorkItem

Kind = Literal["all", "new", "in_progress", "done", "flagged"]
KINDS: tuple[Kind, ...] = get_args(Kind)


class WorklistFilter(QSortFilterProxyModel):
    """Leaves volumes out and keeps the order of the rest: a queue is worked through as it stands."""

    def __init__(self, model: WorklistModel, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._model = model
        self._text = ""
        self._kind: Kind = "all"
        self.setSourceModel(model)

    def show_text(self, text: str) -> None:
        """Show the volumes whose name, status or flag contains a text; capitals do not count."""
        self._text = text.casefold()
        self.invalidate()

    def show_kind(self, kind: Kind) -> None:
        """Show all the volumes, those of one status, or those that are flagged."""
        self._kind = kind
        self.invalidate()

    def filterAcceptsRow(self, row: int, parent: QModelIndex | QPersistentModelIndex) -> bool:
        item = self._model.item(row)
        return _is_of(item, self._kind) and self._text in _text_of(item).casefold()


def kind_words(kind: Kind) -> str:
    """Return what a choice of volumes is called."""
    match kind:
        case "all":
            return "All"
        case "flagged":
            return "Flagged"
        case _:
            return status_words(kind).capitalize()


def _is_of(item: WorkItem, kind: Kind) -> bool:
    status: ItemStatus = item.status
    return kind == "all" or (item.flag is not None if kind == "flagged" else status == kind)


def _text_of(item: WorkItem) -> str:
    flag = "" if item.flag is None else f"flagged {item.flag}"
    return "\n".join((item.label, status_words(item.status), flag))
