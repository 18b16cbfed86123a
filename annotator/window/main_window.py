"""The main window: panes, panels, menus and status line, wired to one session; nothing else."""

from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QEvent, Qt, QTimer, Signal, Slot
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QKeyEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QMainWindow, QToolBar, QVBoxLayout, QWidget

from annotations.documents.record import Method
from annotator.actions.action_set import ActionSet
from annotator.actions.state import state_of
from annotator.looks.icons import application_icon
from annotator.looks.redrawing import HeldPainting
from annotator.panels.jobs_panel import JobsPanel
from annotator.scene.scene_view import SceneView
from annotator.session import Session
from annotator.session.jobs import Job
from annotator.session.viewing.view import View
from annotator.settings import Settings
from annotator.slices.fetching import SliceFetcher
from annotator.slices.linked_zoom import link_zoom
from annotator.slices.slice_view import SliceView
from annotator.window.agreement_handlers import AgreementHandlers
from annotator.window.annotate_handlers import AnnotateHandlers
from annotator.window.consensus_handlers import ConsensusHandlers
from annotator.window.display_memory import DisplayMemory
from annotator.window.dock_columns import DockColumns
from annotator.window.docked_panels import DockedPanels
from annotator.window.file_handlers import FileHandlers
from annotator.window.four_up import FourUp
from annotator.window.held_key import HeldKey
from annotator.window.live_handlers import LiveHandlers
from annotator.window.prediction_handlers import PredictionHandlers
from annotator.window.questions import Questions
from annotator.window.review_handlers import ReviewHandlers
from annotator.window.scene_import import SceneImport
from annotator.window.start_page import StartPage
from annotator.window.status_line import StatusLine
from annotator.window.study_handlers import StudyHandlers
from annotator.window.tools_handlers import ToolsHandlers
from annotator.window.typing_guard import TypingGuard
from annotator.window.view_handlers import ViewHandlers
from annotator.window.window_handlers import WindowHandlers

_TITLE = "OCT Annotator"
# As many as a small window has room for; the menu has them all.
_RECENT_ON_START_PAGE = 4


