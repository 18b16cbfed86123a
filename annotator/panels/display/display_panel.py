"""How the volume is drawn: window, threshold, colours, rendering, layers, cropping, detail."""

from dataclasses import replace
from typing import get_args

from PySide6.QtCore import QSize, Slot
from PySide6.QtGui import QIcon, QImage, QPixmap, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from annotator.actions.view_table import LAYER_TITLES
from annotator.looks.colormaps import COLORMAPS
from annotator.looks.folding import Folding, scrolling_column
from annotator.looks.labels import ElidedText
from annotator.looks.naming import named
from annotator.panels.display.cropping_controls import CroppingControls
from annotator.panels.display.histogram import EMPTY, HistogramView, intensity_histogram
from annotator.panels.widgets.quiet_inputs import QuietComboBox
from annotator.panels.widgets.slider_row import SliderRow
from annotator.session import Session
from annotator.session.viewing.view import Layer, View

_RENDERINGS = (("Volume", "volume"), ("Maximum intensity projection", "mip"))


class DisplayPanel(QWidget):
    """Asks for everything in the view that has to do with looks; nothing here changes an annotation."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._histogram = EMPTY
        self.setObjectName("display_panel")
        self.setAccessibleName("Display")
        self._sections = [
            Folding("Intensity", self._make_intensity(), name="intensity_unfold", unfolded=True),
            Folding("3D", self._make_rendering(), name="rendering_unfold", unfolded=True),
            Folding("Shown", self._make_layers(), name="layers_unfold", unfolded=True),
            Folding("Cropping in 3D / mm", CroppingControls(session), name="cropping_unfold", unfolded=True),
        ]
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(scrolling_column(self._sections, "display_scroll"))
        session.view_changed.connect(self._on_session_view_changed)
        session.levels_changed.connect(self._on_session_levels_changed)
        self._is_behind = False
        self._is_seen = True
        self._take_histogram()

    @Slot(bool)
    def follow(self, is_seen: bool) -> None:
        """Show the open volume's intensities from now on, or only once the panel is seen again."""
        self._is_seen = is_seen
        self._catch_up()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._catch_up()

    def _make_intensity(self) -> QWidget:
        content = QWidget()
        layout = QVBoxLayout(content)
        layout.setContentsMargins(0, 0, 0, 0)
        self._bars = HistogramView()
        self._bars.window_requested.connect(self._ask_window)
        self._bars.threshold_requested.connect(self._on_threshold_value_requested)
        layout.addWidget(self._bars)
        grid = QGridLayout()
        grid.setColumnStretch(1, 1)
        self._low = SliderRow(
            grid, 0, "&Darkest", "Intensities up to this one are drawn darkest", name="window_low"
        )
        self._low.value_requested.connect(self._on_low_value_requested)
        self._high = SliderRow(
            grid, 1, "&Brightest", "Intensities from this one on are drawn brightest", name="window_high"
        )
        self._high.value_requested.connect(self._on_high_value_requested)
        self._threshold = SliderRow(
            grid,
            2,
            "&Opaque from",
            "Opacity threshold: in 3D, intensities below it are transparent, and clicks pass through them",
            name="opacity_threshold",
        )
        self._threshold.value_requested.connect(self._on_threshold_value_requested)
        layout.addLayout(grid)
        row = QHBoxLayout()
        self._words = ElidedText(name="window_words")
        self._auto = named(QPushButton("&Auto"), "window_auto")
        self._auto.setToolTip("Choose the window by the volume's own intensities")
        self._auto.clicked.connect(self._on_auto_clicked)
        row.addWidget(self._words, 1)
        row.addWidget(self._auto)
        layout.addLayout(row)
        colors_row = QHBoxLayout()
        self._colormap = QuietComboBox()
        self._colormap.setObjectName("colormap")
        self._colormap.setAccessibleName("Colours")
        self._colormap.setToolTip("Colours from the darkest to the brightest, in slices and scene")
        self._colormap.setIconSize(QSize(64, self.fontMetrics().height()))
        for name in COLORMAPS:
            self._colormap.addItem(_ramp(name), name)
        self._colormap.activated.connect(self._on_colormap_activated)
        colors_label = QLabel("&Colours")
        colors_label.setBuddy(self._colormap)
        colors_row.addWidget(colors_label)
        colors_row.addWidget(self._colormap, 1)
        layout.addLayout(colors_row)
        return content

    def _make_rendering(self) -> QWidget:
        content = QWidget()
        layout = QVBoxLayout(content)
        layout.setContentsMargins(0, 0, 0, 0)
        self._rendering = QuietComboBox()
        self._rendering.setObjectName("rendering")
        self._rendering.setAccessibleName("Rendering")
        self._rendering.setToolTip(
            "Volume: surfaces hide what is behind them. "
            "Maximum intensity projection: the brightest of each ray"
        )
        for text, rendering in _RENDERINGS:
            self._rendering.addItem(text, rendering)
        self._rendering.activated.connect(self._on_rendering_activated)
        self._detail = named(QCheckBox("&Full resolution at the keypoint or box"), "detail")
        self._detail.setToolTip(
            "Shows the part around the active keypoint or box at full resolution, not the whole volume"
        )
        self._detail.clicked.connect(self._on_detail_clicked)
        layout.addWidget(self._rendering)
        layout.addWidget(self._detail)
        return content

    def _make_layers(self) -> QWidget:
        content = QWidget()
        grid = QGridLayout(content)
        grid.setContentsMargins(0, 0, 0, 0)
        self._layers: dict[Layer, QCheckBox] = {}
        for position, layer in enumerate(get_args(Layer)):
            title = LAYER_TITLES[layer].capitalize()
            box = named(QCheckBox(title), f"layer_{layer}")
            box.setToolTip(f"Show or hide: {title.lower()}")
            box.setProperty("layer", layer)
            box.clicked.connect(self._on_layer_clicked)
            grid.addWidget(box, position // 2, position % 2)
            self._layers[layer] = box
        return content

    @Slot(float)
    def _on_low_value_requested(self, low: float) -> None:
        self._ask_window(low, max(self._session.view.window[1], low + self._histogram.step))

    @Slot(float)
    def _on_high_value_requested(self, high: float) -> None:
        self._ask_window(min(self._session.view.window[0], high - self._histogram.step), high)

    @Slot(float)
    def _on_threshold_value_requested(self, threshold: float) -> None:
        self._session.look(opacity_threshold=self._rounded(threshold))

    @Slot(float, float)
    def _ask_window(self, low: float, high: float) -> None:
        self._session.look(window=(self._rounded(low), self._rounded(high)))

    @Slot()
    def _on_auto_clicked(self) -> None:
        self._session.auto_window()

    @Slot()
    def _on_colormap_activated(self) -> None:
        self._session.look(colormap=self._colormap.currentText())

    @Slot()
    def _on_rendering_activated(self) -> None:
        self._session.look(rendering=self._rendering.currentData())

    @Slot(bool)
    def _on_detail_clicked(self, checked: bool) -> None:
        self._session.look(detail=checked)

    @Slot()
    def _on_layer_clicked(self) -> None:
        self._session.toggle_layer(self.sender().property("layer"))

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        # A crosshair or a preview on the move is none of this panel's business.
        if replace(before, crosshair_um=after.crosshair_um, preview=after.preview) != after:
            self._draw()

    @Slot()
    def _on_session_levels_changed(self) -> None:
        self._is_behind = True
        self._catch_up()

    def _rounded(self, intensity: float) -> float:
        return float(round(intensity)) if self._histogram.integral else intensity

    def _catch_up(self) -> None:
        # Behind another panel, where it mostly is, nobody waits for it while a volume opens.
        if self._is_behind and self._is_seen and self.isVisible():
            self._is_behind = False
            self._take_histogram()

    def _take_histogram(self) -> None:
        level = self._session.slice_level
        self._histogram = EMPTY if level is None else intensity_histogram(level.data)
        self._bars.set_histogram(self._histogram)
        for row in (self._low, self._high, self._threshold):
            row.set_range(self._histogram.low, self._histogram.high, self._histogram.step)
        for section in self._sections:
            section.setEnabled(level is not None)
        self._draw()

    def _draw(self) -> None:
        view = self._session.view
        low, high = view.window
        self._bars.set_limits(view.window, view.opacity_threshold)
        self._low.set_value(low)
        self._high.set_value(high)
        self._threshold.set_value(view.opacity_threshold)
        self._words.setText(f"Window {high - low:.4g}, level {(low + high) / 2:.4g}")
        self._colormap.setCurrentText(view.colormap)
        self._rendering.setCurrentIndex(self._rendering.findData(view.rendering))
        self._detail.setChecked(view.detail)
        for layer, box in self._layers.items():
            box.setChecked(layer in view.layers)


def _ramp(name: str) -> QIcon:
    table = COLORMAPS[name]
    image = QImage(table.tobytes(), len(table), 1, table.nbytes, QImage.Format.Format_RGBA8888)
    return QIcon(QPixmap.fromImage(image.scaled(64, 16)))
