"""Predictions held against what people say: the errors, the plots, several checkpoints side by side."""

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QSignalBlocker, Signal, Slot
from PySide6.QtGui import QHideEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QCheckBox,
    QComboBox,
    QHBoxLayout,
    QPushButton,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.study import CONSENSUS, folder_name
from annotator.looks.folding import scrolling
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.looks.redrawing import Redrawing
from annotator.session import Session

if TYPE_CHECKING:
    from annotations.prediction.errors.error_table import ErrorTable
    from annotator.panels.predictions.errors_page import ErrorsPage

_NO_CHECKPOINT = "Load a checkpoint, a trained network, to see what it makes of these volumes."
_NO_PREDICTIONS = "This checkpoint has predicted nothing here yet: let it predict the study."
_NONE_JUDGED = "Of what was predicted no errors can be told."
_OTHER_TRUTH = "Whose annotations are the truth can be chosen above."
_NOT_COMPUTED = "The errors have not been computed yet."
_COMPUTING = "Computing the errors…"
_CHANGED = "Predictions or annotations have changed since."
_PREDICTING = "Predicting…"
_USUAL = "Truth: as the study says"
_EXPORT = "Write tables, plots, the worst volumes and the verdicts into files"
_REASONS_NAMED, _FILES_NAMED = 2, 3
_UNREAD = "its prediction cannot be read"
_OWN_VERDICTS = " They are your own: none can be given before that is put right."
_SIDE_BY_SIDE = 2
# As wide as this, in lines of text, the tables stand beside what is chosen: below a window's panes.
_SIDEWAYS_LINES = 56
_CHOICES_LETTERS = 52
_ANY_WIDTH = (1 << 24) - 1


