"""Edits that an earlier run did not save: give them back, throw them away, or ask again next time."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from PySide6.QtCore import QDateTime, Signal, Slot
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QMessageBox,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.recovery import Recovery
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named


class RecoveryDialog(QDialog):
    """Lists what the recovery journals hold: to be recovered, discarded, or kept for the next start.

    Parameters
    ----------
    neutral_names : mapping of Path to str, optional
        What those of blind work are called, by their journals: no file's name is to be seen of them.

    Signals
    -------
    recover_requested : Recovery
    discard_requested : Recovery
        Asked for and confirmed.
    """

    recover_requested = Signal(object)
    discard_requested = Signal(object)

    def __init__(
        self,
        recoveries: Sequence[Recovery],
        parent: QWidget | None = None,
        *,
        neutral_names: Mapping[Path, str] | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("recovery_dialog")
        self.setWindowTitle("Recovered edits")
        self.setSizeGripEnabled(True)
        self._recoveries = list(recoveries)
        self._neutral_names = neutral_names or {}

        self._list = QTreeWidget()
        self._list.setObjectName("recovery_list")
        self._list.setAccessibleName("Annotations with unsaved edits")
        self._list.setHeaderLabels(["Annotation", "Last edit", "Edits", "Placed"])
        self._list.setRootIsDecorated(False)
        self._list.setAlternatingRowColors(True)
        for recovery in self._recoveries:
            self._list.addTopLevelItem(self._item(recovery))
        for column in range(self._list.columnCount()):
            self._list.resizeColumnToContents(column)
        self._list.currentItemChanged.connect(self._on_list_current_item_changed)

        self._recover = named(QPushButton("&Recover and open"), "recovery_recover")
        self._recover.setToolTip(
            "Open the annotation with these edits in it; its file changes when it is saved"
        )
        self._recover.setDefault(True)
        self._recover.clicked.connect(self._on_recover_clicked)
        self._discard = named(QPushButton("&Discard…"), "recovery_discard")
        self._discard.setToolTip("Throw these edits away for good; the saved file stays as it is")
        self._discard.setAutoDefault(False)
        self._discard.clicked.connect(self._on_discard_clicked)
        actions = QHBoxLayout()
        actions.addWidget(self._recover)
        actions.addWidget(self._discard)
        actions.addStretch(1)

        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        later = buttons.button(QDialogButtonBox.StandardButton.Close)
        later.setText("Decide &later")
        later.setObjectName("recovery_later")
        later.setToolTip("Keep everything; this question comes again at the next start")
        buttons.rejected.connect(self.reject)

        layout = QVBoxLayout(self)
        layout.addWidget(Heading("The program ended before these edits were saved. Nothing is lost."))
        layout.addWidget(
            WrappedText(
                "Recovering opens the annotation as it was after its last edit. "
                "Until it is saved, its file stays as it is."
            )
        )
        layout.addWidget(self._list, 1)
        layout.addLayout(actions)
        layout.addWidget(buttons)
        self._list.setCurrentIndex(self._list.model().index(len(self._recoveries) - 1, 0))
        self.resize(self.fontMetrics().averageCharWidth() * 80, self.sizeHint().height())
        self._draw()

    @Slot()
    def _on_list_current_item_changed(self) -> None:
        self._draw()

    @Slot()
    def _on_recover_clicked(self) -> None:
        row = self._row()
        if row is not None:
            recovery = self._take(row)
            # The session opens one document at a time: what is left is offered again afterwards.
            self.accept()
            self.recover_requested.emit(recovery)

    @Slot()
    def _on_discard_clicked(self) -> None:
        row = self._row()
        if row is None:
            return
        recovery = self._recoveries[row]
        question = QMessageBox(self)
        question.setObjectName("recovery_discard_question")
        question.setIcon(QMessageBox.Icon.Warning)
        question.setText(f"Throw away {_edits(recovery)} of {self._name(recovery)}?")
        question.setInformativeText("They cannot be brought back. The saved file stays as it is.")
        question.setStandardButtons(QMessageBox.StandardButton.Discard | QMessageBox.StandardButton.Cancel)
        question.setDefaultButton(QMessageBox.StandardButton.Cancel)
        if question.exec() != QMessageBox.StandardButton.Discard:
            return
        self._take(row)
        self.discard_requested.emit(recovery)
        if not self._recoveries:
            self.accept()

    def _row(self) -> int | None:
        row = self._list.currentIndex().row()
        return row if row >= 0 else None

    def _take(self, row: int) -> Recovery:
        self._list.takeTopLevelItem(row)
        return self._recoveries.pop(row)

    def _draw(self) -> None:
        chosen = self._list.currentItem() is not None
        self._recover.setEnabled(chosen)
        self._discard.setEnabled(chosen)

    def _name(self, recovery: Recovery) -> str:
        return self._neutral_names.get(recovery.journal_path) or recovery.annotation_path.name

    def _item(self, recovery: Recovery) -> QTreeWidgetItem:
        moment = QDateTime.fromSecsSinceEpoch(int(recovery.changed_at))
        document = recovery.document
        placed = sum(part.anchor_um is not None for part in document.parts)
        item = QTreeWidgetItem(
            [
                self._name(recovery),
                moment.toString("yyyy-MM-dd hh:mm"),
                str(recovery.edits),
                f"{placed} of {len(document.parts)} {document.method}",
            ]
        )
        if recovery.journal_path not in self._neutral_names:
            item.setToolTip(0, f"{recovery.annotation_path}\nVolume: {Path(document.volume.path).name}")
        return item


def _edits(recovery: Recovery) -> str:
    return "1 edit" if recovery.edits == 1 else f"{recovery.edits} edits"
