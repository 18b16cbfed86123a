from hypothesis import given
from hypothesis import strategies as st

from annotations.agreement.report.typesetting import broken, column_widths_in, line_width_in

words = st.text("abc $\\_µ°[]−θ", min_size=0, max_size=60)


@given(words, st.floats(0.3, 7.0))
def test_lines_fit_and_nothing_is_lost(text: str, width_in: float) -> None:
    lines = broken(text, 8.0, width_in)

    assert all(line_width_in(line, 8.0) <= width_in + 1e-9 for line in lines)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")


def test_wider_letters_take_more_room() -> None:
    assert line_width_in("iii", 8.0) < line_width_in("WWW", 8.0) < line_width_in("WWW", 16.0)
    assert line_width_in("WWW", 8.0) < line_width_in("WWW", 8.0, is_bold=True) + 1e-9


def test_columns_share_the_width() -> None:
    rows = [("Name", "A heading of several words"), ("a", "1"), ("b" * 200, "2")]

    widths_in = column_widths_in(rows, 8.0, 4.0, 0.1)

    assert sum(widths_in) + 0.1 <= 4.0 + 1e-6
    assert widths_in[0] > widths_in[1]


def test_a_small_table_is_as_wide_as_its_cells() -> None:
    [first, second] = column_widths_in([("A", "B"), ("one cell", "2")], 8.0, 7.0, 0.1)

    assert first == line_width_in("one cell", 8.0)
    assert second < first
