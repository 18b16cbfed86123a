"""Names of checkpoints in a report."""

from collections.abc import Callable

from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.report.checkpoint_names import checkpoint_names


def test_two_of_the_same_name_are_told_apart(make: Callable[..., ErrorTable]) -> None:
    tables = [make("Lean", 1), make("V2V", 2), make("Lean", 3), make("Empty", 4, volumes=0)]

    assert checkpoint_names(tables) == ("Lean (11111111)", "V2V", "Lean (33333333)", "no checkpoint")
    assert len(set(checkpoint_names([*tables, tables[3]]))) == 5
