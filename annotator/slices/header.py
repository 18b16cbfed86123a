"""What stands at the top of a slice: which plane it is, what a click does, and whether it is sharp yet."""

from dataclasses import dataclass

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QFont, QPainter

from annotator.looks.theme import Colors
from annotator.slices.captions import PADDING_PX, paint_caption
from annotator.slices.guides import INK, MARGIN_PX
from annotator.slices.projection import AXIS_NAMES, Plane
from annotator.slices.viewport import Area

COARSE = "…"
FAILED = "⚠ coarse: cannot be read"


@dataclass(frozen=True)
class Header:
    """What the top of a slice says.

    Attributes
    ----------
    plane : tuple of str
        Which plane it is, in fewer and fewer words: the first that finds room is written.
    readout : str
        What is under the cursor; empty where it is elsewhere.
    placing : str
        What a click places; empty while navigating.
    remark : str
        Whether the image is yet to become sharp.
    """

    plane: tuple[str, ...]
    readout: str = ""
    placing: str = ""
    remark: str = ""


def plane_texts(plane: Plane, index: int) -> tuple[str, ...]:
    """Return which plane this is, in fewer and fewer words: axes, where it lies, its index and the last."""
    first, second = (AXIS_NAMES[axis] for axis in range(3) if axis != plane.axis)
    across, last = AXIS_NAMES[plane.axis], plane.shape[plane.axis] - 1
    position_mm = plane.depth_um(index) / 1000
    return (
        f"{first}–{second} plane · {across} = {position_mm:.3f} mm ({index}/{last})",
        f"{across} {index}/{last} · {position_mm:.3f} mm",
        f"{across} {index}/{last}",
    )


def paint_header(painter: QPainter, area: Area, header: Header, colors: Colors) -> None:
    """Write the plane and the readout at the left, and what a click places and the remark at the right."""
    corner = Qt.AlignmentFlag.AlignTop
    left, right = area.left + MARGIN_PX / 2, area.left + area.width - MARGIN_PX / 2
    top = area.top + MARGIN_PX / 2
    if header.placing:
        painter.save()
        font = QFont(painter.font())
        font.setBold(True)
        painter.setFont(font)
        chip = paint_caption(
            painter, QPointF(right, top), header.placing, colors.placing, corner | Qt.AlignmentFlag.AlignRight
        )
        painter.restore()
        right = chip.left() - PADDING_PX
    if header.remark:
        color = colors.warning if header.remark == FAILED else INK
        remark = paint_caption(
            painter, QPointF(right, top), header.remark, color, corner | Qt.AlignmentFlag.AlignRight
        )
        right = remark.left() - PADDING_PX
    room_px = int(right - left - 2 * PADDING_PX)
    width = painter.fontMetrics().horizontalAdvance
    plane = next((text for text in header.plane if width(text) <= room_px), header.plane[-1])
    line = _paint_line(painter, QPointF(left, top), plane, right - left)
    if header.readout:
        _paint_line(painter, QPointF(left, line + 1), header.readout, area.width - MARGIN_PX)


def _paint_line(painter: QPainter, corner: QPointF, text: str, room_px: float) -> float:
    """Write a line that loses its end where there is no room, and return where the next one can begin."""
    shown = painter.fontMetrics().elidedText(text, Qt.TextElideMode.ElideRight, int(room_px - 2 * PADDING_PX))
    alignment = Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft
    return paint_caption(painter, corner, shown, INK, alignment).bottom()
