import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.agreement.report.palette import method_look, numbered_look


def test_twenty_annotators_differ_without_their_colours() -> None:
    looks = [numbered_look(number) for number in range(20)]

    assert len({(look.color, look.marker) for look in looks}) == 20
    assert len({(look.marker, look.line) for look in looks}) == 20


def test_methods_differ_without_their_colours() -> None:
    assert method_look("keypoints").marker != method_look("boxes").marker
    assert method_look("keypoints").line != method_look("boxes").line


@given(st.integers(0, 1000))
def test_every_number_has_a_look(number: int) -> None:
    assert numbered_look(number).color.startswith("#")


@pytest.mark.parametrize("number", range(7))
def test_colours_stand_out_from_white(number: int) -> None:
    color = numbered_look(number).color
    channels = [int(color[place : place + 2], 16) / 255 for place in (1, 3, 5)]
    linear = [each / 12.92 if each <= 0.03928 else ((each + 0.055) / 1.055) ** 2.4 for each in channels]
    luminance = sum(share * each for share, each in zip((0.2126, 0.7152, 0.0722), linear, strict=True))

    # WCAG asks for 3 : 1 of marks; the two lightest are told apart by their shapes besides.
    assert 1.05 / (luminance + 0.05) > 2.0
