"""The volumes of a study: those that are in it, and below them those that are to come in."""

from collections.abc import Collection, Iterable
from pathlib import Path

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QHBoxLayout,
    QHeaderView,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.seen_volumes import FoundVolume
from annotations.documents.study import Study
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named

_FOUND = Qt.ItemDataRole.UserRole
_ROWS_SHOWN = 6
_ID_LETTERS = 18
_REMARKS_SHOWN = 3
_TWICE = "comes twice"


class StudyVolumes(QWidget):
    """A list of volumes; new ones have a check mark, and can be taken out again.

    Those that cannot be read are not checked: to have one in the study all the same is a person's choice.

    Parameters
    ----------
    known : Study or None
        Whose volumes stay; None for a new study.

    Signals
    -------
    changed
        By a person's hand.
    """

    changed = Signal()

    def __init__(self, known: Study | None = None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._known = known
        self._list = named(QTreeWidget(), "study_volumes", title="Volumes")
        self._list.setHeaderLabels(["Id", "File", "Remark"])
        self._list.setRootIsDecorated(False)
        self._list.setUniformRowHeights(True)
        self._list.setAlternatingRowColors(True)
        # What tells the files of a series apart is mostly a number at the end.
        self._list.setTextElideMode(Qt.TextElideMode.ElideLeft)
        self._list.setSelectionMode(QTreeWidget.SelectionMode.ExtendedSelection)
        self._list.setMinimumHeight(_ROWS_SHOWN * 2 * self.fontMetrics().height())
        self._list.setMinimumWidth(28 * self.fontMetrics().averageCharWidth())
        header = self._list.header()
        header.setStretchLastSection(False)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(2, QHeaderView.ResizeMode.ResizeToContents)
        self._list.itemChanged.connect(self._on_list_item_changed)
        self._list.itemSelectionChanged.connect(self._on_list_item_selection_changed)
        self._take_out = named(
            QPushButton("Take o&ut"),
            "study_take_out",
            tooltip="Take the chosen volumes out of the list again (Delete); their files stay where they are",
        )
        self._take_out.setAutoDefault(False)
        self._take_out.clicked.connect(self._on_take_out_clicked)
        delete = QShortcut(QKeySequence.StandardKey.Delete, self._list)
        delete.setContext(Qt.ShortcutContext.WidgetShortcut)
        delete.activated.connect(self._on_take_out_clicked)
        self._remarks = WrappedText(name="study_volume_remarks")
        self._below = QHBoxLayout()
        self._below.addStretch(1)
        self._below.addWidget(self._take_out)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._list, 1)
        layout.addLayout(self._below)
        layout.addWidget(self._remarks)
        for volume in known.volumes if known is not None else ():
            item = QTreeWidgetItem([volume.id, volume.path, _TWICE if volume.repeats else ""])
            item.setToolTip(1, volume.path)
            self._list.addTopLevelItem(item)
        self._draw()

    @property
    def found(self) -> tuple[FoundVolume, ...]:
        """The new ones, checked or not."""
        return tuple(item.data(0, _FOUND) for item in self._new_items())

    @property
    def paths(self) -> tuple[Path, ...]:
        """Those of the new ones that are to come in."""
        return tuple(item.data(0, _FOUND).path for item in self._checked_items())

    def add_button(self, button: QPushButton) -> None:
        """Put a button below the list, before those that are there."""
        self._below.insertWidget(self._below.count() - 2, button)

    def add(
        self, found: Iterable[FoundVolume], folder: Path, checked: Collection[Path] | None = None
    ) -> tuple[int, int]:
        """Offer more volumes; return how many are new, and how many were there already.

        Parameters
        ----------
        folder : Path
            The study's.
        checked : collection of Path, optional
            Those to check; by default those that can be read.
        """
        known = self._known.volumes if self._known is not None else ()
        there = {(folder / volume.path).resolve() for volume in known}
        there |= {each.path.resolve() for each in self.found}
        added = passed_over = 0
        was_blocked = self._list.blockSignals(True)
        for each in found:
            if each.path.resolve() in there:
                passed_over += 1
                continue
            there.add(each.path.resolve())
            added += 1
            is_below = each.path.is_relative_to(folder)
            shown = each.path.relative_to(folder) if is_below else each.path
            item = QTreeWidgetItem(["", shown.as_posix(), _remark(each)])
            item.setData(0, _FOUND, each)
            is_in = not each.problem if checked is None else each.path in checked
            item.setCheckState(0, Qt.CheckState.Checked if is_in else Qt.CheckState.Unchecked)
            item.setToolTip(0, "Whether it is to be in the study")
            item.setToolTip(1, str(each.path))
            item.setToolTip(2, _sentence(each))
            self._list.addTopLevelItem(item)
            if self._known is not None:
                _embolden(item)
        self._list.blockSignals(was_blocked)
        if self._known is not None and added:
            self._list.scrollToBottom()
        self._draw()
        return added, passed_over

    def show_study(self, study: Study) -> None:
        """Show what the checked ones are called in a study, and which of them come twice."""
        known = len(self._known.volumes) if self._known is not None else 0
        was_blocked = self._list.blockSignals(True)
        for item in self._new_items():
            item.setText(0, "")
        for item, volume in zip(self._checked_items(), study.volumes[known:], strict=True):
            remark = _remark(item.data(0, _FOUND))
            item.setText(0, volume.id)
            item.setText(1, volume.path)
            item.setText(2, ", ".join(filter(None, (remark, _TWICE if volume.repeats else ""))))
        self._list.blockSignals(was_blocked)
        self._list.resizeColumnToContents(0)
        # Ids are mostly what the files are called.
        widest = _ID_LETTERS * self.fontMetrics().averageCharWidth()
        self._list.setColumnWidth(0, min(self._list.columnWidth(0), widest))

    def _new_items(self) -> list[QTreeWidgetItem]:
        rows = range(self._list.topLevelItemCount())
        items = (self._list.topLevelItem(row) for row in rows)
        return [item for item in items if item is not None and item.data(0, _FOUND) is not None]

    def _checked_items(self) -> list[QTreeWidgetItem]:
        return [item for item in self._new_items() if item.checkState(0) == Qt.CheckState.Checked]

    def _chosen_items(self) -> list[QTreeWidgetItem]:
        return [item for item in self._list.selectedItems() if item.data(0, _FOUND) is not None]

    def _draw(self) -> None:
        self._take_out.setEnabled(bool(self._chosen_items()))
        remarks = [said for each in self.found if (said := _sentence(each))]
        more = len(remarks) - _REMARKS_SHOWN
        shown = [*remarks[:_REMARKS_SHOWN], *([f"And {more} more: see the list."] if more > 0 else [])]
        self._remarks.setText("\n".join(shown))
        self._remarks.setVisible(bool(shown))

    @Slot()
    def _on_list_item_changed(self) -> None:
        self.changed.emit()

    @Slot()
    def _on_list_item_selection_changed(self) -> None:
        self._draw()

    @Slot()
    def _on_take_out_clicked(self) -> None:
        chosen = self._chosen_items()
        for item in chosen:
            self._list.takeTopLevelItem(self._list.indexOfTopLevelItem(item))
        if chosen:
            self._draw()
            self.changed.emit()


def _remark(found: FoundVolume) -> str:
    if found.problem:
        return "unreadable"
    return "double" if found.same_as is not None else ""


def _sentence(found: FoundVolume) -> str:
    if found.problem:
        return f"{found.path.name}: {found.problem}. It is left out unless you check it."
    same_as = found.same_as
    return f"{found.path.name} is the same volume as {same_as.name}." if same_as is not None else ""


def _embolden(item: QTreeWidgetItem) -> None:
    font = item.font(0)
    font.setBold(True)
    for column in (0, 1):
        item.setFont(column, font)
