"""Export for training: one file with the targets of a study's volumes, readable without this program."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from annotations.app_folders import tool_folder
from annotations.documents.record import Method, now
from annotations.documents.study import load_study
from annotations.durable_files import replace_durably
from annotations.errors import UserError
from annotations.geometry.tool_library import find_tool
from annotations.interchange.speaking_documents import Choice, LeftOut, speaking_documents
from annotations.interchange.split import SPLITS, SplitRule
from annotations.interchange.target_table import target_table
from annotations.interchange.training_csv import csv_bytes, is_targets_csv
from annotations.interchange.training_hdf5 import hdf5_bytes
from annotations.volumes.readers.hdf5 import is_training_file

_FORMATS = {
    ".h5": (hdf5_bytes, is_training_file),
    ".hdf5": (hdf5_bytes, is_training_file),
    ".csv": (csv_bytes, is_targets_csv),
}


@dataclass(frozen=True)
class ExportOptions:
    """What goes into a training file.

    Attributes
    ----------
    method : str or None
        ``keypoints`` or ``boxes``; None for the study's, keypoints where it has both.
    annotator : str or None
        Who speaks for every volume, a simulation or a network as well; None for the consensus, else the only
        person who is done. A study in which a simulation alone has placed anything is exported as it is.
    every_annotation : bool
        A row per annotation, repeats and consensus included, instead of one per volume.
    include_unfinished : bool
        Annotations that are not done count as well.
    rule : SplitRule
    overwrite : bool
        Replace an earlier training file; any other file is never replaced.
    """

    method: Method | None = None
    annotator: str | None = None
    every_annotation: bool = False
    include_unfinished: bool = False
    rule: SplitRule = field(default_factory=SplitRule)
    overwrite: bool = False


@dataclass(frozen=True)
class Exported:
    """What an export wrote.

    Attributes
    ----------
    path : Path
    method : str
        Of the annotations in it.
    rows : int
    volumes : mapping of str to int
        How many volumes are in each split.
    left_out : tuple of LeftOut
        Which volumes, or annotations, have no row, and why.
    stale_volumes : tuple of str
        Volumes whose consensus has a row, although what it was made from has changed or is gone.
    remarks : tuple of str
        What else a person should know: why a consensus is stale, and which part of the split is empty.
    """

    path: Path
    method: Method
    rows: int
    volumes: Mapping[str, int]
    left_out: tuple[LeftOut, ...] = ()
    stale_volumes: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def reasons(self) -> Mapping[str, str]:
        """Why something of a volume is left out, all in one, by the volumes' ids."""
        said: dict[str, list[str]] = {}
        for one in self.left_out:
            said.setdefault(one.volume_id, []).append(one.reason)
        return {volume_id: "; ".join(reasons) for volume_id, reasons in said.items()}


def export_targets(
    folder: Path,
    output: Path,
    options: ExportOptions | None = None,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Exported:
    """Write the targets of a study's volumes to one file, for training; see ``docs/training-files.md``.

    The volumes themselves need not be at hand. The file is written whole or not at all.

    Parameters
    ----------
    folder : Path
        The study's.
    output : Path
        ``.h5`` or ``.hdf5`` for HDF5, ``.csv`` for CSV.
    options : ExportOptions, optional
    progress, cancelled : callable, optional
        Told the share that is done, and asked whether to stop, between volumes.

    Raises
    ------
    UserError
        The study, its tool or the output's name is no such thing; there is a file already; or no volume has
        an annotation to export. Nothing is written.
    SaveError
        The file cannot be written; what was there is whole.
    Cancelled
        `cancelled` returned true; nothing is written.
    """
    wanted = options if options is not None else ExportOptions()
    content_of = _format(output, wanted.overwrite)
    study = load_study(folder)
    tool_folders = (folder / "tools", tool_folder())
    tool = find_tool(study.tool, tool_folders)
    method = wanted.method if wanted.method is not None else study.usual_method
    choice = Choice(method, wanted.annotator, wanted.every_annotation, wanted.include_unfinished)
    documents, left_out = speaking_documents(study, folder, tool, tool_folders, choice, progress, cancelled)
    if not documents:
        raise UserError(
            _nothing(method, wanted, left_out),
            where=folder,
            remedy="Finish annotations, make the consensus, name an annotator, or ask for another method",
        )
    table = target_table(folder, documents, tool, method, wanted.rule, created=now())
    try:
        content = content_of(table)
    except ValueError as error:
        # Halves of characters, or a zero, in a folder's name or in a document that somebody wrote by hand.
        raise UserError(
            f"a name in it cannot be written to such a file ({error})",
            where=output,
            remedy="Rename folders of annotators whose names are not text",
        ) from error
    replace_durably(output, content)
    volumes = {
        split: len({row.document.volume.id for row in table.rows if row.split == split}) for split in SPLITS
    }
    stale = {document.volume.id: document.stale for document in documents if document.stale}
    return Exported(
        output,
        method,
        len(table.rows),
        volumes,
        left_out,
        stale_volumes=tuple(stale),
        remarks=(
            *(f"{volume_id}: {why}" for volume_id, why in stale.items()),
            *_empty_splits(volumes, wanted.rule),
        ),
    )


def _format(output: Path, overwrite: bool) -> Callable[..., bytes]:
    """Return what makes the content of a file of that name, which may be written there."""
    if output.suffix.lower() not in _FORMATS:
        raise UserError(
            f"the name's ending {output.suffix!r} tells no format",
            where=output,
            remedy="End the name in .h5 (HDF5) or .csv",
        )
    content_of, is_earlier = _FORMATS[output.suffix.lower()]
    if output.exists():
        if not overwrite:
            raise UserError(
                "there is a file already, and it is not overwritten",
                where=output,
                remedy="Choose another name, or ask for it to be overwritten (--overwrite)",
            )
        if not is_earlier(output):
            raise UserError(
                "what is there is no training file, and is not overwritten",
                where=output,
                remedy="Choose another name",
            )
    return content_of


def _empty_splits(volumes: Mapping[str, int], rule: SplitRule) -> Iterator[str]:
    for (split, count), share in zip(volumes.items(), rule.shares, strict=True):
        if share and not count:
            yield f"no volume is in {split}: there are too few of different data for this split"


def _nothing(method: Method, options: ExportOptions, left_out: tuple[LeftOut, ...]) -> str:
    whose = f" of {options.annotator!r}" if options.annotator is not None else ""
    # First what somebody has to look at.
    reasons = [
        f"{one.volume_id}: {one.reason}"
        for kinds in (("several", "unusable"), ("unplaced",))
        for one in left_out
        if one.kind in kinds
    ]
    first = f" ({reasons[0].rstrip('.')})" if reasons else ""
    return f"no volume has an annotation by {method}{whose} to export{first}"
