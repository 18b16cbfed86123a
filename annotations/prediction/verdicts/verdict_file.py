"""Files of verdicts: a file a reviewer and checkpoint, read and written so that no verdict is lost."""

from collections.abc import Callable
from pathlib import Path

from annotations import __version__
from annotations.documents.files import DocumentError, DocumentFile, document_bytes
from annotations.documents.json_files import json_files
from annotations.documents.record import changed
from annotations.documents.study import folder_name
from annotations.documents.write_guard import writing_beside
from annotations.durable_files import SaveError, replace_durably
from annotations.prediction.prediction_file import VERDICTS, checkpoint_folder
from annotations.prediction.verdicts.verdicts import SCHEMA, VerdictList, VolumeVerdict

VERDICT_FILE = DocumentFile(
    VerdictList, SCHEMA, "a file of verdicts", "Correct the file, or move it away and judge again"
)


def verdict_path(folder: Path, checkpoint_name: str, checkpoint_sha256: str, reviewer: str) -> Path:
    """Return where a study keeps what a reviewer says: ``verdicts/<checkpoint>/<reviewer>.json``.

    The checkpoint's folder is called as the one of its predictions (`checkpoint_folder`), and a reviewer's
    name that no file can have is changed to one that can (`folder_name`).
    """
    return _verdicts_of(folder, checkpoint_name, checkpoint_sha256) / f"{folder_name(reviewer)}.json"


def load_verdicts(
    folder: Path, checkpoint_name: str, checkpoint_sha256: str, reviewer: str
) -> VerdictList | None:
    """Read what a reviewer says of a checkpoint in a study; None where that is nothing.

    Raises
    ------
    DocumentError
        The file cannot be read, is damaged, of a newer schema, or somebody else's. It is untouched.
    """
    path = verdict_path(folder, checkpoint_name, checkpoint_sha256, reviewer)
    if not (path.exists() or path.is_symlink()):
        return None
    found = _read(path)
    if (found.checkpoint, found.reviewer) != (checkpoint_name, reviewer):
        # Some systems take Anna.json and anna.json for one file.
        raise DocumentError(
            f"it is what {found.reviewer!r} says of {found.checkpoint!r}, not {reviewer!r} of "
            f"{checkpoint_name!r}",
            where=path,
            remedy="Give the file the name of its reviewer, or review under another name",
        )
    return found


def study_verdicts(
    folder: Path, checkpoint_name: str, checkpoint_sha256: str
) -> tuple[tuple[VerdictList, ...], tuple[DocumentError, ...]]:
    """Read what all reviewers say of a checkpoint in a study.

    Returns
    -------
    tuple of VerdictList
        By the reviewers' names; without those who say nothing.
    tuple of DocumentError
        Why other files are not among them: they cannot be read, are damaged, or of a newer schema. They are
        untouched.
    """
    found: list[VerdictList] = []
    problems: list[DocumentError] = []
    for path in json_files(_verdicts_of(folder, checkpoint_name, checkpoint_sha256)):
        try:
            found.append(_read(path))
        except DocumentError as error:
            problems.append(error)
    said = sorted((each for each in found if each.verdicts), key=lambda each: each.reviewer.casefold())
    return tuple(said), tuple(problems)


def record_verdict(
    folder: Path, checkpoint_name: str, checkpoint_sha256: str, reviewer: str, verdict: VolumeVerdict
) -> VerdictList:
    """Keep a verdict, in place of an earlier one of the reviewer on the volume, and return all of them.

    Raises
    ------
    SaveError
        What is there cannot be read, or the file cannot be written; what was there is whole.
    """

    def recorded(verdicts: tuple[VolumeVerdict, ...]) -> tuple[VolumeVerdict, ...]:
        if all(each.volume != verdict.volume for each in verdicts):
            return (*verdicts, verdict)
        return tuple(verdict if each.volume == verdict.volume else each for each in verdicts)

    return _rewritten(folder, checkpoint_name, checkpoint_sha256, reviewer, recorded)


def withdraw_verdict(
    folder: Path, checkpoint_name: str, checkpoint_sha256: str, reviewer: str, volume: str
) -> VerdictList:
    """Take the reviewer's verdict on a volume back, if there is one, and return those that are left.

    Raises
    ------
    SaveError
        As by `record_verdict`.
    """

    def withdrawn(verdicts: tuple[VolumeVerdict, ...]) -> tuple[VolumeVerdict, ...]:
        return tuple(each for each in verdicts if each.volume != volume)

    return _rewritten(folder, checkpoint_name, checkpoint_sha256, reviewer, withdrawn)


def verdict_bytes(verdicts: VerdictList) -> bytes:
    """Return the bytes of a file of verdicts: UTF-8 JSON, a verdict a line, absent fields absent."""
    fields = verdicts.model_dump(mode="json", exclude_none=True)
    for each in fields["verdicts"]:
        for name in ("note", "errors"):
            if not each[name]:
                del each[name]
    return document_bytes(fields)


def _verdicts_of(folder: Path, checkpoint_name: str, checkpoint_sha256: str) -> Path:
    return folder / VERDICTS / checkpoint_folder(folder, checkpoint_name, checkpoint_sha256).name


def _read(path: Path) -> VerdictList:
    return VERDICT_FILE.parse(VERDICT_FILE.read(path), path)


def _rewritten(
    folder: Path,
    checkpoint_name: str,
    checkpoint_sha256: str,
    reviewer: str,
    edit: Callable[[tuple[VolumeVerdict, ...]], tuple[VolumeVerdict, ...]],
) -> VerdictList:
    path = verdict_path(folder, checkpoint_name, checkpoint_sha256, reviewer)
    # A person may have two windows: neither loses what the other has just written.
    with writing_beside(path):
        try:
            present = load_verdicts(folder, checkpoint_name, checkpoint_sha256, reviewer)
        except DocumentError as error:
            raise SaveError(
                f"the verdicts of {reviewer} in this file cannot be read, and are not written over "
                f"({error.problem})",
                where=error.where or path,
                remedy=error.remedy or "Move the file away, and judge again",
            ) from error
        before = present or VerdictList(checkpoint=checkpoint_name, reviewer=reviewer)
        after = changed(before, verdicts=edit(before.verdicts), program=__version__)
        if after.verdicts != before.verdicts:
            try:
                replace_durably(path, verdict_bytes(after))
            except SaveError as error:
                remedy = "This is not recorded: free space, or get permission to write there, and judge again"
                raise SaveError(error.problem, where=error.where, remedy=remedy) from error
    return after
