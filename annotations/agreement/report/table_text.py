"""A report's table as plain text."""

from collections.abc import Sequence

from annotations.agreement.report.contents import Table


def table_text(table: Table) -> str:
    """Return a table as text, its caption first, its columns below each other."""
    rows: Sequence[Sequence[str]] = (table.columns, *table.rows)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        [
            table.caption,
            *(
                "  "
                + "  ".join(
                    cell.ljust(width) if place == 0 or place in table.words else cell.rjust(width)
                    for place, (cell, width) in enumerate(zip(row, widths, strict=True))
                ).rstrip()
                for row in rows
            ),
        ]
    )
