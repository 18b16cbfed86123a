"""Distances between keypoints: each link's length beside its nominal one, and every pair."""

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QHeaderView, QWidget

from annotations.fitting.plausibility import Plausibility
from annotator.looks.swatches import link_swatch
from annotator.panels.annotation.plausibility_color import plausibility_color
from annotator.panels.annotation.pose_readout import PoseReadout
from annotator.panels.widgets.read_only_table import ReadOnlyTable

_EXPLAINED: dict[Plausibility, str] = {
    "plausible": "",
    "doubtful": "More than clicks and an uncalibrated length are likely to be off: look at both ends",
    "implausible": "More than clicks and an uncalibrated length explain: look at both ends",
}
_LINK_COLUMNS = ("Link", "Length", "Nominal", "Difference")


class LinkTable(ReadOnlyTable):
    """A row for each link of the tool."""

    def __init__(self, parent: QWidget | None = None) -> None:
        self._readout: PoseReadout | None = None
        super().__init__("link_table", "Lengths of the links", parent)
        self.setColumnCount(len(_LINK_COLUMNS))
        self.setHorizontalHeaderLabels(_LINK_COLUMNS)
        self.verticalHeader().setVisible(False)
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and self._readout is not None:
            self.show_readout(self._readout)

    def show_readout(self, readout: PoseReadout) -> None:
        """Write the lengths, those that nothing explains in colour."""
        drawn, self._readout = self._readout, readout
        if self.rowCount() != len(readout.links):
            self.clearContents()
            self.setRowCount(len(readout.links))
            self.fit_height()
        for row, link in enumerate(readout.links):
            absent = "—" if link.measured_um is None else ""
            name = self.write(row, 0, f"{link.link}  {link.ends[0]}–{link.ends[1]}")
            name.setTextAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
            if name.icon().isNull() or drawn is None or drawn.links[row].color != link.color:
                # The table measures its columns anew for each icon.
                name.setIcon(link_swatch(QColor(link.color)))
            needs = f"Needs {link.ends[0]} and {link.ends[1]}" if absent else f"{link.measured_um:.1f} µm"
            self.write(row, 1, absent or f"{(link.measured_um or 0) / 1000:.3f}", needs)
            self.write(
                row,
                2,
                f"{link.nominal_um / 1000:.3f}",
                "From the tool specification; a study can calibrate it",
            )
            difference = self.write(row, 3, _percent(link.deviation), _EXPLAINED[link.plausibility])
            difference.setForeground(plausibility_color(link.plausibility) or self.palette().text())


class DistanceMatrix(ReadOnlyTable):
    """The distance in mm between every two keypoints; each pair stands once."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("distance_matrix", "Distances between keypoints in mm", parent)
        self._names: tuple[str, ...] = ()
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)

    def show_readout(self, readout: PoseReadout) -> None:
        """Write the distances, rows and columns in the tool's order."""
        names = readout.names
        # The first keypoint needs no row and the last one no column: each pair stands once.
        rows, columns = names[1:], names[:-1]
        if names != self._names:
            self._names = names
            self.clear()
            self.setRowCount(len(rows))
            self.setColumnCount(len(columns))
            self.setVerticalHeaderLabels(rows)
            self.setHorizontalHeaderLabels(columns)
            self.fit_height()
        for row, second in enumerate(rows):
            for column, first in enumerate(columns[: row + 1]):
                distance_um = readout.distances_um.get((first, second))
                if distance_um is None:
                    self.write(row, column, "—", f"Needs {first} and {second}")
                else:
                    self.write(
                        row, column, f"{distance_um / 1000:.3f}", f"{first}–{second}: {distance_um:.1f} µm"
                    )


def _percent(part: float | None) -> str:
    if part is None:
        return "—"
    # What rounds to zero has no sign.
    percent = round(100 * part, 1)
    return f"{percent:+.1f} %".replace("-", "−") if percent else "0.0 %"
