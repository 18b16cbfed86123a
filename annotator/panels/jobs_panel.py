"""Long work under way, in the status bar: what it is, how far it is, and how to stop it."""

from PySide6.QtCore import Qt, QTimer, Slot
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QStyle, QToolButton, QWidget

from annotator.looks.labels import ElidedText
from annotator.looks.naming import named
from annotator.looks.progress import ProgressBar
from annotator.looks.redrawing import Redrawing
from annotator.session import Session
from annotator.session.jobs import Job

_STEPS = 1000
# What is done sooner would only flicker, beside the threads that open a study.
_WAIT_MS = 500


class JobsPanel(QWidget):
    """Shows the oldest running job, once it takes its time, and how many wait behind it; else nothing."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._drawn: Job | None = None
        self.setObjectName("jobs_panel")
        self.setAccessibleName("Work in the background")
        self._title = ElidedText(name="jobs_title", mode=Qt.TextElideMode.ElideRight)
        self._title.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)
        self._bar = named(ProgressBar(), "jobs_progress")
        self._bar.setAccessibleName("Progress")
        self._bar.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._bar.setFixedWidth(self.fontMetrics().averageCharWidth() * 18)
        self._cancel = named(QToolButton(), "jobs_cancel")
        self._cancel.setIcon(self.style().standardIcon(QStyle.StandardPixmap.SP_DialogCancelButton))
        self._cancel.setAutoRaise(True)
        self._cancel.clicked.connect(self._on_cancel_clicked)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._title)
        layout.addWidget(self._bar)
        layout.addWidget(self._cancel)
        # Apart from what a job brings: a report's end is told in many places.
        self._redrawing = Redrawing(self._draw, self)
        self._wait = QTimer(self, interval=_WAIT_MS, singleShot=True)
        self._wait.timeout.connect(self._redrawing.ask_apart)
        self.setVisible(False)
        session.jobs.job_changed.connect(self._on_jobs_job_changed)

    @Slot(object)
    def _on_jobs_job_changed(self, job: Job) -> None:
        if not job.shown:
            return
        if not self.isHidden():
            self._redrawing.ask_apart()
        elif not self._session.jobs.shown:
            self._wait.stop()
        elif not self._wait.isActive():
            self._wait.start()

    @Slot()
    def _on_cancel_clicked(self) -> None:
        # The one that stands there: it may have ended meanwhile, and the next is not meant.
        if self._drawn in self._session.jobs.shown:
            self._session.jobs.cancel(self._drawn)
        self._draw()

    def _draw(self) -> None:
        shown = self._session.jobs.shown
        self.setVisible(bool(shown))
        self._drawn = shown[0] if shown else None
        if self._drawn is None:
            return
        job = self._drawn
        more = f" and {len(shown) - 1} more" if len(shown) > 1 else ""
        stopping = job.is_cancelled()
        self._title.setText(f"Stopping: {job.title}" if stopping else f"{job.title}{more}")
        self.setToolTip("\n".join(job.title for job in shown))
        self._bar.show_progress(round((job.progress or 0) * _STEPS), 0 if job.progress is None else _STEPS)
        self._cancel.setToolTip(f"Cancel: {job.title}")
        self._cancel.setAccessibleName(f"Cancel: {job.title}")
        self._cancel.setEnabled(not stopping)
