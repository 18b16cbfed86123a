"""Prediction files: where they lie, how they are read, and written so that no other file is lost."""

import json
from collections.abc import Iterator
from pathlib import Path

from annotations.documents.files import DocumentError, DocumentFile, document_bytes
from annotations.documents.study import folder_name
from annotations.documents.volume_link import referenced_path
from annotations.durable_files import SaveError, replace_durably
from annotations.prediction.prediction import SCHEMA, Prediction
from annotations.volumes import Volume

PREDICTION_FILE = DocumentFile(
    Prediction, SCHEMA, "a prediction file", "Delete it, and let the checkpoint predict again"
)
PREDICTIONS = "predictions"
"""Name of the folder in which predictions are kept, one folder a checkpoint in it."""


def load_prediction(path: Path) -> Prediction:
    """Read a prediction file.

    Raises
    ------
    DocumentError
        Absent, not readable, truncated, of a newer schema, or with a field that is unknown, missing or wrong;
        with the line. The file is untouched.
    """
    return PREDICTION_FILE.parse(PREDICTION_FILE.read(path), path)


def prediction_bytes(prediction: Prediction) -> bytes:
    """Return the bytes of a prediction file: UTF-8 JSON, a keypoint a line, absent fields absent."""
    fields = prediction.model_dump(mode="json", exclude_none=True)
    for name in ("open", "left_out"):
        if "pose" in fields and not fields["pose"][name]:
            del fields["pose"][name]
    return document_bytes(fields)


def save_prediction(prediction: Prediction, path: Path) -> None:
    """Write a prediction file atomically and durably, in place of an earlier prediction.

    Raises
    ------
    SaveError
        What is there is no prediction that this program knows, or the file cannot be written; what was there
        is whole.
    """
    if path.exists() or path.is_symlink():
        try:
            load_prediction(path)
        except DocumentError as error:
            raise SaveError(
                f"what is there cannot be read as a prediction, and is not overwritten ({error.problem})",
                where=path,
                remedy="Delete it or move it away, or choose another folder",
            ) from error
    replace_durably(path, prediction_bytes(prediction))


def study_prediction_path(folder: Path, checkpoint_name: str, volume_id: str) -> Path:
    """Return where a study keeps what a checkpoint says of a volume: ``predictions/<name>/<volume id>.json``.

    A name that cannot be that of a folder is changed to one that can (`folder_name`).
    """
    return folder / PREDICTIONS / folder_name(checkpoint_name) / f"{volume_id}.json"


def checkpoint_folders(folder: Path) -> tuple[Path, ...]:
    """Return the folders, one a checkpoint, in which a study keeps predictions, in order."""
    return tuple(sorted(each for each in (folder / PREDICTIONS).glob("*") if each.is_dir()))


def study_prediction_paths(folder: Path, volume_id: str) -> tuple[Path, ...]:
    """Return the files in which a study keeps predictions of a volume, one a checkpoint, in order."""
    paths = (checkpoint / f"{volume_id}.json" for checkpoint in checkpoint_folders(folder))
    return tuple(path for path in paths if path.is_file())


def predicted_volumes(
    folder: Path, checkpoint_name: str, checkpoint_sha256: str
) -> tuple[tuple[Path, str | None], ...]:
    """Return which volumes have predictions of a checkpoint in a study, or in a folder of volumes.

    They are not checked: it is a matter of milliseconds for hundreds. What cannot be read tells nothing.

    Returns
    -------
    tuple of (Path, str or None)
        The resolved path of each volume's file, and its dataset.
    """
    found = []
    for path in sorted((folder / PREDICTIONS / folder_name(checkpoint_name)).glob("*.json")):
        try:
            fields = json.loads(path.read_bytes())
            if fields["checkpoint"]["sha256"] == checkpoint_sha256:
                volume = fields["volume"]
                found.append(((path.parent / volume["path"]).resolve(), volume.get("dataset")))
        except (OSError, ValueError, TypeError, KeyError, AttributeError):
            continue
    return tuple(found)


def loose_prediction_path(folder: Path, volume: Volume) -> Path:
    """Return where in a folder the prediction of a volume outside a study is kept: ``<stem>.json``.

    Where another volume's prediction, or any other file, has that name, ``<file name>.json``, and then
    ``<file name>-2.json`` and so on. A volume gets the same name each time.
    """
    return next(path for path in _names(folder, volume.path) if _is_free(path, volume))


def _names(folder: Path, volume_path: Path) -> Iterator[Path]:
    yield folder / f"{volume_path.stem}.json"
    yield folder / f"{volume_path.name}.json"
    number = 2
    while True:
        yield folder / f"{volume_path.name}-{number}.json"
        number += 1


def _is_free(path: Path, volume: Volume) -> bool:
    """Say whether a file is absent, or a prediction of this very volume."""
    if not (path.exists() or path.is_symlink()):
        return True
    try:
        present = load_prediction(path)
    except DocumentError:
        return False
    is_same_file = referenced_path(present.volume, path).resolve() == volume.path.resolve()
    return is_same_file and present.volume.dataset == volume.dataset
