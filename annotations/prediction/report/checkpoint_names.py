"""How the checkpoints of a report are called: by their names, and apart where two have the same."""

from collections import Counter
from collections.abc import Sequence

from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.prediction import CheckpointReference

_NAMELESS = "no checkpoint"
_FIRST_LETTERS = 8


def checkpoint_names(tables: Sequence[ErrorTable]) -> tuple[str, ...]:
    """Return a name for each table's checkpoint, no two alike.

    Two checkpoints of the same name are told apart by the first letters of their SHA-256, and those that have
    none, since nothing was judged, by their number.
    """
    return told_apart(
        [(_NAMELESS, "") if table.checkpoint is None else _of(table.checkpoint) for table in tables]
    )


def told_apart(named: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Return what checkpoints are called, from the name of each and its SHA-256: see `checkpoint_names`."""
    counts = Counter(name for name, _ in named)
    return tuple(
        name if counts[name] == 1 else f"{name} ({sha256[:_FIRST_LETTERS] or number})"
        for number, (name, sha256) in enumerate(named, start=1)
    )


def _of(checkpoint: CheckpointReference) -> tuple[str, str]:
    return checkpoint.name, checkpoint.sha256
