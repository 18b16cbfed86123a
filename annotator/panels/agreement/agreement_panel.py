"""How far apart the annotators are: the table first, then the volumes, the annotators and the plots."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QModelIndex, QSortFilterProxyModel, Qt, QTimer, Signal, Slot
from PySide6.QtGui import QFontMetrics, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QPushButton,
    QTabWidget,
    QTreeView,
    QVBoxLayout,
    QWidget,
)

from annotations.agreement.report.labels import METHODS, STATISTICS, counted, listed, methods_of
from annotations.agreement.results import Agreement
from annotator.looks.folding import scrolling_column
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.looks.redrawing import Redrawing, keep_painted
from annotator.panels.agreement.agreement_plots import AgreementPlots
from annotator.panels.agreement.compared_annotators import ComparedAnnotators
from annotator.panels.agreement.compared_volumes import RANK_COLUMN, WHY_COLUMN, ComparedVolumes
from annotator.panels.agreement.deviation_table import LEGEND, MEANINGS, VARIANTS, DeviationTable
from annotator.panels.widgets.table_model import SORT_ROLE, bold_font
from annotator.session import Session
from annotator.session.viewing.view import View

_INVITATION = "Compares what everybody has annotated here, in micrometres and degrees."
_COMPUTING = "Comparing the annotators…"
_NOT_BY_METHOD = "Nothing was annotated by {} yet"
_LOOKING = "Looking anyway is written into your annotation"
_MISTAKES_NAMED = 3
_WHY_LETTERS = 22
_PADDING_LETTERS = 2


class AgreementPanel(QWidget):
    """Compares the annotators on demand; Enter on a volume opens it with everybody's work over it.

    Signals
    -------
    export_requested
        The button was pressed: the window asks where and what.
    """

    export_requested = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._drawn: Agreement | None = None
        self._listed: object = None
        self._to_show: int | None = None
        self._goes_to_worst = False
        self.setObjectName("agreement_panel")
        self.setAccessibleName("Agreement of the annotators")
        self._state = WrappedText(name="agreement_state")
        self._compute = named(QPushButton(), "agreement_compute")
        self._compute.clicked.connect(self._on_compute_clicked)
        self._export = named(QPushButton("&Export…"), "agreement_export")
        self._export.clicked.connect(self.export_requested)
        self._tabs = named(QTabWidget(), "agreement_tabs", title="Agreement")
        self._tabs.setDocumentMode(True)
        self._tabs.addTab(self._make_figures(), "Figures")
        self._tabs.addTab(self._make_volumes(), "Volumes")
        self._tabs.addTab(self._make_annotators(), "Annotators")
        self._plots = AgreementPlots(session)
        self._tabs.addTab(self._plots, "Plots")
        buttons = QHBoxLayout()
        buttons.addWidget(self._compute)
        buttons.addWidget(self._export)
        buttons.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(*[self.fontMetrics().height() // 3] * 4)
        layout.addLayout(buttons)
        layout.addWidget(self._state)
        layout.addWidget(self._tabs, 1)
        layout.addStretch()
        # Several of them come with each volume, after which the images go first, and with a report's end.
        self._redrawing = Redrawing(self._draw, self)
        session.agreeing.changed.connect(self._follow)
        session.agreement_reporting.changed.connect(self._follow)
        session.others.changed.connect(self._on_others_changed)
        session.seeing.permission_changed.connect(self._follow)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._draw_buttons()
        self._draw()

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.WindowActivate:
            self._session.agreeing.look_for_changes()
        return super().event(event)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._session.agreeing.look_for_changes()
        self._redrawing.draw_now()

    def _make_figures(self) -> QWidget:
        self._statistic = named(QComboBox(), "agreement_statistic", title="Statistic")
        for statistic, title in STATISTICS.items():
            self._statistic.addItem(title, statistic)
            self._statistic.setItemData(
                self._statistic.count() - 1, MEANINGS[statistic], Qt.ItemDataRole.ToolTipRole
            )
        self._variant = named(QComboBox(), "agreement_variant", title="Of what")
        for variant, (title, _) in VARIANTS.items():
            self._variant.addItem(title, variant)
        self._variant.setToolTip("Of which annotations and points the figures are")
        for choice in (self._statistic, self._variant):
            # Its longest entry must not keep the panel wide.
            choice.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            choice.currentIndexChanged.connect(self._on_choice_current_index_changed)
        self._table = DeviationTable()
        self._legend = WrappedText(name="agreement_legend")
        self._mistakes = WrappedText(name="agreement_mistakes")
        self._mistakes.set_color(lambda colors: colors.warning)
        self._counts = WrappedText(name="agreement_counts")
        self._counts.set_color(lambda colors: colors.muted)
        choices = QWidget()
        form = QFormLayout(choices)
        form.setContentsMargins(0, 0, 0, 0)
        form.addRow("&Statistic", self._statistic)
        form.addRow("&Of", self._variant)
        # In a low window the figures scroll, rather than make it taller than its screen.
        return scrolling_column(
            [choices, self._table, self._legend, self._mistakes, self._counts], "agreement_figures"
        )

    def _make_volumes(self) -> QWidget:
        self._volumes = ComparedVolumes(self._session.agreeing.volume_label, self)
        self._sorted = QSortFilterProxyModel(self)
        self._sorted.setSourceModel(self._volumes)
        self._sorted.setSortRole(SORT_ROLE)
        self._list = named(QTreeView(), "agreement_volumes", title="Volumes by deviation")
        self._list.setModel(self._sorted)
        self._list.setRootIsDecorated(False)
        self._list.setUniformRowHeights(True)
        self._list.setAlternatingRowColors(True)
        self._list.setSortingEnabled(True)
        self._list.sortByColumn(RANK_COLUMN, Qt.SortOrder.DescendingOrder)
        self._list.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self._list.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        keep_painted(self._list.viewport())
        self._list.activated.connect(self._on_list_activated)
        self._by = WrappedText(name="agreement_volumes_by")
        self._by.set_color(lambda colors: colors.muted)
        volumes = QWidget()
        layout = QVBoxLayout(volumes)
        layout.setContentsMargins(0, 4, 0, 0)
        layout.addWidget(self._by)
        layout.addWidget(self._list, 1)
        return volumes

    def _make_annotators(self) -> QWidget:
        self._annotators = ComparedAnnotators(self._session)
        self._shown = named(QCheckBox("&Draw over the open volume"), "agreement_overlay")
        self._shown.setToolTip("Everybody else's work on it, each in their colour, and how far all are apart")
        self._shown.clicked.connect(self._on_shown_clicked)
        self._reason = WrappedText(name="agreement_overlay_reason")
        self._look = named(QPushButton("&Look anyway"), "agreement_look", tooltip=_LOOKING)
        self._look.clicked.connect(self._on_look_clicked)
        annotators = QWidget()
        layout = QVBoxLayout(annotators)
        layout.setContentsMargins(0, 4, 0, 0)
        layout.addWidget(self._shown)
        layout.addWidget(self._reason)
        layout.addWidget(self._look, 0, Qt.AlignmentFlag.AlignLeft)
        layout.addWidget(self._annotators, 1)
        return annotators

    @Slot()
    def _on_compute_clicked(self) -> None:
        agreeing = self._session.agreeing
        if agreeing.is_computing:
            agreeing.cancel()
        else:
            agreeing.compute()

    @Slot()
    def _on_shown_clicked(self) -> None:
        self._session.toggle_layer("others")

    @Slot()
    def _on_look_clicked(self) -> None:
        if self._session.seeing.look_anyway():
            self._session.others.want()

    @Slot()
    def _on_choice_current_index_changed(self) -> None:
        self._draw_table()

    @Slot(QModelIndex)
    def _on_list_activated(self, index: QModelIndex) -> None:
        volume = self._volumes.volume(self._sorted.mapToSource(index).row())
        place = self._session.agreeing.index_of(volume)
        self._goes_to_worst = place is not None
        if place is None:
            self._session.post_message(f"{volume} is not among the volumes that are open")
        elif place == self._session.current_index:
            self._show_worst()
        else:
            # Only once it is open: what is open now is not to be shown with them on the way.
            self._to_show = place
            self._session.open_item(place)

    @Slot()
    def _on_session_volume_changed(self) -> None:
        if self._session.volume is not None and self._session.current_index == self._to_show:
            # After every view has drawn the new volume.
            QTimer.singleShot(0, self, self._show_worst)
        else:
            self._goes_to_worst = False
        self._to_show = None
        self._follow()

    @Slot()
    def _on_others_changed(self) -> None:
        self._follow()
        if self._goes_to_worst and self._session.others.shown:
            self._show_worst()

    @Slot()
    def _show_worst(self) -> None:
        """Show everybody over the open volume, and go to where they disagree most once they are there."""
        self._session.others.want()
        worst = self._session.others.worst()
        if worst is not None:
            self._goes_to_worst = False
            self._session.activate(worst, jump=True)

    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.layers != after.layers:
            self._draw_overlay()

    @Slot()
    def _follow(self) -> None:
        # At once what a hand may be on.
        self._draw_buttons()
        self._redrawing.ask_apart()

    def _draw_buttons(self) -> None:
        agreeing = self._session.agreeing
        self._compute.setText("&Cancel" if agreeing.is_computing else "&Compute")
        self._compute.setEnabled(agreeing.is_computing or not agreeing.refusal)
        is_exporting = self._session.agreement_reporting.is_exporting
        may_export = agreeing.result is not None and not agreeing.export_refusal and not is_exporting
        self._export.setEnabled(may_export)
        self._export.setToolTip(agreeing.export_refusal or "Write the report into files")

    def _draw(self) -> None:
        result = self._session.agreeing.result
        self._draw_state()
        self._tabs.setVisible(result is not None or self._session.volume is not None)
        for tab in (0, 1, 3):
            self._tabs.setTabVisible(tab, result is not None)
        if self._drawn is None and result is not None:
            self._tabs.setCurrentIndex(0)
        self._annotators.show_annotators(result, self._session.method)
        self._draw_overlay()
        if result is not self._drawn:
            self._drawn = result
            self._offer_variants()
            self._draw_table()
        self._draw_volumes()

    def _offer_variants(self) -> None:
        """Offer to leave recognised mistakes out only where there are any."""
        has_any = self._drawn is not None and any(
            each.without_mistakes is not None for each in self._drawn.methods.values()
        )
        place = self._variant.findData("without_mistakes")
        if has_any and place < 0:
            self._variant.addItem(VARIANTS["without_mistakes"][0], "without_mistakes")
        elif not has_any and place >= 0:
            self._variant.removeItem(place)

    def _draw_state(self) -> None:
        agreeing = self._session.agreeing
        at = agreeing.computed_at
        is_worth_a_look = False
        if agreeing.refusal:
            text = f"{agreeing.refusal}."
        elif agreeing.is_computing:
            text = _COMPUTING
        elif at is None:
            text = _INVITATION
        else:
            is_worth_a_look = agreeing.is_stale or agreeing.has_changed_files
            edited = ", before your last edit" if agreeing.is_stale else ""
            others = " Annotations have changed since: compute again." if agreeing.has_changed_files else ""
            text = f"Computed at {at:%H:%M}{edited}.{others}"
        self._state.setText(text)
        self._state.set_color((lambda colors: colors.warning) if is_worth_a_look else None)

    def _draw_table(self) -> None:
        if self._drawn is None:
            return
        variant, statistic = self._variant.currentData(), self._statistic.currentData()
        self._statistic.setToolTip(MEANINGS[statistic])
        self._legend.setText(f"{MEANINGS[statistic]}. {LEGEND}")
        mistakes = _mistakes(self._drawn, self._session.agreeing.volume_label)
        self._mistakes.setText(mistakes)
        self._mistakes.setVisible(bool(mistakes))
        self._table.show_result(self._drawn, statistic, variant)
        self._counts.setText(_counts(self._drawn))

    def _draw_volumes(self) -> None:
        result, method = self._drawn, self._session.method
        self._plots.show_result(result, method)
        figures = result.methods.get(method) if result is not None else None
        if (result, method) != self._listed:
            self._listed = (result, method)
            self._volumes.show_volumes(
                figures.volumes if figures is not None else (), result.targets if result else ()
            )
            self._size_columns()
        words = METHODS[method].lower()
        self._by.setText(
            f"{STATISTICS['published']} of each volume, by {words}. Enter or a double click opens it with "
            "everybody over it."
            if figures is not None
            else f"{_NOT_BY_METHOD.format(words)}."
        )
        self._volumes.mark_open(self._session.agreeing.open_volume)

    def _size_columns(self) -> None:
        """Give each column of the list the width of its longest text, without laying out every cell."""
        header, metrics = self._list.header(), QFontMetrics(bold_font())
        letter = metrics.averageCharWidth()
        for column in range(self._volumes.columnCount()):
            width = metrics.horizontalAdvance(self._volumes.widest_text(column)) + _PADDING_LETTERS * letter
            if column == WHY_COLUMN:
                # Its words can be long, and are whole in the tooltip.
                width = _WHY_LETTERS * letter
            header.resizeSection(column, max(width, header.sectionSizeHint(column)))

    def _draw_overlay(self) -> None:
        session = self._session
        allowed = session.seeing.permission
        self._shown.setChecked(session.others.is_wanted)
        self._shown.setEnabled(session.volume is not None)
        reason = session.others.reason or ("" if allowed.may_see else allowed.reason)
        may_look = session.volume is not None and not allowed.may_see and allowed.may_look
        self._reason.setText(f"{reason}. {_LOOKING}." if may_look else f"{reason}." if reason else "")
        self._reason.setVisible(bool(reason) and session.volume is not None)
        self._look.setVisible(may_look)


def _mistakes(result: Agreement, label: Callable[[str], str]) -> str:
    """Name the mistakes that were recognised in the worst volumes, a line for each."""
    found = [
        f"{label(volume.volume)}: {mistake}"
        for method in methods_of(result)
        for volume in sorted(result.methods[method].volumes, key=lambda each: -each.ratio_to_median)
        for mistake in volume.mistakes
    ]
    more = len(found) - _MISTAKES_NAMED
    return "\n".join([*found[:_MISTAKES_NAMED], *([f"and {more} more: see Volumes"] if more > 0 else [])])


def _counts(result: Agreement) -> str:
    """Say what the figures rest on, and what was set aside."""
    parts = []
    for method in methods_of(result):
        counts = result.methods[method].counts
        aside = {
            "not blind": counts.not_blind,
            "begun from predictions": counts.from_prediction,
            "in progress, and compared too": counts.unfinished,
        }
        also = [f"{number} {words}" for words, number in aside.items() if number]
        parts.append(
            f"{METHODS[method]}: {counted(counts.documents, 'annotation')} of "
            f"{counted(counts.volumes, 'volume')}, {counts.volumes_compared} with at least two annotators"
            f"{f' ({listed(also)})' if also else ''}."
        )
    if result.left_out:
        files = sum(each.files for each in result.left_out)
        parts.append(f"{counted(files, 'file')} left out: the report says which and why.")
    return "\n".join(parts)
