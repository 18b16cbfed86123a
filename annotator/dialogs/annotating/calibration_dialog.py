"""What finished annotations say of the tool's links, and the new specification that may follow."""

from collections.abc import Iterator

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QHeaderView,
    QLineEdit,
    QPlainTextEdit,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from annotations.fitting.calibration import LinkMeasures, Measured
from annotations.geometry.tool import Link
from annotator.looks.labels import ElidedText, Heading, WrappedText
from annotator.looks.naming import named
from annotator.session.agreement.calibrating import ToolCalibration

_COLUMNS = ("Link", "Measure", "Nominal", "Median", "Spread", "Number")
_NOT_MEASURED = "—"
# A robust spread of fewer says little, and one annotation that is off moves their median.
_ENOUGH = 5


class CalibrationDialog(QDialog):
    """Shows each link's nominal and measured lengths, and asks for the name of the new specification."""

    def __init__(self, found: ToolCalibration, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._found = found
        self.setObjectName("calibration_dialog")
        self.setWindowTitle("Calibrate the tool")
        self.setSizeGripEnabled(True)
        self._name = named(QLineEdit(found.suggested_name), "calibration_name", title="Name of the new tool")
        self._name.textChanged.connect(self._on_name_text_changed)
        self._few = [
            f"{link.name} {quantity}"
            for link, quantity, _, measured in self._measures()
            if measured is not None and measured.number < _ENOUGH
        ]
        caution = WrappedText(self._caution(), name="calibration_caution")
        caution.set_color(lambda colors: colors.warning)
        caution.setVisible(bool(self._few))
        self._problem = WrappedText(name="calibration_problem")
        self._problem.set_color(lambda colors: colors.error)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(buttons.button(QDialogButtonBox.StandardButton.Ok), "calibration_ok")
        self._ok.setText("Write the new specification")
        back = named(buttons.button(QDialogButtonBox.StandardButton.Cancel), "calibration_cancel")
        back.setText("Write nothing")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        form = QFormLayout()
        form.addRow("&Name", self._name)
        form.addRow("Folder", ElidedText(str(found.folder)))

        layout = QVBoxLayout(self)
        layout.addWidget(Heading(self._heading()))
        layout.addWidget(
            WrappedText(
                "What counts was placed by hand, is seen and sure, and stands in annotations that are done. "
                "Lengths are in µm; the spread is a robust standard deviation.",
                name="calibration_explanation",
            )
        )
        layout.addWidget(self._table(), 1)
        layout.addWidget(caution)
        if found.calibration.skipped:
            count = len(found.calibration.skipped)
            layout.addWidget(WrappedText(f"{count} file{'s were' if count > 1 else ' was'} left out:"))
            layout.addWidget(self._skipped())
        layout.addLayout(form)
        layout.addWidget(self._problem)
        layout.addWidget(WrappedText(self._what_follows(), name="calibration_follows"))
        layout.addWidget(buttons)
        # Only now: the dialog must know of it, or makes another one the default.
        (back if self._few else self._ok).setDefault(True)
        self._draw()
        self._name.setFocus()
        self._name.selectAll()

    @property
    def name(self) -> str:
        """The name of the new specification."""
        return self._name.text().strip()

    def _heading(self) -> str:
        count = self._found.calibration.documents
        if not count:
            return f"No finished annotation measures {self._found.tool.name}"
        own = " of your own" if self._found.is_own else ""
        return (
            f"{self._found.tool.name}, measured in {count} finished annotation{'s' if count > 1 else ''}{own}"
        )

    def _caution(self) -> str:
        return (
            f"Rests on fewer than {_ENOUGH} measurements: {', '.join(self._few)}. "
            "One annotation that is off moves such a median: finish more before the new tool is used."
        )

    def _measures(self) -> Iterator[tuple[Link, str, float, Measured | None]]:
        """Yield links, what is measured of each, its nominal value in µm, and what was measured."""
        for link in self._found.tool.links:
            measures = self._found.calibration.links.get(link.name, LinkMeasures())
            width_um, height_um = link.cross_section_um
            yield link, "length", link.length_um, measures.length
            yield link, "diameter" if link.is_round else "width", width_um, measures.width
            if not link.is_round:
                yield link, "height", height_um, measures.height

    def _table(self) -> QTableWidget:
        rows = [
            _row(link.name, quantity, nominal_um, measured)
            for link, quantity, nominal_um, measured in self._measures()
        ]
        table = named(QTableWidget(len(rows), len(_COLUMNS)), "calibration_table", title="Measures of links")
        table.setHorizontalHeaderLabels(_COLUMNS)
        table.verticalHeader().setVisible(False)
        table.setEditTriggers(QTableWidget.EditTrigger.NoEditTriggers)
        table.setAlternatingRowColors(True)
        for number, row in enumerate(rows):
            for column, text in enumerate(row):
                item = QTableWidgetItem(text)
                if column > 1:
                    item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                table.setItem(number, column, item)
        table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        unit = self.fontMetrics().height()
        # All rows where the screen has room; in a low one they scroll, and the buttons stay in sight.
        table.setSizeAdjustPolicy(QTableWidget.SizeAdjustPolicy.AdjustToContents)
        table.setMinimumSize(34 * unit, 6 * unit)
        return table

    def _skipped(self) -> QPlainTextEdit:
        text = "\n".join(str(error) for error in self._found.calibration.skipped)
        skipped = named(QPlainTextEdit(text), "calibration_skipped", title="Files that were left out")
        skipped.setReadOnly(True)
        skipped.setMaximumHeight(5 * self.fontMetrics().height())
        return skipped

    def _what_follows(self) -> str:
        old = f"{self._found.tool.name} and every annotation made with it stay as they are."
        if self._found.is_study:
            return f"{old} New annotations use the new tool once study.toml names it as the study's tool."
        return f"{old} New annotations can use the new tool: Edit ▸ Tool…"

    @Slot()
    def _on_name_text_changed(self) -> None:
        self._draw()

    def _draw(self) -> None:
        problem = self._found.problem_with(self.name)
        self._problem.setText(problem)
        self._problem.setVisible(bool(problem))
        self._ok.setEnabled(not problem)


def _row(link: str, quantity: str, nominal_um: float, measured: Measured | None) -> tuple[str, ...]:
    if measured is None:
        return (link, quantity, f"{nominal_um:.1f}", *(_NOT_MEASURED,) * 2, "0")
    spread = _NOT_MEASURED if measured.spread_um is None else f"{measured.spread_um:.1f}"
    return (link, quantity, f"{nominal_um:.1f}", f"{measured.median_um:.1f}", spread, str(measured.number))