class MainWindow(QMainWindow):
    """Everything that a person sees of one session.

    The session outlives the window: whoever made it shuts it down.

    Parameters
    ----------
    log_path : Path
        The log of unexpected errors, for those who want to look.
    asks : bool
        Whether the session's questions and errors become dialogs; else somebody else answers them.

    Signals
    -------
    scene_prepared
        Mayavi is imported, and the scene shown.

    Attributes
    ----------
    scene, slices, fetcher, four_up, status, questions
        The parts that those who drive the window from outside need.
    actions_by_name : ActionSet
    """

    scene_prepared = Signal()

    def __init__(self, session: Session, settings: Settings, log_path: Path, *, asks: bool = True) -> None:
        super().__init__()
        self.setObjectName("main_window")
        self.setWindowIcon(application_icon())
        self.setAcceptDrops(True)
        self.setDockNestingEnabled(True)
        self.session = session
        self._settings = settings
        self._is_built = False
        self._is_arranged = False
        self._has_left = False
        self._is_closing = False
        self.questions = Questions(session, settings, self, log_path)
        if asks:
            self.questions.start()
        self.fetcher = SliceFetcher(session, self)
        self.scene = SceneView(session, renderer=settings.renderer)
        self.slices = tuple(SliceView(session, axis, self.fetcher) for axis in range(3))
        link_zoom(self.slices)
        self.four_up = FourUp(session, self.scene, self.slices)
        # Before the panels are there to hear of a volume.
        session.volume_changed.connect(self._hold_painting)
        # One or the other is hidden: a stack would raise them over each other, which the scene's window,
        # one of the system's own, does not take well.
        centre = QWidget()
        self._centre = QVBoxLayout(centre)
        self._centre.setContentsMargins(0, 0, 0, 0)
        self._centre.addWidget(self.four_up)
        self.setCentralWidget(centre)
        self._panels = DockedPanels(session, self)
        self._docks = self._panels.docks
        self._columns = DockColumns(self._docks, centre, self._panels.annotation.method, self)
        self.status = StatusLine(session)
        self.status.add(JobsPanel(session))
        self.setStatusBar(self.status)
        self._scene_import = SceneImport(session, self)
        self._actions_timer = QTimer(self, singleShot=True)
        self._actions_timer.timeout.connect(self._draw_actions)
        self._centre_timer = QTimer(self, singleShot=True)
        self._centre_timer.timeout.connect(self._draw_centre)
        self._held_painting = HeldPainting(self)
        self._display_memory = DisplayMemory(session, settings, self)
        self._guard = TypingGuard(self.four_up)
        self._files = FileHandlers(session, settings, self.questions, self)
        self._looks = ViewHandlers(
            session, self.scene, self.slices, self.four_up, HeldKey(Qt.Key.Key_H, self)
        )
        self._parts = WindowHandlers(
            session, settings, self.questions, self, self.four_up, self._docks, log_path
        )
        self._live = LiveHandlers(session, self, self._on_predictions_action_requested)
        annotating = AnnotateHandlers(session, settings, self.questions, lambda: self.four_up.used_axis, self)
        agreement = AgreementHandlers(session, self.questions, self, self._docks["agreement"])
        self.actions_by_name = ActionSet(
            {
                **self._files.by_name(),
                **annotating.by_name(),
                **StudyHandlers(session, settings, self.questions, self, self.open_path).by_name(),
                **agreement.by_name(),
                **ConsensusHandlers(session, self.questions, self, self._docks["consensus"]).by_name(),
                **ToolsHandlers(session).by_name(),
                **PredictionHandlers(session, self, self._panels.worklist).by_name(),
                **self._live.by_name(),
                **ReviewHandlers(session, self.questions, self, self._docks["predictions"]).by_name(),
                **self._looks.by_name(),
                **self._parts.by_name(),
                "copy_pose": self._panels.pose.copy_to_clipboard,
            },
            self,
            self._draw_actions,
        )
        self.actions_by_name.fill_menu_bar(self.menuBar())
        self.actions_by_name.draw_icons(self.palette())
        self._make_tool_bar()
        self._start_page = self._make_start_page()
        self._connect()
        self._parts.restore_layout()
        self._draw_actions()
        self._draw_title()
        self._draw_centre()
        self._is_built = True

    def open_path(self, path: Path) -> None:
        """Open a volume, an annotation, a study or a folder of volumes, and remember it."""
        self._files.open_path(path)

    def open_demo(self) -> None:
        """Open the demo study, which is made first if it is not there."""
        self._files.open_demo()

    def prepare_scene(self, *, after_volume: bool = False) -> None:
        """Load what the fit needs, and Mayavi, beside everything else; show the scene when that is done.

        Parameters
        ----------
        after_volume : bool
            A volume is being opened: begin when it is seen, or after a second if it is not there by then.
        """
        if after_volume:
            self._scene_import.begin_after_volume()
        else:
            self._scene_import.begin()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            # Nobody wanted it: a person wants out of a text field, back to the images.
            self.slices[self.four_up.used_axis].setFocus()
        else:
            super().keyPressEvent(event)

    def setVisible(self, visible: bool) -> None:
        if visible and not self._is_arranged:
            self._columns.stack()
        super().setVisible(visible)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not self._is_arranged:
            # Not before its size is known.
            self._is_arranged = True
            self._columns.arrange()
            self._parts.keep_layout()
            if not self._settings.window_state.isEmpty():
                self.restoreState(self._settings.window_state)
            # Once it is laid out.
            QTimer.singleShot(0, self, self._columns.follow_restored)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self._is_built:
            self._columns.follow()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and self._is_built:
            self.actions_by_name.draw_icons(self.palette())

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if _dropped_path(event) is not None:
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        path = _dropped_path(event)
        if path is not None:
            event.acceptProposedAction()
            self.open_path(path)

    def closeEvent(self, event: QCloseEvent) -> None:
        self._is_closing = True
        if not self._has_left:
            self.questions.leave(self._on_questions_left, "Quit without saving")
        self._is_closing = False
        if not self._has_left:
            event.ignore()
            return
        self._display_memory.write()
        self._columns.show_keypoints()
        self._parts.write_layout()
        self._live.close()
        self._scene_import.stop()
        self.session.close_volume()
        self.fetcher.close()
        self.scene.shut_down()
        event.accept()

    def _make_tool_bar(self) -> None:
        bar = QToolBar("Tools")
        bar.setObjectName("tool_bar")
        bar.setMovable(False)
        bar.toggleViewAction().setVisible(False)
        self.actions_by_name.fill_tool_bar(bar)
        self.addToolBar(bar)

    def _make_start_page(self) -> StartPage:
        actions = self.actions_by_name
        page = StartPage(
            [actions[name] for name in ("open_file", "open_folder", "new_study", "open_demo")],
            [actions[f"recent_{number}"] for number in range(1, _RECENT_ON_START_PAGE + 1)],
        )
        self._centre.addWidget(page)
        return page

    def _connect(self) -> None:
        session = self.session
        for dock in self._docks.values():
            dock.visibilityChanged.connect(self._on_dock_visibility_changed)
        for view in self.slices:
            view.cursor_moved.connect(self.status.show_cursor)
        self._panels.worklist.open_file_requested.connect(self._files.open_file)
        self._panels.worklist.open_folder_requested.connect(self._files.open_folder)
        self._panels.annotation.windowTitleChanged.connect(self._on_annotation_window_title_changed)
        self._panels.annotation.method_requested.connect(self._on_annotation_method_requested)
        self._panels.annotation.derive_requested.connect(self.actions_by_name["derive"].trigger)
        self._panels.agreement.export_requested.connect(self.actions_by_name["export_agreement"].trigger)
        self._panels.predictions.action_requested.connect(self._on_predictions_action_requested)
        self._scene_import.imported.connect(self._on_scene_imported)
        self._scene_import.failed.connect(self.questions.show_error)
        self.scene.started.connect(self._scene_import.complete)
        self.scene.started.connect(self.scene_prepared)
        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        session.worklist_changed.connect(self._on_session_worklist_changed)
        session.save_state_changed.connect(self._on_session_save_state_changed)
        session.undo_stack.index_changed.connect(self._on_undo_stack_index_changed)
        session.jobs.job_changed.connect(self._on_jobs_job_changed)
        session.predicting.checkpoints_changed.connect(self._draw_actions)
        session.predicting.running_changed.connect(self._draw_actions)
        session.predicting.shown_changed.connect(self._draw_actions)
        # Not at once: it comes right after the volume and its list have changed, which draw them, too.
        session.reviewing.changed.connect(self._actions_timer.start)
        session.judging.changed.connect(self._draw_actions)

    def _draw_actions(self) -> None:
        if self.session.more_follows:
            return
        state = state_of(self.session, self._settings.recent_paths)
        also = {"perspective"} if self._looks.perspective else set()
        self.actions_by_name.draw(state, {*also, *self._parts.checked()})

    def _draw_centre(self) -> None:
        opening = [job.title for job in self.session.jobs.shown]
        self._start_page.show_opening(opening[-1] if opening else "")
        if self.session.volume is None and opening:
            # From one volume to the next there is none for a moment: what is shown stays.
            return
        is_open = self.session.volume is not None
        if (self.four_up.isVisibleTo(self), self._start_page.isVisibleTo(self)) == (is_open, not is_open):
            return
        self._start_page.setVisible(not is_open)
        if is_open:
            self._held_painting.show(self.four_up)
        else:
            self.four_up.hide()
        # Keys act at once, instead of landing in the first text field.
        first = self.slices[self.four_up.used_axis] if is_open else self._start_page
        first.setFocus()

    def _hold_painting(self) -> None:
        """Let all hear of another volume in one turn of the event loop, and paint its slices in the next."""
        if self.session.volume is not None:
            self._held_painting.ask()

    def _draw_title(self) -> None:
        label, title = self.session.volume_label, self.session.title
        read_only = " (read-only)" if self.session.read_only_reason else ""
        names = [f"{label}{read_only}[*]"] if label else []
        if title and label and title != label:
            names.append(title)
        self.setWindowTitle(" – ".join([*names, _TITLE]))
        self.setWindowModified(self.session.unsaved)

    def _on_questions_left(self) -> None:
        self._has_left = True
        if not self._is_closing:
            self.close()

    @Slot()
    def _on_scene_imported(self) -> None:
        self.four_up.show_scene()
        # Also while nothing is open: the first volume then need not wait for it.
        self.scene.start_in_turns()

    @Slot(str)
    def _on_annotation_window_title_changed(self, title: str) -> None:
        self._docks["keypoints"].setWindowTitle(title)
        self._columns.change_method(self._panels.annotation.method)

    @Slot(str)
    def _on_annotation_method_requested(self, method: Method) -> None:
        self.actions_by_name[f"method_{method}"].trigger()

    @Slot(str)
    def _on_predictions_action_requested(self, name: str) -> None:
        self.actions_by_name[name].trigger()

    @Slot(object)
    def _on_jobs_job_changed(self, job: Job) -> None:
        # Only the first and the last change something: progress comes many times a second.
        if job.progress is None or job.state != "running":
            # Once for all the jobs that an opening volume ends and begins.
            self._actions_timer.start()
            self._centre_timer.start()

    @Slot(bool)
    def _on_dock_visibility_changed(self, _: bool) -> None:
        # Where the slices get another size for it, what opens or closes is seen first.
        for view in self.slices:
            view.draw_annotation_apart()
        self._draw_actions()

    def _on_undo_stack_index_changed(self) -> None:
        self._draw_actions()

    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        self._draw_actions()

    def _on_session_view_changed(self, before: View, after: View) -> None:
        if replace(before, crosshair_um=after.crosshair_um, window=after.window) != after:
            self._draw_actions()
        if before.mode != "pose" and after.mode == "pose":
            self._columns.uncover_pose()

    def _on_session_volume_changed(self) -> None:
        self._draw_actions()
        self._draw_title()
        # Not at once. The opening of the next one has begun by then, if there is to be one.
        self._centre_timer.start()

    def _on_session_worklist_changed(self) -> None:
        self._draw_actions()
        self._draw_title()

    def _on_session_save_state_changed(self) -> None:
        self._draw_title()
        self._draw_actions()


def _dropped_path(event: QDropEvent) -> Path | None:
    """Return the first local file or folder that is dragged, if there is one."""
    for url in event.mimeData().urls():
        if url.isLocalFile():
            return Path(url.toLocalFile())
    return None
