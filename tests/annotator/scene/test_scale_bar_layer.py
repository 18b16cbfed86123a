"""The scale bar's bar has the length that it is painted for."""

import pytest
from PySide6.QtGui import QColor, QFont

from annotator.scene.scale_bar_layer import bar_picture


def test_the_bar_is_as_long_as_it_says(qapp: object) -> None:
    image = bar_picture(100.0, (140.0, 30.0), "5 mm", QFont(), 1.0)
    row = [image.pixelColor(x, 26) for x in range(image.width())]
    white = [x for x, color in enumerate(row) if color.alpha() == 255 and color.lightness() > 200]
    assert len(white) == pytest.approx(100, abs=1)
    assert QColor(row[0]).alpha() == 0
