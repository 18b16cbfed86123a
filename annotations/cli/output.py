"""What commands write: results to standard output, messages to standard error."""

import json
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from annotations.errors import UserError


def write_json(fields: Mapping[str, Any]) -> None:
    """Write one object on one line."""
    sys.stdout.write(json.dumps(fields, allow_nan=False) + "\n")


def write_text(text: str) -> None:
    """Write lines for a person."""
    sys.stdout.write(text + "\n")


def complain(error: UserError) -> None:
    """Write what went wrong to standard error."""
    sys.stderr.write(f"annotations: {error}\n")


def remark(text: str) -> None:
    """Write something that a person should know to standard error."""
    sys.stderr.write(f"annotations: {text}\n")


def show_progress(share: float) -> None:
    """Keep a line on the terminal up to date; a log file gets none."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r{share:4.0%}" + ("\n" if share >= 1 else ""))
        sys.stderr.flush()


def for_each(paths: Iterable[Path], as_json: bool, work: Callable[[Path], None]) -> int:
    """Do the same with each file; one that fails does not keep the others from their turn.

    Parameters
    ----------
    paths : iterable of Path
    as_json : bool
        Whether a failed file gives an object with its ``error`` too, so that there is one per file.
    work : callable
        May raise UserError.

    Returns
    -------
    int
        The exit code: 1 if any file failed.
    """
    code = 0
    for path in paths:
        try:
            work(path)
        except UserError as error:
            complain(error)
            if as_json:
                write_json({"path": str(path), "error": str(error)})
            code = 1
    return code
