from annotations.agreement.report.contents import Table
from annotations.agreement.report.table_text import table_text


def test_numbers_stand_below_each_other_and_words_begin_alike() -> None:
    table = Table(
        "Errors.", ("", "mm", "Who"), (("a", "10.5", "x"), ("bcd", "2.0", "yz")), words=frozenset({2})
    )

    assert table_text(table).splitlines() == [
        "Errors.",
        "         mm  Who",
        "  a    10.5  x",
        "  bcd   2.0  yz",
    ]
