"""Training files as HDF5: one dataset per quantity, rows along the first axis, units in the attributes."""

import io
from collections.abc import Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike

from annotations import __version__
from annotations.interchange.split import SPLITS
from annotations.interchange.target_table import SCHEMA, TargetTable

_AXES = "array axes 0, 1, 2 (x, y, z)"
_ABSENT = "NaN"
_NO_VECTOR = (np.nan, np.nan, np.nan)


def hdf5_bytes(table: TargetTable) -> bytes:
    """Return the bytes of the HDF5 file of a table."""
    # In memory: tens of thousands of rows are a few megabytes, and the file is then written in one step.
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        file.attrs.update(
            {
                "schema": SCHEMA,
                "program": f"oct-annotator {__version__}",
                "created": table.created.isoformat(timespec="seconds").replace("+00:00", "Z"),
                "tool": table.tool.name,
                "tool_fingerprint": table.tool.fingerprint,
                "method": table.method,
                "split_names": SPLITS,
                "split_shares": table.rule.shares,
                "split_seed": table.rule.seed,
            }
        )
        _write_volumes(file, table)
        _write_keypoints(file, table)
        _write_targets(file.create_group("targets"), table)
        _write_documents(file.create_group("document"), table)
    return stream.getvalue()


def _write_volumes(file: h5py.File, table: TargetTable) -> None:
    volumes = [row.document.annotation.volume for row in table.rows]
    _write_text(file, "volume_id", [row.document.volume.id for row in table.rows])
    path = _write_text(file, "path", [row.document.volume.path for row in table.rows])
    path.attrs["relative_to"] = "the study's folder"
    dataset = _write_text(file, "dataset", [volume.dataset or "" for volume in volumes])
    dataset.attrs["absent"] = "empty: the file holds one array"
    shape = file.create_dataset("shape", data=np.array([volume.shape for volume in volumes], dtype=np.int64))
    shape.attrs.update({"units": "voxel", "axes": _AXES})
    _write_numbers(file, "spacing_um", [volume.spacing_um for volume in volumes], "um", axes=_AXES)
    _write_text(file, "fingerprint", [volume.fingerprint for volume in volumes])
    split = _write_text(file, "split", [row.split for row in table.rows])
    split.attrs["values"] = SPLITS


def _write_keypoints(file: h5py.File, table: TargetTable) -> None:
    _write_text(file, "keypoint_names", list(table.tool.keypoint_names))
    said = {"axes": _AXES, "absent": _ABSENT, "mask": "has_position"}
    _write_numbers(file, "keypoints_um", [row.position_um for row in table.rows], "um", **said)
    _write_numbers(file, "keypoints_voxel", [row.index_voxel for row in table.rows], "voxel", **said)
    has_position = [[point.position_um is not None for point in row.keypoints] for row in table.rows]
    file.create_dataset("has_position", data=np.array(has_position, dtype=bool))
    _write_text(file, "state", [[point.state for point in row.keypoints] for row in table.rows])
    for name in ("certainty", "source"):
        text = [
            [getattr(point, name) if point.position_um is not None else "" for point in row.keypoints]
            for row in table.rows
        ]
        _write_text(file, name, text).attrs["absent"] = "empty where has_position is false"


def _write_targets(group: h5py.Group, table: TargetTable) -> None:
    targets = [row.targets for row in table.rows]
    wanted = table.tool.targets
    if wanted.position:
        positions_um = [one.position_um for one in targets]
        keypoints = ", ".join(wanted.position)
        _write_target(group, "position_um", positions_um, _NO_VECTOR, "um", axes=_AXES, keypoints=keypoints)
    if wanted.orientation:
        directions = [one.orientation for one in targets]
        keypoints = " to ".join(wanted.orientation)
        _write_target(
            group, "orientation", directions, _NO_VECTOR, "1 (unit vector)", axes=_AXES, keypoints=keypoints
        )
    for angle in wanted.angles:
        links = f"{angle.first}, {angle.second}"
        angles_deg = [one.angles_deg.get(angle.name) for one in targets]
        _write_target(group, f"{angle.name}_deg", angles_deg, np.nan, "degree", links=links)
        if angle.name in table.signed_angle_names:
            signed_deg = [one.signed_angles_deg.get(angle.name) for one in targets]
            _write_target(group, f"{angle.name}_signed_deg", signed_deg, np.nan, "degree", links=links)


def _write_target(
    group: h5py.Group,
    name: str,
    values: Sequence[ArrayLike | None],
    absent: ArrayLike,
    units: str,
    **said: str,
) -> None:
    """Write one target, and the mask that says which rows have it."""
    mask = f"has_{name}"
    numbers = [absent if value is None else value for value in values]
    _write_numbers(group, name, numbers, units, absent=_ABSENT, mask=mask, **said)
    group.create_dataset(mask, data=np.array([value is not None for value in values]))


def _write_documents(group: h5py.Group, table: TargetTable) -> None:
    path = _write_text(group, "path", [row.document_path for row in table.rows])
    path.attrs["relative_to"] = "the study's folder"
    _write_text(group, "sha256", [row.document.sha256 for row in table.rows])
    _write_text(group, "annotator", [row.document.annotator for row in table.rows])
    repeat = [row.document.repeat for row in table.rows]
    group.create_dataset("repeat", data=np.array(repeat, dtype=np.int64))
    _write_text(group, "status", [row.document.annotation.status for row in table.rows])
    is_stale = [bool(row.document.stale) for row in table.rows]
    group.create_dataset("consensus_is_stale", data=np.array(is_stale, dtype=bool))


def _write_numbers(group: h5py.Group, name: str, values: Any, units: str, **said: str) -> None:
    dataset = group.create_dataset(name, data=np.array(values, dtype=np.float64))
    dataset.attrs.update({"units": units, **said})


def _write_text(group: h5py.Group, name: str, values: Any) -> h5py.Dataset:
    return group.create_dataset(name, data=np.array(values, dtype=object), dtype=h5py.string_dtype("utf-8"))
