import json
from collections.abc import Sequence
from html.parser import HTMLParser
from typing import Any

import pytest

from annotations.agreement.report.contents import Photo
from annotations.agreement.report.html_report import html_bytes
from annotations.agreement.report.json_report import json_bytes
from annotations.agreement.report.outline import outline
from annotations.agreement.results import Agreement
from annotations.errors import Cancelled
from tests.annotations.agreement.report.conftest import HOSTILE

VOID = {"meta", "img", "br", "link", "input", "hr"}
URLS = {"src", "href", "srcset", "data", "action", "poster", "xlink:href"}


class Page(HTMLParser):
    """A page as a reader's program takes it apart; fails where tags do not match."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)

    def all(self, *names: str) -> Sequence[dict[str, str | None]]:
        return [attributes for tag, attributes in self.tags if tag in names]


@pytest.fixture(scope="module")
def page(agreement: Agreement) -> Page:
    return Page(html_bytes(outline(agreement, {})).decode("utf-8"))


def test_nothing_is_fetched_or_run(page: Page) -> None:
    assert page.all("script", "link", "iframe", "object", "embed", "base", "form") == []
    for _, attributes in page.tags:
        assert not [name for name in attributes if name.startswith("on")]
        for name in URLS & attributes.keys():
            assert (attributes[name] or "").startswith(("data:image/", "#"))


def test_styles_fetch_nothing(agreement: Agreement) -> None:
    text = html_bytes(outline(agreement.model_copy(update={"methods": {}}), {})).decode("utf-8")

    assert "url(" not in text
    assert "@import" not in text


def test_names_are_text_wherever_they_stand(page: Page) -> None:
    assert any(HOSTILE in text for text in page.text)
    assert page.all("h1")
    assert HOSTILE in "".join(
        page.text[: page.text.index(f"Agreement of annotators: Study of {HOSTILE}") + 1]
    )


def test_the_published_table_comes_first_and_has_the_numbers_of_the_json(
    agreement: Agreement, page: Page
) -> None:
    methods: dict[str, Any] = json.loads(json_bytes(agreement))["methods"]
    words = " ".join(page.text)
    first_table = words[words.index("Deviation from the mean of all annotators:") :]
    for method in methods.values():
        for target, statistics in method["targets"].items():
            decimals = 2 if target.endswith("_deg") else 1
            shown = f"{statistics['published']['mean']:.{decimals}f}"
            assert shown in first_table[:1500]
            for statistic in ("published", "leave_one_out", "pairwise"):
                for value in (
                    statistics[statistic]["mean"],
                    statistics[statistic]["sd"],
                    *statistics[statistic]["ci95"],
                ):
                    assert f"{value:.{decimals}f}".replace("-", "−") in words


def test_tables_and_pictures_are_for_everybody(page: Page) -> None:
    assert page.all("html")[0]["lang"] == "en"
    assert len(page.all("caption")) == len(page.all("table")) > 10
    assert all(attributes.get("scope") in ("col", "row", "colgroup") for attributes in page.all("th"))
    assert page.all("img")
    assert all(attributes["alt"] for attributes in page.all("img"))
    assert len(page.all("figcaption")) == len(page.all("img"))


def test_every_section_can_be_reached(page: Page) -> None:
    anchors = {attributes["id"] for attributes in page.all("section")}

    assert {(attributes["href"] or "").removeprefix("#") for attributes in page.all("a")} == anchors


@pytest.mark.parametrize(
    "words",
    [
        "the file is truncated",
        "k2 and k3 are swapped",
        "not marked as done",
        "OCT Annotator",
        "2,000 bootstrap resamples, seed 5",
        "2026-11-27 12:30 UTC",
        "atan2",
        "ICC(2,1)",
        "0" * 63 + "1",
    ],
)
def test_a_reader_is_told(page: Page, words: str) -> None:
    assert words in " ".join(page.text)


@pytest.mark.parametrize("count", [2, 20])
def test_any_number_of_annotators_is_shown(make: Any, count: int) -> None:
    names = tuple(f"annotator {number}" for number in range(count))
    agreement = make(names, methods=("boxes",), volumes=2, components=("position_x_um",))

    page = Page(html_bytes(outline(agreement, {})).decode("utf-8"))

    assert set(names) <= set(page.text)
    assert "Keypoints against bounding boxes" in page.text
    assert any("Only one method was used" in text for text in page.text)


def test_a_tool_without_angles_has_none_anywhere(make: Any) -> None:
    agreement = make(
        ("anna", "ben"), methods=("keypoints",), volumes=3, targets=("position_um",), components=()
    )

    page = Page(html_bytes(outline(agreement, {})).decode("utf-8"))

    assert not any("θ1" in text for text in page.text)


def test_a_tool_without_targets_has_its_keypoints(make: Any) -> None:
    agreement = make(("anna", "ben"), methods=("keypoints",), volumes=3, targets=(), components=())

    page = Page(html_bytes(outline(agreement, {})).decode("utf-8"))

    assert any("no pose targets" in text for text in page.text)
    assert "k5" in page.text


def test_an_empty_comparison_says_so(empty: Agreement) -> None:
    for agreement in (empty, empty.model_copy(update={"methods": {}, "annotators": ()})):
        page = Page(html_bytes(outline(agreement, {})).decode("utf-8"))

        assert any("Nothing could be compared" in text for text in page.text)


def test_a_photo_is_inside(agreement: Agreement) -> None:
    photo = Photo("A <caption>", "An <alternative>", (2.0, 1.0), b"\x89PNG")
    few = agreement.model_copy(update={"targets": (), "components": ()})

    page = Page(html_bytes(outline(few, {"boxes": [photo]})).decode("utf-8"))

    assert {"src": "data:image/png;base64,iVBORw==", "alt": "An <alternative>", "width": "240"} in page.all(
        "img"
    )


def test_making_it_can_be_cancelled(agreement: Agreement) -> None:
    with pytest.raises(Cancelled):
        html_bytes(outline(agreement, {}), cancelled=lambda: True)
