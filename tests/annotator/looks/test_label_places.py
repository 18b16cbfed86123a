"""Where words stand beside marks."""

from itertools import combinations

from PySide6.QtCore import QRectF

from annotator.looks.label_places import label_areas

PICTURE = QRectF(0, 0, 400, 300)
WIDTH_PX, HEIGHT_PX = 70.0, 16.0


def places(marks: list[QRectF], taken: list[QRectF], picture: QRectF = PICTURE) -> list[QRectF]:
    return label_areas([(mark, WIDTH_PX, HEIGHT_PX) for mark in marks], taken, picture)


def test_words_of_many_marks_at_one_place_stand_apart() -> None:
    marks = [QRectF(190 + 3 * number, 140, 18, 18) for number in range(8)]

    found = places(marks, marks)

    assert not any(one.intersects(other) for one, other in combinations([*found, *marks[:1]], 2))
    assert all(PICTURE.contains(place) for place in found)


def test_words_stand_clear_of_others_words() -> None:
    [mark] = marks = [QRectF(190, 140, 18, 18)]
    initials = places(marks, marks)[0]

    [place] = places(marks, [mark, initials])

    assert not place.intersects(initials)
    assert not place.intersects(mark)


def test_without_any_room_words_stand_where_least_is_lost() -> None:
    small = QRectF(0, 0, 90, 40)
    [place] = places([QRectF(5, 10, 18, 18)], [QRectF(0, 28, 90, 12)], small)

    seen = place.intersected(small)
    assert seen.width() * seen.height() > 0.9 * WIDTH_PX * HEIGHT_PX
