"""What is remembered is worked out once for the same things, and anew for any other."""

import pytest

from annotator.session.remembered import Remembered


def test_the_same_things_are_worked_out_once():
    asked = []

    def total(first: list[int], second: list[int]) -> int:
        asked.append((first, second))
        return sum(first) + sum(second)

    remembered: Remembered[int] = Remembered()
    one, other = [1], [2]
    assert [remembered.result(total, one, other) for _ in range(3)] == [3, 3, 3]
    assert len(asked) == 1


def test_an_equal_thing_is_another_one():
    remembered: Remembered[int] = Remembered()
    thing = [1, 2]
    assert remembered.result(len, thing) == 2
    thing.append(3)
    assert remembered.result(len, thing) == 2
    assert remembered.result(len, list(thing)) == 3


def test_what_failed_is_tried_again():
    remembered: Remembered[int] = Remembered()
    text = "one"
    for _ in range(2):
        with pytest.raises(ValueError, match="one"):
            remembered.result(int, text)
