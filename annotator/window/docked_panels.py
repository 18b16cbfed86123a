"""The panels of a session, docked beside the views of a window."""

from collections.abc import Mapping

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDockWidget, QMainWindow, QWidget

from annotator.panels.agreement.agreement_panel import AgreementPanel
from annotator.panels.agreement.consensus_panel import ConsensusPanel
from annotator.panels.annotation.annotation_panel import AnnotationPanel
from annotator.panels.annotation.pose_panel import PosePanel
from annotator.panels.display.display_panel import DisplayPanel
from annotator.panels.predictions.predictions_panel import PredictionsPanel
from annotator.panels.worklist.worklist_panel import WorklistPanel
from annotator.session import Session
from annotator.window.panel_dock import PanelDock

_LEFT, _RIGHT = Qt.DockWidgetArea.LeftDockWidgetArea, Qt.DockWidgetArea.RightDockWidgetArea


class DockedPanels:
    """Makes the panels, and a dock for each, where they stand in a new window.

    Attributes
    ----------
    worklist, annotation, pose, agreement, predictions
        The panels that ask the window for something.
    docks : mapping of str to QDockWidget
        By the names of their actions.
    """

    def __init__(self, session: Session, window: QMainWindow) -> None:
        self._window = window
        self.worklist = WorklistPanel(session)
        self.annotation = AnnotationPanel(session)
        self.pose = PosePanel(session)
        self.agreement = AgreementPanel(session)
        self.predictions = PredictionsPanel(session)
        display = DisplayPanel(session)
        self.docks: Mapping[str, QDockWidget] = {
            "worklist": self._dock("worklist", "Volumes", self.worklist, _LEFT),
            "keypoints": self._dock("keypoints", self.annotation.windowTitle(), self.annotation, _RIGHT),
            "pose": self._dock("pose", "Pose", self.pose, _RIGHT),
            "display": self._dock("display", "Display", display, _RIGHT),
            "agreement": self._dock("agreement", "Agreement", self.agreement, _RIGHT),
            "consensus": self._dock("consensus", "Consensus", ConsensusPanel(session), _RIGHT),
            "predictions": self._dock("predictions", "Predictions", self.predictions, _RIGHT),
        }
        window.tabifyDockWidget(self.docks["pose"], self.docks["display"])
        window.tabifyDockWidget(self.docks["display"], self.docks["agreement"])
        window.tabifyDockWidget(self.docks["agreement"], self.docks["consensus"])
        window.tabifyDockWidget(self.docks["consensus"], self.docks["predictions"])
        # Behind another tab Qt calls it visible.
        self.docks["display"].visibilityChanged.connect(display.follow)
        # Most people annotate: those who compare, settle and review ask for them.
        for name in ("agreement", "consensus", "predictions"):
            self.docks[name].hide()
        self.docks["pose"].raise_()

    def _dock(self, name: str, title: str, panel: QWidget, area: Qt.DockWidgetArea) -> QDockWidget:
        dock = PanelDock(title)
        dock.setObjectName(f"dock_{name}")
        dock.setWidget(panel)
        self._window.addDockWidget(area, dock)
        return dock
