"""How cells of the tables of parts are edited: a list of states, numbers as text, a cross to clear."""

from typing import Any

from PySide6.QtCore import QAbstractItemModel, QEvent, QObject, QPoint, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QPainter, QPen
from PySide6.QtWidgets import (
    QAbstractItemDelegate,
    QComboBox,
    QLineEdit,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QToolTip,
    QWidget,
)

from annotator.panels.annotation.parts_model import SHORT_STATES, STATES, PartsModel
from annotator.panels.widgets.quiet_inputs import QuietComboBox
from annotator.panels.widgets.table_model import Index

_KEEPING_KEYS = (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Tab, Qt.Key.Key_Backtab)


class NameDelegate(QStyledItemDelegate):
    """Shows a part's name with its label, or the name alone where there is no room for both."""

    def initStyleOption(self, option: QStyleOptionViewItem, index: Index) -> None:
        super().initStyleOption(option, index)
        taken = option.decorationSize.width() + option.fontMetrics.height()
        if option.fontMetrics.horizontalAdvance(option.text) > option.rect.width() - taken:
            option.text = index.data(Qt.ItemDataRole.EditRole)


class StateBox(QuietComboBox):
    """A list of states that tells when it has closed, whatever closed it.

    Signals
    -------
    popup_closed

    Attributes
    ----------
    is_done : bool
        Whether the editing has ended: Qt complains of an editor that is closed twice.
    """

    popup_closed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.is_done = False

    def hidePopup(self) -> None:
        super().hidePopup()
        self.popup_closed.emit()


class StateDelegate(QStyledItemDelegate):
    """Chooses a part's state from a list that opens at once; the choice is kept when it is made."""

    def initStyleOption(self, option: QStyleOptionViewItem, index: Index) -> None:
        super().initStyleOption(option, index)
        margins = option.fontMetrics.height() // 2
        if option.fontMetrics.horizontalAdvance(option.text) > option.rect.width() - margins:
            option.text = SHORT_STATES.get(option.text, option.text)

    def createEditor(self, parent: QWidget, option: QStyleOptionViewItem, index: Index) -> QComboBox:
        editor = StateBox(parent)
        editor.setObjectName("state_editor")
        editor.setAccessibleName("State")
        for state in STATES:
            editor.addItem(state.replace("_", " "), state)
        editor.activated.connect(lambda: self._keep(editor))
        # A choice is announced only after the list has closed; without one the box would stay behind.
        editor.popup_closed.connect(lambda: QTimer.singleShot(0, editor, lambda: self._close(editor)))
        return editor

    def setEditorData(self, editor: QWidget, index: Index) -> None:
        if isinstance(editor, QComboBox):
            editor.setCurrentIndex(editor.findData(index.data(Qt.ItemDataRole.EditRole)))
            editor.showPopup()

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: Index) -> None:
        if isinstance(editor, QComboBox):
            model.setData(index, editor.currentData())

    def _keep(self, editor: StateBox) -> None:
        self.commitData.emit(editor)
        self._close(editor)

    def _close(self, editor: StateBox) -> None:
        if not editor.is_done:
            editor.is_done = True
            self.closeEditor.emit(editor, QAbstractItemDelegate.EndEditHint.NoHint)


class NumberDelegate(QStyledItemDelegate):
    """Edits a number as text. Wrong text is explained and stays open; Esc gives it up."""

    def __init__(self, model: PartsModel[Any], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._model = model

    def createEditor(self, parent: QWidget, option: QStyleOptionViewItem, index: Index) -> QLineEdit:
        editor = QLineEdit(parent)
        editor.setObjectName("number_editor")
        title = self._model.headerData(
            index.column(), Qt.Orientation.Horizontal, Qt.ItemDataRole.AccessibleTextRole
        )
        editor.setAccessibleName(f"{self._model.name(index.row())}: {title}")
        editor.setAlignment(Qt.AlignmentFlag.AlignRight)
        editor.setProperty("row", index.row())
        editor.setProperty("column", index.column())
        return editor

    def setEditorData(self, editor: QWidget, index: Index) -> None:
        if isinstance(editor, QLineEdit) and not editor.isModified():
            editor.setText(index.data(Qt.ItemDataRole.EditRole))
            editor.selectAll()

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: Index) -> None:
        if isinstance(editor, QLineEdit):
            model.setData(index, editor.text())

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if (
            isinstance(watched, QLineEdit)
            and isinstance(event, QKeyEvent)
            and event.type() == QEvent.Type.KeyPress
            and event.key() in _KEEPING_KEYS
        ):
            refusal = self._model.refusal(watched.property("row"), watched.property("column"), watched.text())
            if refusal:
                QToolTip.showText(watched.mapToGlobal(QPoint(0, watched.height())), refusal, watched)
                self._model.not_understood.emit(f"{refusal}. Nothing was changed yet.")
                watched.selectAll()
                return True
        return super().eventFilter(watched, event)


class ClearDelegate(QStyledItemDelegate):
    """Draws a small cross, faint where there is nothing to clear; the table answers the click."""

    def __init__(self, state_column: int, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._state_column = state_column

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Any) -> None:
        super().paint(painter, option, index)
        state = index.siblingAtColumn(self._state_column)
        placed = state.data(Qt.ItemDataRole.EditRole) != "unplaced"
        clearable = placed and bool(state.flags() & Qt.ItemFlag.ItemIsEditable)
        group = option.palette.ColorGroup.Active if clearable else option.palette.ColorGroup.Disabled
        selected = bool(option.state & QStyle.StateFlag.State_Selected)
        role = option.palette.ColorRole.HighlightedText if selected else option.palette.ColorRole.Text
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        pen = QPen(option.palette.color(group, role), 1.6)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        painter.setPen(pen)
        arm = max(option.fontMetrics.height() // 4, 3)
        center = option.rect.center()
        painter.drawLine(center + QPoint(-arm, -arm), center + QPoint(arm, arm))
        painter.drawLine(center + QPoint(-arm, arm), center + QPoint(arm, -arm))
        painter.restore()
