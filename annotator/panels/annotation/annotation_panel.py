"""What is annotated: keypoints or boxes, the switch between them, and what was derived from what."""

from pathlib import PurePosixPath
from typing import get_args

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QPushButton, QToolButton, QVBoxLayout, QWidget

from annotations.documents.record import Method
from annotator.looks.labels import ElidedText, WrappedText
from annotator.looks.naming import named
from annotator.looks.redrawing import keep_painted
from annotator.panels.annotation.boxes_panel import BoxesPanel
from annotator.panels.annotation.keypoints_panel import KeypointsPanel
from annotator.session import Session

_METHODS: tuple[Method, ...] = get_args(Method)


class AnnotationPanel(QWidget):
    """Shows the panel of the open document's method.

    Signals
    -------
    method_requested : str
        A person wants to annotate by another method.
    derive_requested
        A person wants the document of the other method made from this one.
    """

    method_requested = Signal(str)
    derive_requested = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.setObjectName("annotation_panel")
        keep_painted(self)
        self._panels: dict[Method, QWidget] = {
            "keypoints": KeypointsPanel(session),
            "boxes": BoxesPanel(session),
        }
        self._switch = QButtonGroup(self)
        row = QHBoxLayout()
        row.setSpacing(0)
        for method in _METHODS:
            button = named(QToolButton(), f"method_{method}", title=f"Annotate by {method}")
            button.setText(method.title())
            button.setCheckable(True)
            button.setProperty("method", method)
            self._switch.addButton(button)
            row.addWidget(button)
        self._switch.buttonClicked.connect(self._on_switch_button_clicked)
        self._derive = named(QPushButton("Derive…"), "derive")
        self._derive.clicked.connect(self.derive_requested)
        self._try_again = named(QPushButton("Try again"), "try_again")
        self._try_again.setToolTip("Look whether the annotation can be changed by now")
        self._try_again.clicked.connect(session.try_again)
        row.addStretch(1)
        row.addWidget(self._derive)
        row.addWidget(self._try_again)
        self._origin = WrappedText(name="derived_from")
        self._origin.set_color(lambda colors: colors.muted)
        # One line, whose tooltip has the whole: the table needs its height.
        self._read_only = ElidedText(name="read_only_text", mode=Qt.TextElideMode.ElideRight)
        self._read_only.set_color(lambda colors: colors.warning)
        self._flag = WrappedText(name="flag_text")
        self._flag.set_color(lambda colors: colors.warning)
        margin = self.fontMetrics().height() // 3
        head = QVBoxLayout()
        head.setContentsMargins(margin, margin, margin, 0)
        head.addLayout(row)
        head.addWidget(self._origin)
        head.addWidget(self._flag)
        head.addWidget(self._read_only)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(head)
        for panel in self._panels.values():
            layout.addWidget(panel, 1)
        session.document_changed.connect(self._on_session_document_changed)
        session.worklist_changed.connect(self._on_session_worklist_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        session.save_state_changed.connect(self._on_session_save_state_changed)
        self._draw()
        self._draw_read_only()

    @property
    def method(self) -> Method:
        """The method whose panel is shown: the open document's, or that of the documents to come."""
        document = self._session.document
        return document.method if document is not None else self._session.method

    @Slot(object)
    def _on_switch_button_clicked(self, button: QToolButton) -> None:
        self.method_requested.emit(button.property("method"))
        # The other document may take a while to open, or this one refuse to be left.
        self._draw()

    @Slot(object, object)
    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        self._draw()

    @Slot()
    def _on_session_worklist_changed(self) -> None:
        self._draw()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._draw()

    @Slot()
    def _on_session_save_state_changed(self) -> None:
        self._draw_read_only()

    def _draw(self) -> None:
        shown, methods = self.method, self._session.methods
        # Hidden first: with both in sight for a moment the window would have to grow.
        for method in sorted(self._panels, key=lambda method: method == shown):
            self._panels[method].setVisible(method == shown)
        # The dock bears it, and makes room for what is shown now.
        self.setWindowTitle(shown.title())
        for button in self._switch.buttons():
            method = button.property("method")
            button.setChecked(method == shown)
            button.setEnabled(method in methods)
            button.setToolTip(
                f"Annotate by {method}; each method has a file of its own, and both stay"
                if method in methods
                else f"This study is annotated by {' and '.join(methods)} alone"
            )
        self._draw_derivation(shown, methods)
        self._draw_flag()

    def _draw_derivation(self, shown: Method, methods: tuple[Method, ...]) -> None:
        document = self._session.document
        other = next(method for method in _METHODS if method != shown)
        is_placed = document is not None and any(part.anchor_um is not None for part in document.parts)
        self._derive.setEnabled(is_placed and other in methods)
        if other not in methods:
            self._derive.setToolTip(f"This study is annotated by {shown} alone")
        elif not is_placed:
            self._derive.setToolTip(f"Place {shown} first: {other} are derived from them")
        else:
            self._derive.setToolTip(
                f"Make a new, marked annotation by {other} from these {shown}, and open it; this one stays"
            )
        origin = document.derived_from if document is not None else None
        self._origin.setVisible(origin is not None)
        if origin is not None:
            roll = f", roll {origin.roll_deg:z.1f}°" if origin.roll_deg is not None else ""
            is_blind = self._session.is_blind
            source = f"the {origin.method}" if is_blind else PurePosixPath(origin.path).name
            self._origin.setText(f"Derived from {source}{roll}")
            self._origin.setToolTip("" if is_blind else f"From the {origin.method} in {origin.path}")

    def _draw_read_only(self) -> None:
        reason = self._session.read_only_reason
        self._read_only.setVisible(bool(reason))
        self._read_only.setText(f"Read-only. {self._session.neutral(reason)}." if reason else "")
        # In its place: nothing is derived here now.
        self._try_again.setVisible(self._session.may_try_again)
        self._derive.setVisible(not self._session.may_try_again)

    def _draw_flag(self) -> None:
        flag = self._session.document.flag if self._session.document is not None else None
        self._flag.setVisible(flag is not None)
        self._flag.setText(f"Flagged: {flag}" if flag is not None else "")
