"""Where words stand beside marks over an image, so that they can be read."""

from collections.abc import Iterable, Iterator, Sequence

from PySide6.QtCore import QRectF

_STEPS_PX = (0.0, 9.0, 20.0, 36.0)
"""How far from their marks words go to find free room."""


def label_area(
    marks: QRectF, width_px: float, height_px: float, taken: Sequence[QRectF], picture: QRectF
) -> QRectF:
    """Return where the words beside marks stand: in sight, and on no others if it can be.

    First to the lower left, where no name of a keypoint of one's own is.

    Parameters
    ----------
    marks : QRectF
        What the marks cover.
    width_px, height_px : float
        Of the words.
    taken : sequence of QRectF
        What has its place already.
    picture : QRectF
        What is in sight.
    """
    choices = list(_beside(marks, width_px, height_px))
    return min(choices, key=lambda choice: _lost(choice, taken, picture))


def label_areas(
    labels: Iterable[tuple[QRectF, float, float]], taken: Iterable[QRectF], picture: QRectF
) -> list[QRectF]:
    """Return where several words stand: each as `label_area`, and farther off where there is no room beside.

    Parameters
    ----------
    labels : iterable of (QRectF, float, float)
        What the marks cover, and the width and height of the words.
    taken, picture
        See `label_area`.
    """
    made: list[QRectF] = []
    covered = list(taken)
    for marks, width_px, height_px in labels:
        choices = [
            choice
            for away in _STEPS_PX
            for choice in _beside(marks.adjusted(-away, -away, away, away), width_px, height_px)
        ]
        free = (
            choice
            for choice in choices
            if picture.contains(choice) and not any(choice.intersects(other) for other in covered)
        )
        place = next(free, None)
        if place is None:
            # Few have no room: only they are weighed up.
            place = min(choices, key=lambda choice: _lost(choice, covered, picture))
        made.append(place)
        covered.append(made[-1])
    return made


def _beside(marks: QRectF, width_px: float, height_px: float) -> Iterator[QRectF]:
    """Yield where words can stand beside marks, the best place first."""
    left, right = marks.left() - width_px, marks.right()
    above, middle, below = marks.top() - height_px, marks.center().y() - height_px / 2, marks.bottom()
    for x, y in ((left, below), (left, middle), (right, below), (left, above), (right, middle)):
        yield QRectF(x, y, width_px, height_px)


def _lost(choice: QRectF, taken: Sequence[QRectF], picture: QRectF) -> float:
    """Return how much of words is out of sight, or on others, in square pixels."""
    hidden = choice.width() * choice.height() - _shared(choice, picture)
    return hidden + sum(_shared(choice, other) for other in taken)


def _shared(first: QRectF, second: QRectF) -> float:
    both = first.intersected(second)
    return both.width() * both.height()
