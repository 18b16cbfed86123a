"""The figures of a comparison in the published layout: targets by methods."""

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHeaderView, QTableWidgetItem, QWidget

from annotations.agreement.report.labels import (
    METHODS,
    NOTHING,
    STATISTICS,
    interval,
    label_of,
    methods_of,
    number,
    unit_of,
    with_unit,
)
from annotations.agreement.results import (
    Agreement,
    Estimate,
    Figures,
    MethodResult,
    StatisticName,
    Statistics,
)
from annotator.panels.widgets.read_only_table import ReadOnlyTable

VARIANTS: dict[str, tuple[str, Callable[[MethodResult], Figures | None]]] = {
    "all": ("All that was annotated blindly", lambda result: result),
    "without_doubtful": ("Without unseen and unsure points", lambda result: result.without_doubtful),
    "with_not_blind": ("With work that was not blind", lambda result: result.with_not_blind or result),
    "with_from_prediction": (
        "With work begun from predictions",
        lambda result: result.with_from_prediction or result,
    ),
    "without_mistakes": ("Without recognised mistakes", lambda result: result.without_mistakes or result),
}
"""What the figures can be of, in words, and which of a method's figures those are."""

MEANINGS: dict[StatisticName, str] = {
    "published": "How far annotators are from the mean of all of a volume: the published statistic",
    "leave_one_out": "How far each annotator is from the mean of the others, without the own share in it",
    "pairwise": "How far two annotators of a volume are apart, over all pairs",
}
"""What each statistic says of the volumes."""

LEGEND = "[…]: 95 % confidence interval. n: volumes with at least two annotators."


class DeviationTable(ReadOnlyTable):
    """A row for each target, a column for each method; each cell a mean, its interval and its volumes."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("deviation_table", "Deviation by target and method", parent)
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        # A mean, and below it how well it is known.
        self.verticalHeader().setDefaultSectionSize(int(self.fontMetrics().height() * 2.6))
        self.setWordWrap(True)

    def show_result(self, result: Agreement, statistic: StatisticName, variant: str) -> None:
        """Write one statistic of one variant."""
        methods = methods_of(result)
        self.setRowCount(len(result.targets))
        self.setColumnCount(len(methods))
        for column, method in enumerate(methods):
            header = QTableWidgetItem(METHODS[method])
            header.setToolTip(f"Annotated by {METHODS[method].lower()}: mean over volumes, and its interval")
            self.setHorizontalHeaderItem(column, header)
        for row, target in enumerate(result.targets):
            header = QTableWidgetItem(with_unit(target))
            header.setToolTip(f"{label_of(target)} of the tool. {MEANINGS[statistic]}")
            self.setVerticalHeaderItem(row, header)
        for column, method in enumerate(methods):
            figures = VARIANTS[variant][1](result.methods[method]) or Figures()
            for row, target in enumerate(result.targets):
                estimate = getattr(figures.targets.get(target, Statistics()), statistic)
                self._write_estimate(row, column, target, estimate, STATISTICS[statistic])
        self.fit_height()

    def _write_estimate(self, row: int, column: int, target: str, estimate: Estimate, statistic: str) -> None:
        unit = unit_of(target)
        mean = number(estimate.mean, unit)
        text = f"{mean}  (n {estimate.n})\n{interval(estimate.ci95, unit)}" if mean != NOTHING else NOTHING
        item = self.write(row, column, text)
        item.setTextAlignment(Qt.AlignmentFlag.AlignCenter)
        spread = f", standard deviation {number(estimate.sd, unit)} {unit}" if estimate.sd is not None else ""
        item.setToolTip(
            f"{label_of(target)}, {statistic.lower()}: {mean} {unit}, 95 % confidence interval "
            f"{interval(estimate.ci95, unit) or 'unknown'}{spread}, over {estimate.n} volumes"
        )
