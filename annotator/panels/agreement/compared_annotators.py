"""The annotators of the open volume and of the comparison: who is drawn, in which colour, and their bias."""

from collections.abc import Iterator, Mapping

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTreeWidget, QTreeWidgetItem, QWidget

from annotations.agreement.report.labels import NOTHING, duration, label_of, number, signed_number, unit_of
from annotations.agreement.results import Agreement, AnnotatorResult, Estimate
from annotations.documents.record import Method
from annotator.looks.annotator_marks import annotator_swatch
from annotator.session import Session

_NO_BIAS = "none to be seen"
_NOT_HERE = "Has no annotation of the open volume by this method, or it is not shown"
_SHOWN = "Ticked: drawn over the open volume"
_HEADERS = (
    "Who is drawn in which colour and form, here, in the volume and in the report",
    "Leave-one-out deviation: mean distance from the mean of the others",
    "Signed mean difference from the mean of the others, where its interval does not hold zero",
    "Annotations that the figures are of",
    "Mean time at work on a volume",
)
_NAME_ROLE = Qt.ItemDataRole.UserRole


class ComparedAnnotators(QTreeWidget):
    """A row for each annotator; the tick shows and hides what they placed in the open volume."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._rows: list[QTreeWidgetItem] = []
        self._rows_for: object = None
        self.setObjectName("compared_annotators")
        self.setAccessibleName("Annotators")
        self.setRootIsDecorated(False)
        self.setUniformRowHeights(True)
        self.setAlternatingRowColors(True)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.header().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.itemChanged.connect(self._on_item_changed)

    def show_annotators(self, result: Agreement | None, method: Method) -> None:
        """List the annotators of a result, and those whose annotations are drawn."""
        others = self._session.others.shown
        figures = result.methods.get(method) if result is not None else None
        compared = {each.annotator: each for each in figures.annotators} if figures is not None else {}
        numbers = {other.annotator: other.number for other in others}
        if result is not None:
            numbers |= {name: number for number, name in enumerate(result.annotators) if name in compared}
        self.blockSignals(True)
        # A tick comes from a row that must not be taken away on the way: rows are made for other people only.
        if (result, method, numbers) != self._rows_for:
            self._rows_for = (result, method, numbers)
            self._make_rows(compared, numbers, result.targets[0] if result and result.targets else None)
        self._draw_ticks({other.annotator: other.visible for other in others})
        self.blockSignals(False)

    def _make_rows(
        self, compared: Mapping[str, AnnotatorResult], numbers: Mapping[str, int], target: str | None
    ) -> None:
        self.clear()
        self._rows = []
        unit = f" / {unit_of(target)}" if target is not None else ""
        self.setHeaderLabels(
            ["Annotator", *([f"From the others{unit}", "Bias", "Volumes", "Time"] if compared else [])]
        )
        for column, words in enumerate(_HEADERS):
            self.headerItem().setToolTip(column, words)
        self.setColumnCount(5 if compared else 1)
        for name, number_of_all in sorted(numbers.items(), key=lambda each: each[1]):
            row = QTreeWidgetItem([name, *(_cells(compared[name], target) if name in compared else ())])
            row.setData(0, _NAME_ROLE, name)
            row.setIcon(0, annotator_swatch(number_of_all))
            if name in compared:
                row.setTextAlignment(1, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                row.setToolTip(1, "Leave-one-out deviation: mean distance from the mean of the others")
                row.setToolTip(2, _biases_in_full(compared[name]))
            self._rows.append(row)
        self.addTopLevelItems(self._rows)

    def _draw_ticks(self, visible: Mapping[str, bool]) -> None:
        """Tick those that are drawn; who has nothing to be drawn has no box to be ticked."""
        for row in self._rows:
            name = row.data(0, _NAME_ROLE)
            ticked = Qt.CheckState.Checked if visible.get(name) else Qt.CheckState.Unchecked
            row.setData(0, Qt.ItemDataRole.CheckStateRole, ticked if name in visible else None)
            row.setToolTip(0, _SHOWN if name in visible else _NOT_HERE)

    @Slot(QTreeWidgetItem, int)
    def _on_item_changed(self, item: QTreeWidgetItem, _column: int) -> None:
        checked = item.checkState(0) == Qt.CheckState.Checked
        self._session.others.set_visible(item.data(0, _NAME_ROLE), checked)


def _cells(annotator: AnnotatorResult, target: str | None) -> tuple[str, ...]:
    deviation = annotator.deviation.get(target, Estimate()) if target is not None else Estimate()
    biases = [
        f"{label_of(name)} {signed_number(bias.mean, unit_of(name))} {unit_of(name)}"
        for name, bias in _seen_biases(annotator)
    ]
    return (
        number(deviation.mean, unit_of(target)) if target is not None else NOTHING,
        ", ".join(biases) or _NO_BIAS,
        str(annotator.documents),
        duration(annotator.active_seconds.mean),
    )


def _seen_biases(annotator: AnnotatorResult) -> Iterator[tuple[str, Estimate]]:
    """Yield the components whose interval does not hold zero."""
    for name, bias in annotator.bias.items():
        if bias.ci95 is not None and bias.ci95[0] * bias.ci95[1] > 0:
            yield name, bias


def _biases_in_full(annotator: AnnotatorResult) -> str:
    rows = [
        f"{label_of(name)}: {signed_number(bias.mean, unit_of(name))} {unit_of(name)}"
        f" [{signed_number(bias.ci95[0], unit_of(name))}, {signed_number(bias.ci95[1], unit_of(name))}]"
        for name, bias in annotator.bias.items()
        if bias.ci95 is not None
    ]
    return "\n".join(["Signed mean difference from the mean of the others, 95 % confidence interval", *rows])
