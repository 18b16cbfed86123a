"""What a drawing leaves behind."""

import gc
import weakref
from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import pytest

from annotations.agreement.report.contents import Contents, Plot, Section
from annotations.agreement.report.pdf_report import pdf_bytes
from annotations.agreement.report.pictures import picture_bytes

if TYPE_CHECKING:
    from annotations.agreement.report.contents import Surface


@pytest.fixture
def drawn() -> list[weakref.ref[object]]:
    """What was drawn, as far as it is still there."""
    return []


@pytest.fixture(autouse=True)
def without_collector() -> Iterator[None]:
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_a_figure_goes_with_its_picture_and_waits_for_no_collector(
    drawn: list[weakref.ref[object]], kind: Literal["svg", "png"]
) -> None:
    def draw(surface: "Surface") -> None:
        axes = surface.subplots()
        (line,) = axes.plot([1, 2], [3, 4], label="a line")
        drawn.extend(weakref.ref(part) for part in (line, axes, axes.legend()))

    assert picture_bytes((3.0, 2.0), draw, kind)

    assert [part() for part in drawn] == [None] * 3


def test_pages_go_with_their_file(drawn: list[weakref.ref[object]]) -> None:
    def draw(surface: "Surface") -> None:
        drawn.append(weakref.ref(surface.subplots()))

    plot = Plot("caption", "alternative", (6.0, 8.0), draw)

    assert pdf_bytes(Contents("A title", "what", (), [Section("one", "One", (plot, plot))]))

    assert [axes() for axes in drawn] == [None, None]
