"""What a consensus that is proposed changes, in numbers and in words, and which volumes need one first."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from annotations.documents.annotation import Annotation
from annotations.documents.permission import permission
from annotations.documents.record import Method
from annotations.documents.study import Study

if TYPE_CHECKING:
    from annotations.agreement.triage import TriageEntry

_LEAST_UM = 0.5


def ranked(
    study: Study,
    folder: Path,
    person: str,
    method: Method,
    tool_folders: tuple[Path, ...],
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> "tuple[TriageEntry, ...]":
    """Return the volumes of a study that a person may see, those that need a reviewer most first."""
    from annotations.agreement.comparison import agreement_of  # late: few sessions compare
    from annotations.agreement.triage import triage

    agreement = agreement_of(
        folder, tool_folders, progress=lambda share: progress(share / 2), cancelled=cancelled
    )
    if method not in agreement.methods:
        return ()
    entries = triage(
        agreement,
        method,
        folder,
        tool_folders,
        progress=lambda share: progress((1 + share) / 2),
        cancelled=cancelled,
    )
    return tuple(each for each in entries if permission(study, folder, person, each.volume).may_see)


def moved_um(before: Annotation, after: Annotation) -> Mapping[str, float]:
    """Return how far, in whole µm at least, each part went that was placed before and after."""
    from annotations.agreement.consensus import distance_um  # late: few sessions settle

    moved = {part.name: distance_um(before.part(part.name), part) for part in after.parts}
    return {name: um for name, um in moved.items() if um is not None and um >= _LEAST_UM}


def said_of_proposal(before: Annotation, moved_um: Mapping[str, float]) -> str:
    """Say what a proposal did, where there was one before."""
    if not before.consensus_of:
        return "Proposed: nothing is saved before you change or accept it"
    moved = ", ".join(f"{name} by {um:,.0f} µm" for name, um in moved_um.items())
    again = "; it is to be accepted anew" if before.status == "done" else ""
    return f"Proposed again: {f'moved {moved}' if moved else 'nothing has moved'}{again}"
