"""The demo study: a few small volumes with the truth about them, for a first look at the application."""

import contextlib
import os
import shutil
from collections.abc import Callable
from pathlib import Path

from annotations.documents.study import STUDY_FILE
from annotations.durable_files import SaveError
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.synthetic_study import write_study

_TOOL = "magnetic-forceps"
_ANNOTATOR = "demo"
_COUNT = 5
_SEED = 20
_SHAPE = (219, 387, 230)
"""A fifth of the full volume along each axis: fine enough to see the tool's edges, and 19 MB a volume."""


def make_demo_study(
    folder: Path,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Path:
    """Make the demo study in a folder, once; one that is there already is left as it is.

    It is made beside the folder and takes its name in one step, so that a study cut short is never opened.

    Parameters
    ----------
    folder : Path
        Where the study is to be; its parent is created if absent.
    progress, cancelled : callable, optional
        As in `annotations.synthesis.write_study`.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    SaveError
        It cannot be written, or another file or folder is in its place.
    Cancelled
        `cancelled` returned true; nothing stays behind.
    """
    if (folder / STUDY_FILE).exists():
        return folder
    unfinished = folder.with_name(f".{folder.name}.{os.getpid()}.partial")
    # What an earlier process of the same number left behind when it was killed.
    shutil.rmtree(unfinished, ignore_errors=True)
    try:
        write_study(
            unfinished,
            shipped_tools()[_TOOL],
            count=_COUNT,
            seed=_SEED,
            shape=_SHAPE,
            title="Demo: synthetic volumes",
            annotators=(_ANNOTATOR,),
            progress=progress,
            cancelled=cancelled,
        )
        _take_name(unfinished, folder)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    return folder


def _take_name(unfinished: Path, folder: Path) -> None:
    try:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            # An empty folder may be in the way; one with anything in it refuses, and is left alone.
            folder.rmdir()
        unfinished.rename(folder)
    except OSError as error:
        if (folder / STUDY_FILE).exists():
            # Another process made the same study meanwhile.
            return
        raise SaveError(
            f"the demo study could not take its place ({error.strerror or error})",
            where=folder,
            remedy="Move what is there somewhere else",
        ) from error
