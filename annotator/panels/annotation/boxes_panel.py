"""The table of boxes, and the active one by numbers."""

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QFrame, QScrollArea, QWidget

from annotations.documents.annotation import Annotation, BoxAnnotation
from annotator.looks.typed_numbers import SizeUnit
from annotator.panels.annotation.box_editor import BoxEditor
from annotator.panels.annotation.boxes_model import BoxesModel, Column
from annotator.panels.annotation.parts_panel import PartsPanel
from annotator.panels.annotation.parts_table import PartsTable
from annotator.session import Session

_UNITS = (
    ("um", "µm", "Show and type sizes in the table in micrometres"),
    ("mm", "mm", "Show and type sizes in the table in millimetres"),
)

# The widest that a column shows, and the words that are its heading.
_SAMPLES: dict[int, tuple[str, ...]] = {
    Column.LINK: ("link0",),
    Column.LENGTH: ("00000", "Length"),
    Column.WIDTH: ("00000", "Width"),
    Column.HEIGHT: ("00000", "Height"),
    Column.RESIDUAL: ("0000", "Δ"),
}
# As many as the tools that ship have links.
_ROWS_IN_SIGHT = 3


class EditorArea(QScrollArea):
    """Scrolls upwards and downwards alone: it is never narrower than what is in it."""

    def __init__(self, editor: BoxEditor) -> None:
        super().__init__()
        self._editor = editor
        self.setObjectName("boxes_scroll")
        # What is in it comes into sight as the tab key goes through it.
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setWidgetResizable(True)
        self.setWidget(editor)

    def sizeHint(self) -> QSize:
        return self._editor.sizeHint().expandedTo(self.minimumSizeHint())

    def minimumSizeHint(self) -> QSize:
        bar = self.verticalScrollBar().sizeHint().width()
        return QSize(self._editor.minimumSizeHint().width() + bar, super().minimumSizeHint().height())


class BoxesPanel(PartsPanel[BoxAnnotation]):
    """Choose, type, judge, lock and clear boxes; the selected row is the active link."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, "boxes", "Boxes", parent)
        self._model = BoxesModel(session, self)
        editor = BoxEditor(session)
        editor.refused.connect(self._show_message)
        table = PartsTable(
            session,
            self._model,
            _SAMPLES,
            name="boxes_table",
            title="Boxes",
            rows_in_sight=_ROWS_IN_SIGHT,
        )
        self._fill(self._model, table, EditorArea(editor), _UNITS)

    def _parts_of(self, document: Annotation) -> tuple[BoxAnnotation, ...]:
        return document.boxes

    def _take_unit(self, unit: SizeUnit) -> None:
        self._model.set_unit(unit)
