"""How the checkpoints of a report are called: by their names, and apart where two have the same."""

from collections import Counter
from collections.abc import Sequence

from annotations.prediction.error_table import ErrorTable

_NAMELESS = "no checkpoint"
_FIRST_LETTERS = 8


def checkpoint_names(tables: Sequence[ErrorTable]) -> tuple[str, ...]:
    """Return a name for each table's checkpoint, no two alike.

    Two checkpoints of the same name are told apart by the first letters of their SHA-256.
    """
    names = [_NAMELESS if table.checkpoint is None else table.checkpoint.name for table in tables]
    counts = Counter(names)
    return tuple(
        name
        if counts[name] == 1 or table.checkpoint is None
        else f"{name} ({table.checkpoint.sha256[:_FIRST_LETTERS]})"
        for name, table in zip(names, tables, strict=True)
    )
