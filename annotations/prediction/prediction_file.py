"""Prediction files: where they lie, how they are read, and written so that no other file is lost."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path

from annotations.documents.files import DocumentError, DocumentFile, document_bytes
from annotations.documents.json_files import json_files
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
VERDICTS = "verdicts"
"""Name of the folder in which a study keeps verdicts; the folders in it are called as in the other one."""

_FIRST_LETTERS = 8
_UNREADABLE = (OSError, ValueError, TypeError, KeyError, AttributeError)


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


def checkpoint_folder(folder: Path, checkpoint_name: str, checkpoint_sha256: str) -> Path:
    """Return where a study, or a folder of volumes, keeps what a checkpoint says: ``predictions/<name>``.

    Where that holds what another file of the same name says, as after a new training, or where verdicts on
    another are all that is left, it is ``predictions/<name>-<first letters of the SHA-256>``: neither
    overwrites the other. A checkpoint that has got such a folder stays with it. Names that no folder can have
    are changed to some that one can (`folder_name`).
    """
    usual = folder / PREDICTIONS / folder_name(checkpoint_name)
    apart = folder / PREDICTIONS / folder_name(f"{checkpoint_name}-{checkpoint_sha256[:_FIRST_LETTERS]}")
    if apart.is_dir():
        return apart
    holder_sha256 = _holder_sha256(usual) or _judged_sha256(folder / VERDICTS / usual.name)
    return usual if holder_sha256 in (None, checkpoint_sha256) else apart


def study_prediction_path(folder: Path, checkpoint_name: str, checkpoint_sha256: str, volume_id: str) -> Path:
    """Return where a study keeps what a checkpoint says of a volume, in its `checkpoint_folder`."""
    return checkpoint_folder(folder, checkpoint_name, checkpoint_sha256) / f"{volume_id}.json"


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
    for path in json_files(checkpoint_folder(folder, checkpoint_name, checkpoint_sha256)):
        with contextlib.suppress(*_UNREADABLE):
            fields = json.loads(path.read_bytes())
            if fields["checkpoint"]["sha256"] == checkpoint_sha256:
                volume = fields["volume"]
                found.append(((path.parent / volume["path"]).resolve(), volume.get("dataset")))
    return tuple(found)


def _holder_sha256(folder: Path) -> str | None:
    """Return whose predictions a folder holds: of the first that can be read; None where none can."""
    for path in json_files(folder):
        with contextlib.suppress(*_UNREADABLE):
            return str(json.loads(path.read_bytes())["checkpoint"]["sha256"])
    return None


def _judged_sha256(folder: Path) -> str | None:
    """Return on whose predictions the verdicts in a folder are: the first that can be read; None without."""
    for path in json_files(folder):
        with contextlib.suppress(*_UNREADABLE, IndexError):
            return str(json.loads(path.read_bytes())["verdicts"][0]["checkpoint_sha256"])
    return None


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
