"""How long something took, in words."""

import pytest

from annotator.looks.durations import duration


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0, "0:00"),
        (59.9, "0:59"),
        (60, "1:00"),
        (125, "2:05"),
        (3599, "59:59"),
        (3600, "1:00:00"),
        (36_061, "10:01:01"),
    ],
)
def test_a_duration_is_read_in_minutes_and_from_an_hour_on_in_hours(seconds: float, words: str) -> None:
    assert duration(seconds) == words
