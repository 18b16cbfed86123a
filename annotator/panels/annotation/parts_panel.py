"""What the panels of keypoints and of boxes have in common: a table, the active part by numbers, a unit."""

from collections.abc import Sequence
from typing import Any, Generic, TypeVar

from PySide6.QtCore import Slot
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QLabel, QToolButton, QVBoxLayout, QWidget

from annotations.documents.annotation import Annotation, Part
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.looks.redrawing import keep_painted
from annotator.panels.annotation.parts_model import PartsModel
from annotator.panels.annotation.parts_table import PartsTable
from annotator.session import Session

P = TypeVar("P", bound=Part)


class PartsPanel(QWidget, Generic[P]):
    """Choose, type, judge, lock and clear parts; the selected row is the active part.

    A panel of keypoints or of boxes fills it by `_fill`.
    """

    def __init__(self, session: Session, name: str, title: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        keep_painted(self)
        self._session = session
        self.setObjectName(f"{name}_panel")
        self.setAccessibleName(title)
        self._progress = named(QLabel(), f"{name}_progress", title=f"{title} placed")
        self._message = WrappedText(name=f"{name}_message")
        self._message.set_color(lambda colors: colors.error)
        self._message.setVisible(False)
        self._units = QButtonGroup(self)
        self._units.buttonClicked.connect(self._on_units_button_clicked)

    def _fill(
        self, model: PartsModel[P], table: PartsTable, editor: QWidget, units: Sequence[tuple[str, str, str]]
    ) -> None:
        """Lay out the parts; units are their values, what their buttons show, and tooltips."""
        name = self.objectName().removesuffix("_panel")
        header = QHBoxLayout()
        header.addWidget(self._progress, 1)
        for number, (unit, text, tooltip) in enumerate(units):
            button = named(QToolButton(), f"{name}_unit_{unit}", title=tooltip, tooltip=tooltip)
            button.setText(text)
            button.setCheckable(True)
            button.setChecked(number == 0)
            button.setProperty("unit", unit)
            self._units.addButton(button)
            header.addWidget(button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(*[self.fontMetrics().height() // 3] * 4)
        layout.addLayout(header)
        layout.addWidget(table)
        layout.addWidget(self._message)
        layout.addWidget(editor)
        layout.addStretch(1)
        model.not_understood.connect(self._show_message)
        self._session.document_changed.connect(self._on_session_document_changed)
        self._session.volume_changed.connect(self._on_session_volume_changed)
        self._draw_progress()

    def _parts_of(self, document: Annotation) -> tuple[P, ...]:
        """Return the parts that the panel is for."""
        raise NotImplementedError

    def _take_unit(self, unit: Any) -> None:
        """Show and read numbers in another unit."""
        raise NotImplementedError

    @Slot(str)
    def _show_message(self, message: str) -> None:
        self._message.setText(message)
        self._message.setVisible(bool(message))

    @Slot(object)
    def _on_units_button_clicked(self, button: QToolButton) -> None:
        self._take_unit(button.property("unit"))

    @Slot(object, object)
    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        self._show_message("")
        self._draw_progress()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._show_message("")
        self._draw_progress()

    def _draw_progress(self) -> None:
        document = self._session.document
        if document is None:
            self._progress.setText("No volume is open")
        else:
            parts = self._parts_of(document)
            placed = sum(part.anchor_um is not None for part in parts)
            self._progress.setText(f"{placed} of {len(parts)} have a position")
