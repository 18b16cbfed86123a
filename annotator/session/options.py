"""What a session is told when it begins: who annotates, and where things are kept."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from annotations.app_folders import cache_folder, state_folder, tool_folder
from annotations.documents.record import Method
from annotations.geometry.frames import Vector
from annotator.session.volumes.spacing_answer import SpacingAnswer


def _remember_nothing(_fingerprint: str) -> SpacingAnswer | None:
    return None


def _forget(_fingerprint: str, _answer: SpacingAnswer) -> None:
    return None


@dataclass(frozen=True)
class SessionOptions:
    """What a session is told when it begins.

    Attributes
    ----------
    annotator_name : str
        Names the folder of this person's annotations.
    tool_name : str
        The tool of volumes that belong to no study.
    method : str
        How volumes are annotated where their study does not say it: by ``keypoints`` or ``boxes``.
    spacing_override_um : (float, float, float) or None
        Said when the program was started, and so before what files say; an annotation keeps its own.
    autosave_s : float
        Seconds from an edit to the annotation's file; 0 leaves saving to the person. Journals are
        always kept.
    cache_limit_bytes : int
        Largest size of the built levels that are kept.
    remembered_spacing, remember_spacing : callable
        Where spacing answers are kept, by the volume's fingerprint, when its folder cannot be written.
    """

    annotator_name: str
    tool_name: str = "magnetic-forceps"
    method: Method = "keypoints"
    spacing_override_um: Vector | None = None
    autosave_s: float = 5.0
    cache_limit_bytes: int = 2 * 1024**3
    recovery_folder: Path = field(default_factory=lambda: state_folder() / "recovery")
    level_cache_folder: Path = field(default_factory=lambda: cache_folder() / "levels")
    user_tool_folder: Path = field(default_factory=tool_folder)
    remembered_spacing: Callable[[str], SpacingAnswer | None] = _remember_nothing
    remember_spacing: Callable[[str, SpacingAnswer], None] = _forget
