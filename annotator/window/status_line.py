"""The line at the window's foot: the cursor's place, the mode, the spacing, whether all is saved."""

from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QStatusBar, QStyle, QStyleOption, QWidget

from annotations.geometry.frames import Vector, um_to_voxel
from annotator.looks.labels import ColoredLabel, ElidedText, PickColor
from annotator.looks.laid_out_apart import LaidOutApart
from annotator.session import Session
from annotator.session.editing.click_meaning import is_active_locked
from annotator.session.viewing.view import Mode, Preview, View
from annotator.window.folder_offer import FolderOffer

_MESSAGE_MS = 8000
_LONGEST_NAME_PX = 160
_MARGIN_PX = 6
_SETTLING = "Return keeps {0}, a click from another angle settles its depth, Esc drops it"
_BASE_PROPOSED = (
    "Return or a click on the tip keeps the base of {0}, a click from another angle settles its depth, "
    "Esc drops it"
)
_TIP_PROPOSED = (
    "Return or the next click places {0}, a click from another angle settles the depth of its tip, "
    "Esc drops both ends"
)
_PROPOSED = "Return keeps {0} here, Esc drops it"
_DRAGGED = "Letting go keeps {0} here, Esc drops it"
_DRAFTED = "Letting go keeps it here, Esc takes it back"
_TYPED = "Return keeps it, Esc drops it"
_REFINED = "Return accepts the refined pose, Esc rejects it"
_PLACING = "A click places {0}"
_FIRST_END = "A click places the base of {0}, a second one its tip"
_SECOND_END = "A click places the tip of {0}, Esc gives the base up"
_ADJUSTING = "Handles move, turn and resize the box of {0}; N chooses the next"
_POSING = "Handles move, turn and bend the tool; everything that is placed follows"
_LOCKED = "{0} is locked: unlock it, or choose another"
_MODES: dict[Mode, str] = {"navigate": "Navigating", "place": "Placing", "pose": "Posing"}
_ALL_HIDDEN = "Overlays are hidden"


