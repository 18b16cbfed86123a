"""Training files as CSV: a line per row, units in the columns' names, empty fields for what is absent."""

import csv
import io
from collections.abc import Iterable, Iterator
from pathlib import Path

from annotations import __version__
from annotations.interchange.target_table import SCHEMA, TargetRow, TargetTable
from annotations.volumes.readers.hdf5 import TRAINING_SCHEMA

_Field = tuple[str, object]


def csv_bytes(table: TargetTable) -> bytes:
    """Return the bytes of the CSV file (UTF-8) of a table, which has one row at least.

    Numbers have as many digits as it takes to read the same number back.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    for number, row in enumerate(table.rows):
        fields = list(_fields(table, row))
        if not number:
            writer.writerow([name for name, _ in fields])
        writer.writerow(["" if value is None else value for _, value in fields])
    return stream.getvalue().encode()


def is_targets_csv(path: Path) -> bool:
    """Say whether a file is one that `csv_bytes` made, of this or another version."""
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            rows = csv.DictReader(stream)
            schema = next(rows, {}).get("schema")
    except (OSError, UnicodeDecodeError, csv.Error):
        return False
    return isinstance(schema, str) and schema.startswith(TRAINING_SCHEMA)


def _fields(table: TargetTable, row: TargetRow) -> Iterator[_Field]:
    volume = row.document.annotation.volume
    yield "schema", SCHEMA
    yield "volume_id", row.document.volume.id
    yield "path", row.document.volume.path
    yield "dataset", volume.dataset
    yield from _along_axes("shape", "_voxel", volume.shape)
    yield from _along_axes("spacing", "_um", volume.spacing_um)
    yield "fingerprint", volume.fingerprint
    yield "split", row.split
    for keypoint, index_voxel in zip(row.keypoints, row.index_voxel.tolist(), strict=True):
        is_placed = keypoint.position_um is not None
        yield from _along_axes(keypoint.name, "_um", keypoint.position_um)
        yield from _along_axes(keypoint.name, "_voxel", index_voxel if is_placed else None)
        yield f"{keypoint.name}_state", keypoint.state
        yield f"{keypoint.name}_certainty", keypoint.certainty if is_placed else None
        yield f"{keypoint.name}_source", keypoint.source
    if table.tool.targets.position:
        yield from _along_axes("position", "_um", row.targets.position_um)
    if table.tool.targets.orientation:
        yield from _along_axes("orientation", "", row.targets.orientation)
    for name in table.angle_names:
        yield f"{name}_deg", row.targets.angles_deg.get(name)
        if name in table.signed_angle_names:
            yield f"{name}_signed_deg", row.targets.signed_angles_deg.get(name)
    yield "document_path", row.document_path
    yield "document_sha256", row.document.sha256
    yield "annotator", row.document.annotator
    yield "repeat", row.document.repeat
    yield "status", row.document.annotation.status
    yield "consensus_is_stale", int(bool(row.document.stale))
    yield "method", table.method
    yield "tool", table.tool.name
    yield "tool_fingerprint", table.tool.fingerprint
    yield "split_shares", " ".join(f"{share:g}" for share in table.rule.shares)
    yield "split_seed", table.rule.seed
    yield "created", table.created.isoformat(timespec="seconds").replace("+00:00", "Z")
    yield "program", f"oct-annotator {__version__}"


def _along_axes(name: str, unit: str, values: Iterable[float] | None) -> Iterator[_Field]:
    for axis, value in zip("xyz", values if values is not None else (None,) * 3, strict=True):
        yield f"{name}_{axis}{unit}", value