class PredictionsPanel(QWidget):
    """Shows what the checkpoints are worth, and is the way to each volume, the worst first.

    What it shows follows the predictions and annotations by itself as long as the panel is seen.

    Signals
    -------
    action_requested : str
        A button was pressed: the name of its action.
    """

    action_requested = Signal(str)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._errors: ErrorsPage | None = None
        self._page_redrawings: Sequence[Redrawing] = ()
        self.setObjectName("predictions_panel")
        self.setAccessibleName("Predictions")
        self._checkpoint = named(QComboBox(), "predictions_checkpoint", title="Checkpoint in use")
        self._checkpoint.activated.connect(self._on_checkpoint_activated)
        self._truth = named(QComboBox(), "predictions_truth", title="Whose annotations are the truth")
        self._truth.setToolTip("Whose annotations the predictions are held against")
        self._truth.activated.connect(self._on_truth_activated)
        for choice in (self._checkpoint, self._truth):
            # A long name must not keep the panel wide.
            choice.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self._unfinished = named(QCheckBox("&Unfinished too"), "predictions_unfinished")
        self._unfinished.setToolTip("Annotations that are not done count as well")
        self._unfinished.clicked.connect(self._on_truth_activated)
        self._load = self._button("Load…", "load_checkpoint", "Open a trained network")
        self._shipped = self._button(
            "Use the one that ships", "shipped_checkpoint", "Open the checkpoint that comes with the program"
        )
        self._predict = named(QPushButton(), "predictions_predict_study")
        self._predict.setToolTip("Predict the volumes that have no prediction of this checkpoint yet")
        self._predict.clicked.connect(self._on_predict_clicked)
        self._compute = named(QPushButton(), "predictions_compute_errors")
        self._compute.setToolTip("Read all predictions and annotations again")
        self._compute.clicked.connect(self._on_compute_clicked)
        self._export = self._button("&Export…", "export_errors", _EXPORT)
        self._state = WrappedText(name="predictions_state")
        self._tabs = named(QTabWidget(), "predictions_tabs", title="Errors")
        self._tabs.setDocumentMode(True)
        self._choices = QWidget()
        self._layout = QBoxLayout(QBoxLayout.Direction.TopToBottom, self)
        self._lay_out()
        # Several of them come with each volume, after which the images go first.
        self._redrawing = Redrawing(self._draw, self)
        self._making_others = Redrawing(self._make_other_pages, self)
        session.judging.changed.connect(self._redrawing.ask_apart)
        # It changes with each change of the review, too.
        session.reporting.changed.connect(self._redrawing.ask_apart)
        session.predicting.running_changed.connect(self._redrawing.ask_apart)
        session.predicting.checkpoints_changed.connect(self._redrawing.ask_apart)
        session.predicting.truth_changed.connect(self._redrawing.ask_apart)
        self._draw()

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.WindowActivate and self.isVisible():
            self._session.reviewing.look_for_changes()
        return super().event(event)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._session.reviewing.follow(True)
        self._session.reviewing.look_for_changes()
        self._redrawing.drop()
        self._draw()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._session.reviewing.follow(False)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        metrics = self.fontMetrics()
        is_sideways = self.width() >= _SIDEWAYS_LINES * metrics.height()
        ways = QBoxLayout.Direction
        self._layout.setDirection(ways.LeftToRight if is_sideways else ways.TopToBottom)
        widest = _CHOICES_LETTERS * metrics.averageCharWidth()
        self._choices.setMaximumWidth(widest if is_sideways else _ANY_WIDTH)

    def _button(self, text: str, action: str, tooltip: str) -> QPushButton:
        button = named(QPushButton(text), f"predictions_{action}", tooltip=tooltip)
        button.clicked.connect(lambda: self.action_requested.emit(action))
        return button

    def _lay_out(self) -> None:
        checkpoint = QHBoxLayout()
        checkpoint.addWidget(self._checkpoint, 1)
        checkpoint.addWidget(self._shipped)
        checkpoint.addWidget(self._load)
        truth = QHBoxLayout()
        truth.addWidget(self._truth, 1)
        truth.addWidget(self._unfinished)
        buttons = QHBoxLayout()
        for button in (self._predict, self._compute, self._export):
            buttons.addWidget(button)
        buttons.addStretch(1)
        choices = QVBoxLayout(self._choices)
        choices.setContentsMargins(0, 0, 0, 0)
        choices.addLayout(checkpoint)
        choices.addLayout(truth)
        choices.addLayout(buttons)
        choices.addWidget(self._state)
        choices.addStretch()
        layout = self._layout
        layout.setContentsMargins(*[self.fontMetrics().height() // 3] * 4)
        layout.addWidget(self._choices)
        layout.addWidget(self._tabs, 1)
        layout.addStretch()

    def _make_errors(self) -> "ErrorsPage":
        # Late: what it is made of is there once errors were computed, and few sessions compute any.
        from annotator.panels.predictions.errors_page import ErrorsPage

        errors = ErrorsPage(self._session)
        self._add_page(errors, "Errors")
        # In its order a reviewer walks: it is right as soon as there are errors.
        self._session.reviewing.changed.connect(errors.draw)
        errors.draw()
        return errors

    def _make_other_pages(self) -> None:
        from annotator.panels.predictions.error_plots_page import ErrorPlotsPage  # late: as above
        from annotator.panels.predictions.paired_page import PairedPage

        plots, paired = ErrorPlotsPage(self._session), PairedPage(self._session)
        self._add_page(plots, "Plots")
        self._add_page(paired, "Side by side")
        self._page_redrawings = [Redrawing(page.draw, page) for page in (plots, paired)]
        self._draw_pages()

    def _add_page(self, page: QWidget, title: str) -> None:
        # In a low window they scroll, rather than make it taller than its screen.
        self._tabs.addTab(scrolling(page, f"{page.objectName()}_scroll"), title)

    @Slot(int)
    def _on_checkpoint_activated(self, _: int) -> None:
        self._session.predicting.choose(self._checkpoint.currentData())

    @Slot()
    def _on_truth_activated(self) -> None:
        from annotations.prediction.errors.study_errors import (
            Truth,  # late: it is there once there is a checkpoint
        )

        predicting = self._session.predicting
        predicting.choose_truth(
            Truth(predicting.truth.method, self._truth.currentData(), self._unfinished.isChecked())
        )

    @Slot()
    def _on_predict_clicked(self) -> None:
        if self._session.predicting.is_predicting:
            self._session.predicting.cancel()
        else:
            self.action_requested.emit("predict_study")

    @Slot()
    def _on_compute_clicked(self) -> None:
        if self._session.reviewing.is_computing:
            self._session.reviewing.cancel()
        else:
            self.action_requested.emit("compute_errors")

    @Slot()
    def _draw(self) -> None:
        reviewing, predicting = self._session.reviewing, self._session.predicting
        has_checkpoint, study = bool(predicting.checkpoints), self._session.worklist.study
        self._checkpoint.setVisible(has_checkpoint)
        self._shipped.setVisible(not has_checkpoint and predicting.shipped_path is not None)
        for each in (self._truth, self._unfinished, self._predict, self._compute, self._export):
            each.setVisible(has_checkpoint and study is not None)
        if has_checkpoint:
            self._draw_choices()
        self._predict.setText("&Cancel" if predicting.is_predicting else "&Predict the study")
        self._compute.setText("&Cancel" if reviewing.is_computing else "&Compute")
        self._compute.setEnabled(reviewing.may_compute)
        refusal = self._session.reporting.refusal
        self._export.setEnabled(not refusal and not self._session.reporting.is_exporting)
        self._export.setToolTip(refusal or _EXPORT)
        self._state.setText(self._words())
        self._state.setToolTip(self._details())
        self._state.set_color((lambda colors: colors.warning) if reviewing.is_stale else None)
        self._draw_pages()

    def _draw_choices(self) -> None:
        predicting, study = self._session.predicting, self._session.worklist.study
        # Late: it is there once there is a checkpoint.
        from annotations.prediction.report.checkpoint_names import told_apart

        current = predicting.current
        shas = [each.sha256 for each in predicting.checkpoints]
        names = told_apart([(each.description.name, each.sha256) for each in predicting.checkpoints])
        _offer(
            self._checkpoint,
            list(zip(names, shas, strict=True)),
            current.sha256 if current is not None else None,
        )
        people = (CONSENSUS, *study.annotators) if study is not None else ()
        _offer(
            self._truth,
            [(_USUAL, None), *((f"Truth: {name}", name) for name in people)],
            predicting.truth.annotator,
        )
        self._unfinished.setChecked(predicting.truth.unfinished)

    def _draw_pages(self) -> None:
        reviewing = self._session.reviewing
        has_rows = reviewing.table is not None and bool(reviewing.table.rows)
        if has_rows and self._errors is None:
            self._errors = self._make_errors()
            # All of them together would keep the window from answering.
            self._making_others.ask_apart()
        self._tabs.setVisible(has_rows)
        if self._page_redrawings:
            is_paired = reviewing.review is not None and reviewing.review.is_paired
            self._tabs.setTabVisible(_SIDE_BY_SIDE, is_paired)
            for redrawing in self._page_redrawings:
                redrawing.ask_apart()

    def _words(self) -> str:
        """Say what is shown, or what is to be done that anything is."""
        reviewing, predicting = self._session.reviewing, self._session.predicting
        current, review, table = predicting.current, reviewing.review, reviewing.table
        if current is None:
            return _NO_CHECKPOINT
        if reason := predicting.tool_unfitness(current) or reviewing.refusal:
            return f"{_sentence(reason)}."
        if reviewing.is_computing and table is None:
            return _COMPUTING
        if table is None or review is None:
            return _PREDICTING if predicting.is_predicting else _NOT_COMPUTED
        if not table.rows and predicting.is_predicting:
            return _PREDICTING
        unfitness, left_out = predicting.unfitness(current), _left_out(table)
        if not table.rows and not table.unjudged:
            return f"{_sentence(unfitness)}." if unfitness else _NO_PREDICTIONS
        if not table.rows:
            return f"{_NONE_JUDGED} {left_out} {_OTHER_TRUTH}"
        doing = _COMPUTING if reviewing.is_computing else _CHANGED if reviewing.is_stale else ""
        told = (f"Computed at {review.at:%H:%M}.", doing, left_out, unfitness and f"{_sentence(unfitness)}.")
        # Of verdicts that cannot be read: whose, which file, and what to do.
        short = [_without_folders(remark, review.folder) for remark in review.material.remarks]
        own = f": {folder_name(self._session.person)}.json"
        remarks = (f"{_sentence(remark)}.{_OWN_VERDICTS if own in remark else ''}" for remark in short)
        return self._session.neutral(" ".join(filter(None, (*told, *remarks))))

    def _details(self) -> str:
        """Return the whole of what is said in short: which files cannot be read, where they are, and why."""
        review, table = self._session.reviewing.review, self._session.reviewing.table
        if review is None or table is None:
            return ""
        unread = (each.reason for each in table.unjudged if each.reason.startswith(_UNREAD))
        return self._session.neutral("\n".join(map(_sentence, (*unread, *review.material.remarks))))


def _offer(choice: QComboBox, entries: Sequence[tuple[str, str | None]], chosen: str | None) -> None:
    """Offer texts and what they stand for, and choose one; nothing happens where they are offered already."""
    offered = [(choice.itemText(place), choice.itemData(place)) for place in range(choice.count())]
    with QSignalBlocker(choice):
        if offered != list(entries):
            choice.clear()
            for text, data in entries:
                choice.addItem(text, data)
        choice.setCurrentIndex(next((at for at, (_, data) in enumerate(entries) if data == chosen), -1))
    choice.setToolTip(choice.currentText())


def _sentence(reason: str) -> str:
    return reason[:1].upper() + reason[1:]


def _without_folders(text: str, folder: Path) -> str:
    """Return a text in which files of a folder have their names alone."""
    return re.sub(rf"{re.escape(str(folder))}[/\\](?:[^:,\n/\\]+[/\\])*", "", text)


def _left_out(table: "ErrorTable") -> str:
    """Say how many predictions are held against nothing, and why, for each reason once."""
    reasons = Counter(each.reason for each in table.unjudged if not each.reason.startswith(_UNREAD))
    words = [f"{count} ({reason})" for reason, count in reasons.most_common(_REASONS_NAMED)]
    words += ["…"] if len(reasons) > _REASONS_NAMED else []
    # Each has a reason of its own, which the tooltip says.
    unread = [f"{each.volume}.json" for each in table.unjudged if each.reason.startswith(_UNREAD)]
    if unread:
        files = ", ".join((*unread[:_FILES_NAMED], *(("…",) if len(unread) > _FILES_NAMED else ())))
        words.append(f"{len(unread)} ({_UNREAD}, move it away and predict again: {files})")
    return f"Left out: {'; '.join(words)}." if words else ""