class StatusLine(QStatusBar):
    """Draws the session's state in a few words; a message takes the place of the hint for some seconds."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("status_line")
        self._session = session
        self._is_spacing_unknown = False
        self._is_message_long = False
        self._line = LaidOutApart()
        self._line.row.setContentsMargins(_MARGIN_PX, 0, 0, 0)
        self.addPermanentWidget(self._line, 1)
        self._hint = ElidedText(name="status_hint", mode=Qt.TextElideMode.ElideRight)
        self._hint.setAccessibleName("What the next click does")
        self._message = ElidedText(name="status_message", mode=Qt.TextElideMode.ElideRight)
        self._message.setAccessibleName("What has been done")
        self._message.hide()
        for label in (self._hint, self._message):
            self._line.row.addWidget(label, 1)
        self._line.row.addWidget(FolderOffer((session.reporting, session.agreement_reporting)))
        self._cursor = self._label("status_cursor", "Position and intensity under the cursor")
        self._spacing = self._label("status_spacing", "Voxel spacing")
        self._mode = self._label("status_mode", "Mode", elided=False)
        self._saved = self._label("status_saved", "Whether the annotation is saved", elided=False)
        self._annotator = self._label("status_annotator", "Who annotates")
        self.messageChanged.connect(self._on_message_changed)
        session.message_posted.connect(self._on_session_message_posted)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        session.document_changed.connect(self._on_session_document_changed)
        session.worklist_changed.connect(self._on_session_worklist_changed)
        session.save_state_changed.connect(self._on_session_save_state_changed)
        self._draw_all()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw what is behind the line; Qt would write a message beside it, which stands in the line."""
        option = QStyleOption()
        option.initFrom(self)
        with QPainter(self) as painter:
            self.style().drawPrimitive(QStyle.PrimitiveElement.PE_PanelStatusBar, option, painter, self)

    def add(self, widget: QWidget) -> None:
        """Put a widget at the end of the line."""
        self._line.row.addWidget(widget)

    def show_cursor(self, position_um: Vector | None, intensity: str) -> None:
        """Show what is under the cursor; None where it is over no slice."""
        spacing_um = self._session.spacing_um
        if position_um is None or spacing_um is None:
            self._cursor.setText("")
            return
        millimetres = ", ".join(f"{value / 1000:.3f}" for value in position_um)
        voxels = ", ".join(f"{value:.0f}" for value in um_to_voxel(position_um, spacing_um))
        self._cursor.setText(f"{millimetres} mm  [{voxels}]  {intensity}")

    def say_spacing_is_unknown(self) -> None:
        """Say that lengths are in voxels for want of a spacing; holds for every volume from now on."""
        self._is_spacing_unknown = True
        self._draw_spacing()

    def _label(self, name: str, accessible_name: str, *, elided: bool = True) -> ColoredLabel:
        # Were all of them whole, they would keep the window from being as narrow as a small screen.
        label = ElidedText(mode=Qt.TextElideMode.ElideRight) if elided else ColoredLabel()
        label.setObjectName(name)
        label.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)
        label.setAccessibleName(accessible_name)
        label.setContentsMargins(6, 0, 6, 0)
        self.add(label)
        return label

    def _draw_all(self) -> None:
        self.show_cursor(None, "")
        self._draw_hint()
        self._draw_mode()
        self._draw_spacing()
        self._draw_saved()
        self._draw_annotator()

    def _draw_hint(self) -> None:
        view = self._session.view
        hint = ""
        if self._session.volume is None:
            hint = ""
        elif self._session.read_only_reason:
            hint = f"{self._session.read_only_reason}."
        elif view.overlays_hidden:
            hint = _ALL_HIDDEN
        elif view.preview is not None and view.preview.ray is not None:
            hint = self._proposed_hint(view.preview)
        elif view.preview is not None and view.preview.source == "dragged":
            hint = _DRAGGED.format(view.preview.keypoint)
        elif view.preview is not None:
            hint = _PROPOSED.format(view.preview.keypoint)
        elif view.refinement is not None:
            hint = _REFINED
        elif view.first_end_um is not None:
            hint = _SECOND_END.format(view.active_part)
        elif view.draft is not None:
            hint = _TYPED if view.draft.is_typed else _DRAFTED
        elif view.mode == "pose":
            hint = _POSING
        elif view.mode == "place" and view.active_part is not None:
            hint = self._placing_hint().format(view.active_part)
        self._hint.setText(hint)

    def _proposed_hint(self, proposed: Preview) -> str:
        document, view = self._session.document, self._session.view
        if document is None or document.method == "keypoints":
            return _SETTLING.format(proposed.keypoint)
        return (_BASE_PROPOSED if view.first_end_um is None else _TIP_PROPOSED).format(view.active_part)

    def _placing_hint(self) -> str:
        if is_active_locked(self._session):
            return _LOCKED
        document = self._session.document
        if document is None or document.method == "keypoints":
            return _PLACING
        return _FIRST_END if self._session.active_box() is None else _ADJUSTING

    def _draw_mode(self) -> None:
        self._mode.setVisible(self._session.volume is not None)
        mode = self._session.view.mode
        self._mode.setToolTip(self._session.read_only_reason)
        if self._session.read_only_reason:
            self._mode.setText("Read-only")
            _paint(self._mode, lambda colors: colors.warning, bold=True)
            return
        self._mode.setText(_MODES[mode])
        changes = mode != "navigate"
        _paint(self._mode, (lambda colors: colors.placing) if changes else None, bold=changes)

    def _draw_spacing(self) -> None:
        spacing_um = self._session.spacing_um
        self._spacing.setVisible(spacing_um is not None and not self._is_message_long)
        if spacing_um is not None:
            numbers = " × ".join(f"{value:.6g}" for value in spacing_um)
            unknown = self._is_spacing_unknown
            self._spacing.setText("Spacing unknown: one unit per voxel" if unknown else f"{numbers} µm")
            _paint(self._spacing, (lambda colors: colors.warning) if unknown else None, bold=unknown)
            self._spacing.setToolTip(f"Voxel spacing along x, y and z, {self._session.spacing_note}")

    def _draw_saved(self) -> None:
        path = self._session.annotation_path
        unsaved = self._session.unsaved
        self._saved.setVisible(path is not None and (unsaved or not self._session.read_only_reason))
        self._saved.setText("Unsaved" if unsaved else "Saved")
        where = f"The annotation is kept in {'its study' if self._session.is_blind else path}"
        self._saved.setToolTip(f"{where}; unsaved edits are in the recovery file" if unsaved else where)
        _paint(self._saved, lambda colors: colors.warning if unsaved else colors.muted)

    def _draw_annotator(self) -> None:
        name = self._session.annotator_name
        shown = self.fontMetrics().elidedText(name, Qt.TextElideMode.ElideRight, _LONGEST_NAME_PX)
        self._annotator.setText(shown)
        self._annotator.setToolTip(
            f"{self._session.person} settles the consensus; the annotators' own documents stay as they are"
            if self._session.settling.is_settling
            else f"{name} annotates; the settings in the menu Edit change who does"
        )
        _paint(self._annotator, lambda colors: colors.muted)

    @Slot(str)
    def _on_message_changed(self, message: str) -> None:
        """Say it in place of the hint; a long one has the room of what can wait until it is gone."""
        self._message.setText(message)
        self._message.setVisible(bool(message))
        self._hint.setVisible(not message)
        is_long = bool(message) and self._message.fontMetrics().horizontalAdvance(message) > self._room_px()
        if is_long != self._is_message_long:
            self._is_message_long = is_long
            self._cursor.setVisible(not is_long)
            self._draw_spacing()

    def _room_px(self) -> int:
        """Return the width that a message has beside all the rest, with the numbers that can wait."""
        numbers, texts = (self._cursor, self._spacing), (self._hint, self._message)
        beside = [
            widget
            for widget in self._line.widgets()
            if widget not in texts and (widget in numbers or not widget.isHidden())
        ]
        taken_px = sum(widget.sizeHint().width() + self._line.row.spacing() for widget in beside)
        return self._line.width() - _MARGIN_PX - taken_px

    def _on_session_message_posted(self, message: str) -> None:
        self.showMessage(message, _MESSAGE_MS)

    def _on_session_view_changed(self, before: View, after: View) -> None:
        if _hinted(before) != _hinted(after):
            begins = after.preview is not None and before.preview is None
            # An older message would hide what to do with a proposal, or go on speaking of one that is gone.
            if begins or (before.refinement is not None and after.refinement is None):
                self.clearMessage()
            self._draw_hint()
            self._draw_mode()

    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        # A lock may have come or gone.
        self._draw_hint()

    def _on_session_worklist_changed(self) -> None:
        self._draw_annotator()

    def _on_session_volume_changed(self) -> None:
        # It was about another document.
        self.clearMessage()
        self._draw_all()

    def _on_session_save_state_changed(self) -> None:
        # It may have become read-only, too.
        self._draw_hint()
        self._draw_mode()
        self._draw_saved()


def _hinted(view: View) -> object:
    """Return what the hint depends on; a draft changes many times in a drag, and is hinted at once."""
    return (
        view.mode,
        view.active_part,
        view.preview,
        view.overlays_hidden,
        view.draft and view.draft.is_typed,
        view.first_end_um is None,
        view.refinement is None,
    )


def _paint(label: ColoredLabel, pick: PickColor | None, *, bold: bool = False) -> None:
    font = label.font()
    font.setBold(bold)
    label.setFont(font)
    label.set_color(pick)
