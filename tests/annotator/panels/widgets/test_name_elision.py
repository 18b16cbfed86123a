import pytest
from PySide6.QtGui import QFont, QFontMetrics

from annotator.panels.widgets.name_elision import elided_name, shared_beginning

NAMES = [f"156501_needle_{number:03}.npz" for number in range(1, 12)]


@pytest.mark.parametrize(
    ("names", "shared"),
    [
        (NAMES, "156501_needle_"),
        (["v001.npy", "v002.npy"], ""),
        (["alone_1.npy"], ""),
        ([], ""),
        (["a-b-1", "a-b-2", "a-c"], "a-"),
    ],
)
def test_what_is_shared_ends_at_a_separator(names, shared):
    assert shared_beginning(names) == shared


def test_what_sets_a_name_apart_stays(qapp):
    metrics = QFontMetrics(QFont())
    shared = shared_beginning(NAMES)
    assert elided_name(NAMES[3], shared, metrics, 10_000) == NAMES[3]
    room_px = metrics.horizontalAdvance("…004.npz") + 2
    assert elided_name(NAMES[3], shared, metrics, room_px) == "…004.npz"
    assert len({elided_name(name, shared, metrics, room_px) for name in NAMES}) == len(NAMES)
    assert "…" in elided_name("a_long_name_of_its_own.npy", shared, metrics, room_px)
