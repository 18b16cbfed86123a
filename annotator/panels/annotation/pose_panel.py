"""What the geometry says of the open document, live: pose, fit, likely mistakes, lengths and distances."""

from PySide6.QtCore import Slot
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from annotations.documents.annotation import Annotation
from annotations.geometry.tool import ToolSpecification
from annotator.looks.folding import Folding, scrolling_column
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.looks.redrawing import Redrawing
from annotator.panels.annotation.distance_tables import DistanceMatrix, LinkTable
from annotator.panels.annotation.fit_section import FitSection
from annotator.panels.annotation.mistakes_section import MistakesSection
from annotator.panels.annotation.pose_controls import PoseControls
from annotator.panels.annotation.pose_readout import PoseReadout, Reading, pose_readout
from annotator.panels.annotation.refinement_section import RefinementSection
from annotator.panels.widgets.readings_grid import Line, ReadingsGrid
from annotator.session import Session
from annotator.session.viewing.view import View

_NO_SIGN = (
    "Angles are unsigned: a sign needs the hinge axis, which keypoints alone do not give. "
    "Orientation is a direction; roll about the shaft is not in it."
)
_SIGNED = (
    "Signed angles turn about the hinge, the boxes' own +y. "
    "Orientation is a direction; roll about the shaft is not in it, but in the boxes."
)
_ROLL_ONLY = "Orientation is a direction; roll about the shaft is not in it."


