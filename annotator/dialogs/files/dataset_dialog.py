"""Which of several arrays in a file is the volume."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PySide6.QtCore import Slot
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from annotations.volumes import DatasetChoice
from annotator.looks.labels import ElidedText, Heading, WrappedText


class DatasetDialog(QDialog):
    """Lists the three-dimensional arrays of a file; the largest one is chosen at first.

    Parameters
    ----------
    name : Path or str
        What the file is called: its path, in blind work the volume's number.
    """

    def __init__(
        self, name: Path | str, choices: Sequence[DatasetChoice], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setObjectName("dataset_dialog")
        self.setWindowTitle("Choose the array")
        self.setSizeGripEnabled(True)

        self._list = QTreeWidget()
        self._list.setObjectName("dataset_list")
        self._list.setAccessibleName("Arrays in the file")
        self._list.setHeaderLabels(["Array", "Shape", "Type"])
        self._list.setRootIsDecorated(False)
        self._list.setUniformRowHeights(True)
        self._list.setAlternatingRowColors(True)
        for choice in choices:
            item = QTreeWidgetItem(
                [choice.name, " × ".join(map(str, choice.shape)), np.dtype(choice.dtype).name]
            )
            item.setToolTip(0, choice.name)
            self._list.addTopLevelItem(item)
        for column in range(3):
            self._list.resizeColumnToContents(column)
        self._list.itemDoubleClicked.connect(self._on_list_item_double_clicked)

        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = buttons.button(QDialogButtonBox.StandardButton.Ok)
        self._ok.setText("Open this array")
        self._ok.setObjectName("dataset_ok")
        cancel = buttons.button(QDialogButtonBox.StandardButton.Cancel)
        cancel.setText("Do not open")
        cancel.setObjectName("dataset_cancel")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        self._list.currentItemChanged.connect(self._on_list_current_item_changed)

        largest = max(range(len(choices)), key=lambda index: _voxels(choices[index]), default=-1)
        self._list.setCurrentIndex(self._list.model().index(largest, 0))
        self._ok.setEnabled(self.dataset is not None)

        layout = QVBoxLayout(self)
        layout.addWidget(Heading("Which array is the volume?"))
        layout.addWidget(ElidedText(str(name)))
        layout.addWidget(
            WrappedText(
                f"The file holds {len(choices)} three-dimensional arrays. "
                "An annotation names the one it was made on."
            )
        )
        layout.addWidget(self._list, 1)
        layout.addWidget(buttons)
        self._list.setFocus()

    @property
    def dataset(self) -> str | None:
        """Name of the chosen array."""
        item = self._list.currentItem()
        return item.text(0) if item is not None else None

    @Slot()
    def _on_list_current_item_changed(self) -> None:
        self._ok.setEnabled(self.dataset is not None)

    @Slot()
    def _on_list_item_double_clicked(self) -> None:
        self.accept()


def _voxels(choice: DatasetChoice) -> int:
    first, second, third = choice.shape
    return first * second * third
