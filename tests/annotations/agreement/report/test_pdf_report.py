import re
from typing import Any

import pytest

from annotations.agreement.report.contents import Contents, Photo, Section, Table
from annotations.agreement.report.outline import outline
from annotations.agreement.report.pdf_report import pdf_bytes
from annotations.agreement.report.pictures import picture_bytes
from annotations.agreement.results import Agreement
from annotations.errors import Cancelled
from tests.annotations.agreement.report.conftest import HOSTILE


def pages(content: bytes) -> int:
    assert content.startswith(b"%PDF-")
    assert content.rstrip().endswith(b"%%EOF")
    return len(re.findall(rb"/Type /Page\b", content))


def of(*items: Any) -> Contents:
    return Contents("A title", "what", (("Tool", "needle"),), [Section("one", "One", items)])


def test_a_report_has_pages(make: Any) -> None:
    agreement = make(("anna", HOSTILE), methods=("boxes",), volumes=3)
    shares: list[float] = []

    assert pages(pdf_bytes(outline(agreement, {}), shares.append)) > 3

    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_an_empty_comparison_has_pages_too(empty: Agreement) -> None:
    assert pages(pdf_bytes(outline(empty, {}))) >= 1


@pytest.mark.parametrize(("rows", "least", "most"), [(3, 1, 1), (200, 4, 8)])
def test_long_tables_go_over_pages(rows: int, least: int, most: int) -> None:
    table = Table("What", ("Name", "Value"), tuple((f"row {row}", str(row)) for row in range(rows)))

    assert least <= pages(pdf_bytes(of(table))) <= most


def test_wide_tables_and_hostile_words_fit() -> None:
    word = "$\\frac{1" * 20
    table = Table("x" * 400, tuple(f"{word}{n}" for n in range(9)), ((word,) * 9,), (("", 1), (word, 8)))

    assert pages(pdf_bytes(of(table))) >= 1


def test_photos_are_printed() -> None:
    size_in = (7.0, 4.0)
    png = picture_bytes(size_in, lambda figure: None, "png")
    photo = Photo("caption", "alternative", size_in, png)

    content = pdf_bytes(of(photo, photo, photo))

    assert pages(content) == 2
    assert content.count(b"/Subtype /Image") >= 1


def test_making_it_can_be_cancelled(empty: Agreement) -> None:
    with pytest.raises(Cancelled):
        pdf_bytes(outline(empty, {}), cancelled=lambda: True)