class PosePanel(QWidget):
    """The pose targets, the fit of the tool and what can be done with it, in sections that fold away."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._readout: PoseReadout | None = None
        self._tabulated: PoseReadout | None = None
        self.setObjectName("pose_panel")
        self.setAccessibleName("Pose")

        self._nothing = WrappedText("Open a volume to see the pose of its tool.", name="pose_nothing")
        self._targets = ReadingsGrid()
        self._note = WrappedText(name="pose_note")
        self._note.set_color(lambda colors: colors.muted)
        self._copy = named(QPushButton("&Copy as table"), "pose_copy")
        self._copy.setToolTip("Copy pose, lengths and distances as tab-separated text, for a spreadsheet")
        self._copy.clicked.connect(self._on_copy_clicked)
        self._fit = FitSection(session)
        self._mistakes = MistakesSection(session)
        self._controls = PoseControls(session)
        self._refinement = RefinementSection(session)
        self._links = LinkTable()
        self._pairs = DistanceMatrix()

        copy_row = QHBoxLayout()
        copy_row.addWidget(self._copy)
        copy_row.addStretch(1)
        pose = QWidget()
        pose_layout = QVBoxLayout(pose)
        pose_layout.setContentsMargins(8, 0, 0, 4)
        pose_layout.addWidget(self._targets)
        pose_layout.addWidget(self._note)
        pose_layout.addLayout(copy_row)
        self._upper = [
            Folding("Pose", pose, name="pose_unfold", unfolded=True),
            Folding("Check", self._mistakes, name="mistakes_unfold", unfolded=True),
        ]
        self._lower = [
            Folding("Fit of the tool", self._fit, name="fit_unfold", unfolded=True),
            Folding("Pose the tool", self._controls, name="controls_unfold", unfolded=True),
            Folding("Refine", self._refinement, name="refine_unfold", unfolded=True),
            Folding("Links / mm", self._links, name="links_unfold", unfolded=True),
            Folding("Distances / mm", self._pairs, name="distances_unfold", unfolded=False),
        ]
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self._scroll = scrolling_column([self._nothing, *self._upper, *self._lower], "pose_scroll")
        layout.addWidget(self._scroll)

        self._redrawing = Redrawing(self._draw, self)
        self._arrival = Redrawing(self._draw_arrival, self)
        self._arrival_below = Redrawing(self._draw_arrival_below, self)
        self._inputs = Redrawing(self._draw_inputs, self)
        self._wanted: QWidget = self._controls
        self._bringing = Redrawing(self._bring_in_sight, self)
        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._draw()
        self._draw_inputs()

    def copy_to_clipboard(self) -> None:
        """Copy everything as a tab-separated table."""
        self._draw_what_is_owed()
        if self._readout is not None:
            QGuiApplication.clipboard().setText(self._readout.table())
            self._session.post_message("Pose and distances are on the clipboard")

    @Slot()
    def _on_copy_clicked(self) -> None:
        self.copy_to_clipboard()

    @Slot(object, object)
    def _on_session_document_changed(self, before: object, after: object) -> None:
        self._draw_soon()

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.preview != after.preview or before.draft is not after.draft:
            self._draw_soon()
        elif (before.mode, before.pose) != (after.mode, after.pose):
            self._controls.draw()
        if before.mode != "pose" and after.mode == "pose":
            self._bring_in_sight_soon(self._controls)
        if before.refinement is not after.refinement:
            self._refinement.draw()
            if after.refinement is not None:
                # A proposal waits for an answer.
                self._bring_in_sight_soon(self._refinement)

    @Slot()
    def _on_session_volume_changed(self) -> None:
        # After the slices, and before all else: a hand on its fields would go on from what they show.
        self._arrival.ask_apart(first=True)

    def _bring_in_sight_soon(self, content: QWidget) -> None:
        """Scroll to a section once it, and what stands above it, has been drawn and laid out."""
        self._draw_what_is_owed()
        self._wanted = content
        self._bringing.ask()

    def _bring_in_sight(self) -> None:
        """Scroll to a section, and to its title rather than its end."""
        self._inputs.draw_now()
        section = next(section for section in self._lower if section.isAncestorOf(self._wanted))
        self._scroll.ensureWidgetVisible(section, 0, 0)
        bar = self._scroll.verticalScrollBar()
        bar.setValue(min(bar.value(), section.y()))

    def _draw_what_is_owed(self) -> None:
        for redrawing in (self._arrival, self._arrival_below, self._inputs, self._redrawing):
            redrawing.draw_now()

    def _draw_soon(self) -> None:
        """Draw what a hand is on at once, and what is only read once the scene has been drawn."""
        if not self._arrival.is_owed:
            self._inputs.drop()
            self._draw_inputs()
            self._redrawing.ask()

    # What shows at the first volume, and is laid out then, would keep the window from answering all at once.

    def _draw_arrival(self) -> None:
        self._redrawing.drop()
        self._draw_upper()
        if self._readout is None:
            # Nothing is open: there is nothing to be laid out, and nothing old to stand below.
            self._draw_lower()
        else:
            self._arrival_below.ask_apart(first=True)

    def _draw_arrival_below(self) -> None:
        self._draw_lower()
        self._inputs.ask_apart()

    def _draw_inputs(self) -> None:
        if self._session.shown_document is not None and self._session.tool is not None:
            self._controls.draw()
            self._refinement.draw()

    def _draw(self) -> None:
        self._redrawing.drop()
        self._arrival_below.drop()
        self._draw_upper()
        self._draw_lower()

    def _draw_upper(self) -> None:
        tool, document = self._session.tool, self._session.shown_document
        self._nothing.setVisible(document is None)
        for section in self._upper:
            section.setVisible(document is not None)
        if document is None or tool is None:
            self._readout = None
            return
        readout = pose_readout(document, tool)
        if readout != self._readout:
            self._readout = readout
            self._targets.show_lines([_line(reading) for reading in readout.targets])
            self._note.setText(_note(document, tool))
        self._mistakes.draw()

    def _draw_lower(self) -> None:
        readout = self._readout
        for section in self._lower:
            section.setVisible(readout is not None)
        if readout is None:
            return
        self._fit.draw()
        if readout is not self._tabulated:
            self._tabulated = readout
            self._links.show_readout(readout)
            self._pairs.show_readout(readout)


def _line(reading: Reading) -> Line:
    text = "\n".join(reading.texts) or reading.missing
    is_known = not reading.missing
    return Line(f"pose_{reading.name}", reading.title, text, is_known=is_known, doubt=reading.doubt)


def _note(document: Annotation, tool: ToolSpecification) -> str:
    if not tool.targets.angles:
        return _ROLL_ONLY
    return _SIGNED if document.method == "boxes" else _NO_SIGN
