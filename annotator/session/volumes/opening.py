"""Opening a volume with its annotation: everything that reads files, done before anything is shown."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from annotations.documents.annotation import Annotation, new_annotation, with_all_parts
from annotations.documents.files import (
    DocumentError,
    FileIdentity,
    completed,
    load_annotation,
    ships,
    tool_of,
)
from annotations.documents.permission import permission
from annotations.documents.record import changed
from annotations.documents.recovery import Recovery
from annotations.documents.study import CONSENSUS
from annotations.documents.volume_link import compare, reference_to
from annotations.errors import UserError
from annotations.fitting.pose_fit import ToolFit, fit_document, prepare_fitting
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotations.volumes import (
    Level,
    Volume,
    fingerprint,
    intensity_window,
    open_volume,
    strided_preview,
    surface_threshold,
)
from annotator.session.volumes.spacing_answer import SpacingAnswer
from annotator.session.volumes.study_paths import KeptFromView
from annotator.session.volumes.worklist import WorkItem, Worklist


@dataclass(frozen=True)
class OpeningRequest:
    """What is to be opened.

    Attributes
    ----------
    worklist, index
        The list that the item belongs to, and its place there.
    person : str
        Who opens it.
    dataset : str or None
        The chosen member of a file that holds several arrays.
    recovery : Recovery or None
        Unsaved edits that a dead program left; the document goes on from them.
    rereads : bool
        Whether the unsaved edits of the open document are given up for what stands in its file.
    looks_anyway : bool
        Whether the annotator wants to see the others' work, although it is too early.
    """

    worklist: Worklist
    index: int
    tool_name: str
    tool_folders: tuple[Path, ...]
    person: str
    dataset: str | None = None
    recovery: Recovery | None = None
    rereads: bool = False
    looks_anyway: bool = False

    @property
    def item(self) -> WorkItem:
        """The item that is opened."""
        return self.worklist.items[self.index]


@dataclass(frozen=True)
class Found:
    """A volume and its annotation file as they stand on disk, before the spacing is settled.

    Attributes
    ----------
    fingerprint : str
        The volume's.
    document : Annotation or None
        None where there is no annotation file yet.
    identity : str
        Of the annotation file's content that the document came from, "" where there was none.
    """

    request: OpeningRequest
    volume: Volume
    fingerprint: str
    document: Annotation | None
    identity: FileIdentity
    tool: ToolSpecification

    @property
    def item(self) -> WorkItem:
        """The item that is opened."""
        return self.request.item


@dataclass(frozen=True)
class Opened:
    """A volume ready to be shown.

    Attributes
    ----------
    fit : ToolFit or None
        Of the tool to the document: it is shown with it.
    spacing_note : str
        Where the spacing comes from, in words.
    window : (float, float)
        Intensities that make a good first picture.
    opacity_threshold : float
        Intensity that tells surfaces from speckle.
    warnings : tuple of UserError
        What the annotator must know before going on.
    """

    found: Found
    document: Annotation
    fit: ToolFit | None
    spacing_um: Vector
    spacing_note: str
    level: Level
    window: tuple[float, float]
    opacity_threshold: float
    warnings: tuple[UserError, ...]


def find(request: OpeningRequest) -> Found:
    """Open a volume and read its annotation file, if there is one.

    Raises
    ------
    KeptFromView
        It is the consensus on a volume on which the person's own work is not done.
    UserError
        The volume or the annotation cannot be read, or do not belong together; both are untouched.
    """
    item = request.item
    _check_permission(request)
    volume = open_volume(item.volume_path, dataset=request.dataset or item.dataset)
    try:
        return _with_document(request, volume, fingerprint(volume))
    except BaseException:
        volume.close()
        raise


def _check_permission(request: OpeningRequest) -> None:
    """Keep the consensus, which is everybody's work, from whoever annotates the volume still."""
    worklist, volume_id = request.worklist, request.item.volume_id
    if worklist.annotator == CONSENSUS and worklist.study is not None and volume_id is not None:
        allowed = permission(worklist.study, worklist.folder, request.person, volume_id)
        if not allowed.may_see:
            raise KeptFromView(allowed.reason)


