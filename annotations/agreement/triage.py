"""Triage: which volumes a reviewer should settle first, by disagreement, geometry and flags."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Literal

from annotations.agreement.consensus import Consensus, changed_since
from annotations.agreement.opinions import read_opinions
from annotations.agreement.results import Agreement, Input
from annotations.documents.files import completed, load_annotation, tool_of
from annotations.documents.record import Method
from annotations.documents.study import CONSENSUS, AnnotationName, study_folder_of
from annotations.errors import Cancelled, UserError
from annotations.fitting.pose_fit import fit_document

Settled = Literal["no", "in_progress", "stale", "done"]
"""How far a consensus is; ``stale`` where it is done, and an annotation was changed since."""


@dataclass(frozen=True)
class Flag:
    """Why an annotator says that somebody should look at a volume."""

    annotator: str
    words: str


@dataclass(frozen=True)
class TriageEntry:
    """A volume as a reviewer meets it.

    Attributes
    ----------
    volume : str
    disagreement : float
        `VolumeResult.ratio_to_median`: 1 for what is usual here; 0 with fewer than two annotators.
    residual_um : float or None
        Of the annotators' documents the largest root mean square by which the tool, fitted to one, misses
        its keypoints or boxes; None where nothing can be fitted.
    strangeness : float
        That, as a multiple of what is usual here.
    flags : tuple of Flag
    settled : str
        How far the consensus is.
    reasons : tuple of str
        What explains the disagreement.
    """

    volume: str
    disagreement: float
    residual_um: float | None
    strangeness: float
    flags: tuple[Flag, ...]
    settled: Settled
    reasons: tuple[str, ...] = ()


def triage(
    agreement: Agreement,
    method: Method,
    folder: Path,
    tool_folders: Sequence[Path] = (),
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[TriageEntry, ...]:
    """Return the volumes of one method, those that need a reviewer most first.

    First what has no finished consensus, of that what somebody flagged, and then by the larger of
    disagreement and strangeness. The annotation files are read again, a fit of 5 ms for each; one that
    cannot be read any more counts for nothing.

    Parameters
    ----------
    folder : Path
        What the paths in the agreement are relative to.
    progress, cancelled : callable, optional
        Called with the share that is done; asked between files.

    Raises
    ------
    Cancelled
        `cancelled` returned true.
    """
    inputs = [each for each in agreement.inputs if each.method == method and each.repeat == 0]
    flags: dict[str, list[Flag]] = defaultdict(list)
    residuals_um: dict[str, float] = {}
    for number, each in enumerate(inputs):
        if cancelled():
            raise Cancelled
        flag, residual_um = _said(folder / each.path, tool_folders)
        if flag:
            flags[each.volume].append(Flag(each.annotator, flag))
        if residual_um is not None:
            residuals_um[each.volume] = max(residuals_um.get(each.volume, 0.0), residual_um)
        progress((number + 1) / len(inputs))
    usual_um = median(residuals_um.values()) if residuals_um else 0.0
    results = {each.volume: each for each in agreement.methods[method].volumes}
    entries = [
        TriageEntry(
            volume,
            results[volume].ratio_to_median if volume in results else 0.0,
            residuals_um.get(volume),
            residuals_um[volume] / usual_um if volume in residuals_um and usual_um else 0.0,
            tuple(flags[volume]),
            _settled(folder, volume, method, tool_folders),
            results[volume].reasons if volume in results else (),
        )
        for volume in _volumes(inputs)
    ]
    return tuple(sorted(entries, key=_order))


def _order(entry: TriageEntry) -> tuple[bool, bool, float]:
    return (entry.settled == "done", not entry.flags, -max(entry.disagreement, entry.strangeness))


def _volumes(inputs: Sequence[Input]) -> list[str]:
    return list(dict.fromkeys(each.volume for each in inputs))


def _said(path: Path, tool_folders: Sequence[Path]) -> tuple[str | None, float | None]:
    """Return why a document is flagged, and by how much in µm the tool misses it."""
    try:
        document, _ = load_annotation(path)
        tool = tool_of(document, tool_folders)
        fit = fit_document(completed(document, tool), tool)
    except UserError:
        return None, None
    return document.flag, fit.rms_um if fit is not None else None


def _settled(folder: Path, volume: str, method: Method, tool_folders: Sequence[Path]) -> Settled:
    study = study_folder_of(folder / "annotations")
    if study is None:
        return "no"
    path = study / "annotations" / CONSENSUS / AnnotationName(volume, method).file_name
    try:
        document = load_annotation(path)[0]
    except UserError:
        return "no"
    if document.status != "done":
        return document.status
    try:
        tool = tool_of(document, tool_folders)
    except UserError:
        return "done"
    now = Consensus({}, read_opinions(study, volume, method, tool)).contributions(path)
    return "stale" if changed_since(document, now) else "done"
