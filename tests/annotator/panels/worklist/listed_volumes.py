"""What stands in the list of volumes."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QTreeView

from annotator.panels.worklist.worklist_panel import WorklistPanel
from tests.annotator.redrawn import redrawn

ROLE = Qt.ItemDataRole


def listed(panel: WorklistPanel) -> QTreeView:
    items = redrawn(panel).findChild(QTreeView, "worklist_list")
    assert isinstance(items, QTreeView)
    return items


def rows(items: QTreeView) -> list[tuple[str, str]]:
    model = items.model()
    spoken = [model.index(row, 0).data(ROLE.AccessibleTextRole) for row in range(model.rowCount())]
    return [tuple(text.split(", ")[:2]) for text in spoken]