def _with_document(request: OpeningRequest, volume: Volume, volume_fingerprint: str) -> Found:
    path, recovery = request.item.annotation_path, request.recovery
    try:
        if recovery is not None:
            tool = tool_of(recovery.document, request.tool_folders)
            document, identity = _before_recovery(recovery, tool)
        else:
            document, identity = load_annotation(path)
            tool = tool_of(document, request.tool_folders)
            document = completed(document, tool)
    except UserError as error:
        if isinstance(error.__cause__, FileNotFoundError | NotADirectoryError):
            tool = find_tool(request.tool_name, request.tool_folders)
            return Found(request, volume, volume_fingerprint, None, "", tool)
        raise DocumentError(error.problem, where=error.where or path, remedy=error.remedy) from error
    for finding in compare(document.volume, volume, volume_fingerprint):
        if finding.kind in ("shape", "dtype"):
            raise DocumentError(
                finding.problem,
                where=path,
                remedy="Put the right volume back, or move the annotation file away to begin a new one",
            )
    return Found(request, volume, volume_fingerprint, document, identity, tool)


def _before_recovery(recovery: Recovery, tool: ToolSpecification) -> tuple[Annotation, FileIdentity]:
    """Return the document as it was saved last, to which undo leads back, and what its file was then.

    That identity, not the present one: a file that another program has changed since is noticed on saving.
    """
    with contextlib.suppress(UserError):
        saved, _ = load_annotation(recovery.annotation_path)
        return completed(saved, tool), recovery.expected
    blank = changed(recovery.document, keypoints=(), boxes=(), status="in_progress")
    return with_all_parts(blank, tool), recovery.expected


def known_spacing(
    found: Found, said: Vector | None, remembered: Callable[[str], SpacingAnswer | None]
) -> tuple[Found, Vector, str] | None:
    """Return what was found, its spacing in µm and where that comes from; None where a person must say it.

    An annotation's own spacing comes first: its positions were made with it.

    Parameters
    ----------
    said : (float, float, float) or None
        Given when the program was started.
    remembered : callable
        From a volume's fingerprint to what a person answered before.
    """
    answer = remembered(found.fingerprint)
    if answer is not None and found.volume.spacing_source is None:
        # Wherever the spacing comes from: the depth axis was said as well.
        found = with_depth_axis(found, answer.depth_axis)
    volume = found.volume
    sources: tuple[tuple[Vector | None, str], ...] = (
        (found.document.volume.spacing_um if found.document else None, "from the annotation"),
        (said, "as given at the start"),
        (
            volume.spacing_um if volume.spacing_source == "sidecar" else None,
            "from the file beside the volume",
        ),
        (volume.spacing_um if volume.spacing_source == "file" else None, "from the volume's file"),
        (found.item.spacing_um, "from the study"),
        (volume.spacing_um if volume.spacing_source == "folder" else None, "as answered for this folder"),
        (answer.spacing_um if answer else None, "as answered before"),
    )
    return next(((found, spacing_um, note) for spacing_um, note in sources if spacing_um is not None), None)


def with_depth_axis(found: Found, depth_axis: int) -> Found:
    """Return what was found with the depth along another axis, as a person said."""
    return replace(found, volume=replace(found.volume, depth_axis=depth_axis))


def prepare(found: Found, spacing_um: Vector, spacing_note: str) -> Opened:
    """Read the preview, fit the document, or begin one where there is none; takes a fraction of a second."""
    document = found.document or new_annotation(
        reference_to(found.volume, spacing_um, found.item.annotation_path, found.fingerprint),
        found.tool,
        found.request.worklist.annotator,
        found.request.worklist.method,
        ships=ships(found.tool),
        repeat=found.item.repeat,
    )
    recovery = found.request.recovery
    if recovery is not None and (recovery.document.positions_um or recovery.document.placed_boxes):
        # It is fitted once the session has gone on from it, in the session's own thread.
        prepare_fitting()
    fit = fit_document(document, found.tool)
    level = strided_preview(found.volume, spacing_um).ready_to_draw()
    warnings = tuple(
        UserError(
            finding.problem,
            where=found.item.annotation_path,
            remedy="Positions stay as they were made; check that this is the right volume",
        )
        for finding in compare(document.volume, found.volume, found.fingerprint)
    )
    return Opened(
        found,
        document,
        fit,
        spacing_um,
        spacing_note,
        level,
        intensity_window(level),
        surface_threshold(level),
        warnings,
    )
