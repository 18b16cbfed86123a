"""The verdicts of all reviewers as one table: a verdict a row, with what it was about."""

from collections.abc import Iterator, Mapping, Sequence

from annotations.agreement.report.csv_report import Cell, csv_bytes
from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.verdicts.verdicts import VerdictList, is_stale

_COLUMNS = (
    "volume",
    "verdict",
    "reviewer",
    "note",
    "moment",
    "checkpoint",
    "checkpoint_sha256",
    "annotator",
    "annotation_sha256",
    "changed_since",
)


def verdicts_csv(lists: Sequence[VerdictList], tables: Sequence[ErrorTable] = ()) -> bytes:
    """Return verdicts as CSV, in UTF-8.

    The columns are `volume`, `verdict`, `reviewer`, `note`, `moment` (UTC), `checkpoint`,
    `checkpoint_sha256`, `annotator`, `annotation_sha256`, `changed_since`, and then the errors at the time of
    the verdict, a column a target. `changed_since` is ``yes`` where the annotation or the checkpoint is
    another one by now (`is_stale`), and empty for checkpoints without a table.

    Parameters
    ----------
    lists : sequence of VerdictList
        Of any reviewers and checkpoints.
    tables : sequence of ErrorTable
        What is there now, one a checkpoint.
    """
    targets = tuple(
        dict.fromkeys(name for of_one in lists for verdict in of_one.verdicts for name in verdict.errors)
    )
    return csv_bytes((*_COLUMNS, *targets), _rows(lists, tables, targets))


def _rows(
    lists: Sequence[VerdictList], tables: Sequence[ErrorTable], targets: Sequence[str]
) -> Iterator[tuple[Cell, ...]]:
    present: Mapping[str, ErrorTable] = {
        table.checkpoint.name: table for table in tables if table.checkpoint is not None
    }
    for of_one in lists:
        table = present.get(of_one.checkpoint)
        rows = {row.volume: row for row in table.rows} if table is not None else {}
        for verdict in of_one.verdicts:
            changed: str | None = None
            if table is not None and table.checkpoint is not None:
                stale = is_stale(verdict, rows.get(verdict.volume), table.checkpoint.sha256)
                changed = "yes" if stale else "no"
            yield (
                verdict.volume,
                verdict.verdict,
                of_one.reviewer,
                verdict.note or None,
                verdict.moment.isoformat(),
                of_one.checkpoint,
                verdict.checkpoint_sha256,
                verdict.annotator,
                verdict.annotation_sha256,
                changed,
                *(verdict.errors.get(name) for name in targets),
            )
