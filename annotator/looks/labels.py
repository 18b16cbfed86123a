"""Labels that never cut a sentence off: they wrap, or they elide and say the whole in their tooltip."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPalette, QResizeEvent
from PySide6.QtWidgets import QLabel, QSizePolicy, QWidget

from annotator.looks import theme

PickColor = Callable[[theme.Colors], QColor]

_LINE_LETTERS = 64


def axis_color(axis: int) -> PickColor:
    """Return what picks the colour of an array axis, 0, 1 or 2."""
    return lambda colors: colors.axes[axis]


class ColoredLabel(QLabel):
    """A label whose text can have a colour of the theme, and keeps to it when the theme changes."""

    def __init__(self, text: str = "", parent: QWidget | None = None) -> None:
        super().__init__(text, parent)
        self._pick: PickColor | None = None

    def set_color(self, pick: PickColor | None) -> None:
        """Draw the text in the colour that is picked from the theme's, or, for None, as other text."""
        self._pick = pick
        self._apply_color()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._apply_color()

    def _apply_color(self) -> None:
        if self._pick is None:
            wanted = QPalette()
        else:
            wanted = QPalette(self.palette())
            wanted.setColor(self.foregroundRole(), self._pick(theme.colors(self.palette())))
        # Setting a palette announces a change of palette: an equal one must not be set again.
        if wanted.resolveMask() != self.palette().resolveMask() or wanted != self.palette():
            self.setPalette(wanted)


class WrappedText(ColoredLabel):
    """Plain text that wraps, can be selected with the mouse, and asks for the height that its width needs."""

    def __init__(self, text: str = "", parent: QWidget | None = None, *, name: str = "") -> None:
        super().__init__(text, parent)
        self._height = 0
        self.setObjectName(name)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(True)
        self.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        # As tall as the text needs, no taller: room that is left over goes elsewhere.
        policy = QSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Minimum)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)

    def sizeHint(self) -> QSize:
        """Ask for lines of a length that reads well, and the height that they then need."""
        widest = self.fontMetrics().averageCharWidth() * _LINE_LETTERS
        lines = self.text().split("\n")
        width = min(widest, max(self.fontMetrics().horizontalAdvance(line) for line in lines) + 2)
        return QSize(width, self.heightForWidth(width))

    def minimumSizeHint(self) -> QSize:
        return QSize(super().minimumSizeHint().width(), self._height)

    def setText(self, text: str) -> None:
        super().setText(text)
        if self.isVisible():
            self._claim_height()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._claim_height()

    def _claim_height(self) -> None:
        # A window computes its smallest height at its hinted width: narrower, it would cut text off.
        height = max(self.heightForWidth(self.width()), 0)
        if height != self._height:
            self._height = height
            self.updateGeometry()


class Heading(WrappedText):
    """The sentence that a dialog or a panel begins with."""

    def __init__(self, text: str = "", parent: QWidget | None = None, *, name: str = "") -> None:
        super().__init__(text, parent, name=name)
        font = self.font()
        font.setPointSizeF(font.pointSizeF() * 1.15)
        font.setBold(True)
        self.setFont(font)


class ElidedText(ColoredLabel):
    """One line, such as a path, that loses its middle when there is no room; the tooltip has the whole."""

    def __init__(
        self,
        text: str = "",
        parent: QWidget | None = None,
        *,
        name: str = "",
        mode: Qt.TextElideMode = Qt.TextElideMode.ElideMiddle,
    ) -> None:
        super().__init__("", parent)
        self._mode = mode
        self.setObjectName(name)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setText(text)

    def setText(self, text: str) -> None:
        super().setText(text)
        self.setToolTip(text)

    def sizeHint(self) -> QSize:
        hint = super().sizeHint()
        return hint.boundedTo(QSize(self.fontMetrics().averageCharWidth() * _LINE_LETTERS, hint.height()))

    def minimumSizeHint(self) -> QSize:
        few_letters = self.fontMetrics().horizontalAdvance("mmmm…")
        return QSize(min(few_letters, super().sizeHint().width()), super().minimumSizeHint().height())

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        area = self.contentsRect()
        shown = self.fontMetrics().elidedText(self.text(), self._mode, area.width())
        self.style().drawItemText(
            painter,
            area,
            int(self.alignment()),
            self.palette(),
            self.isEnabled(),
            shown,
            self.foregroundRole(),
        )
