"""The session's deriving: the document of the other method, beside the one that it follows from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from annotations.documents.annotation import Annotation
from annotations.documents.conversion import keypoints_without_box, sibling_path, to_boxes, to_keypoints
from annotations.documents.files import DocumentError, save_annotation
from annotations.documents.record import Method
from annotations.errors import UserError
from annotations.geometry.box_conversion import RollUnknown, boxes_from_keypoints
from annotations.geometry.boxes import hinge_axes
from annotations.geometry.frames import Vector, vector
from annotations.geometry.targets import pose_targets
from annotations.geometry.tool import ToolSpecification
from annotator.session.state import SessionState


@dataclass(frozen=True)
class Derived:
    """A document that was derived, and the keypoints that have no place in it."""

    path: Path
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class RollMeaning:
    """What boxes that are derived with a roll would say.

    Attributes
    ----------
    roll_deg : float
        Of the box of the first link.
    hinge_axis : (float, float, float)
        That box's own +y, a unit vector in the volume's frame.
    angles_deg : mapping of str to float
        The signed angles, by the names of their targets.
    """

    roll_deg: float
    hinge_axis: Vector
    angles_deg: Mapping[str, float]


class Deriving(QObject):
    """Makes a new, marked document of the other method from the open one, and has it opened; that one stays.

    Parameters
    ----------
    begin : callable
        Saves what is open; False where that failed, or nothing can be changed.
    follow : callable
        Opens the open volume's document of a method.

    Signals
    -------
    roll_requested : RollUnknown
        The keypoints do not show the roll of the boxes to be derived: answer with `derive`.
    """

    roll_requested = Signal(object)

    def __init__(
        self,
        session: SessionState,
        begin: Callable[[], bool],
        follow: Callable[[Method], None],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._begin = begin
        self._follow = follow
        self._path: Path | None = None
        self._words = ""
        session.worklist_changed.connect(self._on_session_worklist_changed)

    def derive(self, roll_deg: float | None = None) -> None:
        """Derive from the open document; ``roll_requested`` may come instead, to be answered with a roll."""
        session = self._session
        if not self._begin():
            return
        document, tool, original = session.document, session.tool, session.annotation_path
        if document is None or tool is None or original is None:
            return
        method: Method = "boxes" if document.method == "keypoints" else "keypoints"
        if method not in session.methods:
            session.post_message(f"This study is annotated by {document.method} alone")
            return
        try:
            derived = write_derived(document, tool, original, method, roll_deg)
        except RollUnknown as error:
            self.roll_requested.emit(error)
        except UserError as error:
            session.report(error)
        else:
            left_out = f"; without {', '.join(derived.left_out)}" if derived.left_out else ""
            words = f"{derived.path.name} follows from {original.name}, which stays"
            if session.is_blind:
                words = f"The {method} follow from the {document.method}, which stay"
            # To be said once it is open: until then a message is about the other document.
            self._path, self._words = derived.path, f"{words}{left_out}"
            self._follow(method)

    def _on_session_worklist_changed(self) -> None:
        if self._path is not None and self._session.annotation_path == self._path:
            self._path = None
            self._session.post_message(self._words)


def roll_meanings(
    document: Annotation, tool: ToolSpecification, unknown: RollUnknown
) -> tuple[RollMeaning, ...]:
    """Return what each of the rolls in question would mean; empty where nothing shows the roll."""
    meanings = []
    for roll_deg in unknown.candidates_deg:
        boxes = boxes_from_keypoints(document.positions_um, tool, roll_deg=roll_deg)
        targets = pose_targets(document.positions_um, tool, hinge_axes(boxes, tool))
        hinge_axis = vector(boxes[unknown.link].axes[:, 1])
        meanings.append(RollMeaning(roll_deg, hinge_axis, targets.signed_angles_deg))
    return tuple(meanings)


def write_derived(
    document: Annotation, tool: ToolSpecification, original: Path, method: Method, roll_deg: float | None
) -> Derived:
    """Write the derived document of a method.

    Raises
    ------
    DocumentError
        There is one of that method already, which is untouched; or the original's folder was moved.
    ConversionRefused
        Nothing of that method would follow.
    RollUnknown
        The keypoints do not show the boxes' roll, and none is given.
    SaveError
        It cannot be written.
    """
    path = sibling_path(original, method)
    if path.exists():
        raise DocumentError(
            f"this volume has an annotation by {method} already",
            where=path,
            remedy="Open it by that method, or move its file away to derive a new one",
        )
    if method == "boxes":
        derived = to_boxes(document, tool, original=original, derived=path, roll_deg=roll_deg)
    else:
        derived = to_keypoints(document, tool, original=original, derived=path)
    if not original.parent.is_dir():
        raise DocumentError(
            "the annotation that it would follow from is not there any more",
            where=original,
            remedy="Open the study or folder where it is now",
        )
    save_annotation(derived, path, expected="")
    left_out = keypoints_without_box(document, derived, tool) if method == "boxes" else []
    return Derived(path, tuple(left_out))
