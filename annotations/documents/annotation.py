"""The annotation document: one volume, one annotator, one method. Frozen; changed only by `edits`."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from annotations import __version__
from annotations.documents.provenance import Contribution, Derivation, PredictionOrigin, Stamps, Viewing
from annotations.documents.record import Method, Moment, Record, Status, Truth, UsablePath, changed, now
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, is_inside
from annotations.geometry.rotations import Quaternion, quaternion
from annotations.geometry.tool import Finite, NonNegative, Positive, ToolSpecification

State = Literal["placed", "occluded", "out_of_view", "unplaced"]
Certainty = Literal["sure", "unsure"]
Source = Literal[
    "clicked",
    "typed",
    "dragged",
    "nudged",
    "snapped",
    "posed",
    "refined",
    "derived",
    "fitted",
    "predicted",
    "synthesized",
    "consensus",
    "adopted",
]

SCHEMA: Literal["oct-annotation/1"] = "oct-annotation/1"

PositionUm = tuple[Finite, Finite, Finite]
Length = Annotated[int, Field(gt=0, strict=True)]
RepeatNumber = Annotated[int, Field(ge=0, strict=True)]
LONGEST_FLAG = 500
FlagText = Annotated[str, Field(min_length=1, max_length=LONGEST_FLAG)]


class VolumeReference(Record):
    """The volume that a document speaks of.

    Attributes
    ----------
    path : str
        Relative to the document's folder where possible, with forward slashes.
    dataset : str or None
        Member of a file that holds several arrays.
    shape : (int, int, int)
        Voxels along axes 0, 1, 2.
    dtype : str
        Type of the stored values, as numpy names it.
    spacing_um : (float, float, float)
        Spacing in µm with which the annotation was made.
    fingerprint : str
        What volumes are matched by, see `annotations.volumes.fingerprint`.
    """

    path: UsablePath
    dataset: str | None = None
    shape: tuple[Length, Length, Length]
    dtype: str
    spacing_um: tuple[Positive, Positive, Positive]
    fingerprint: str

    def contains(self, position_um: Vector) -> bool:
        """Say whether a position in µm lies inside the volume."""
        return is_inside(position_um, self.shape, self.spacing_um)


class KeypointAnnotation(Record):
    """One keypoint: absent positions are absent, never (0, 0, 0); positions outside the volume are legal.

    Attributes
    ----------
    position_um : (float, float, float) or None
        In the volume's frame; None for the state ``unplaced`` and for no other.
    source : str or None
        How the position came about; None where there is none.
    adopted_from : str or None
        The annotator whose position a reviewer took as it was, or the checkpoint whose prediction was
        accepted; for the source ``adopted`` and for no other.
    locked : bool
        Refuses every change of position or state until unlocked.
    """

    name: str
    state: State = "unplaced"
    position_um: PositionUm | None = None
    certainty: Certainty = "sure"
    source: Source | None = None
    adopted_from: str | None = None
    locked: Truth = False

    @model_validator(mode="after")
    def _check_position(self) -> Self:
        check_position(self.name, self.state, self.position_um, self.source)
        _check_adoption(self)
        return self

    @property
    def anchor_um(self) -> Vector | None:
        """Where to look for it, in µm: its position; None where it has none."""
        return self.position_um


class BoxAnnotation(Record):
    """One oriented box on a link; its own +x runs along the link towards the tip, +y is the hinge axis.

    Attributes
    ----------
    link : str
        The link that it stands for.
    center_um : (float, float, float) or None
        In the volume's frame; absent, as are size and rotation, for the state ``unplaced`` alone.
    size_um : (float, float, float) or None
        Length, width and height along the box's own axes.
    rotation_wxyz : (float, float, float, float) or None
        Unit quaternion, w ≥ 0.
    source, adopted_from, locked
        As for a keypoint.
    """

    link: str
    state: State = "unplaced"
    center_um: PositionUm | None = None
    size_um: tuple[Positive, Positive, Positive] | None = None
    rotation_wxyz: Annotated[Quaternion, AfterValidator(quaternion)] | None = None
    certainty: Certainty = "sure"
    source: Source | None = None
    adopted_from: str | None = None
    locked: Truth = False

    @model_validator(mode="after")
    def _check_placement(self) -> Self:
        parts = (self.center_um, self.size_um, self.rotation_wxyz, self.source)
        if any((part is None) != (self.state == "unplaced") for part in parts):
            raise ValueError(
                f"box {self.link!r} is {self.state}: center_um, size_um, rotation_wxyz and source must be "
                + ("absent" if self.state == "unplaced" else "there")
            )
        _check_adoption(self)
        return self

    @property
    def name(self) -> str:
        """The link's name, by which it is known among the document's parts."""
        return self.link

    @property
    def box(self) -> Box | None:
        """The box itself; None where it is unplaced."""
        if self.center_um is None or self.size_um is None or self.rotation_wxyz is None:
            return None
        return Box(self.center_um, self.size_um, self.rotation_wxyz)

    @property
    def anchor_um(self) -> Vector | None:
        """Where to look for it, in µm: its centre; None where it is unplaced."""
        return self.center_um


def check_position(name: str, state: State, position_um: Vector | None, source: str | None) -> None:
    """Raise a ValueError if a keypoint lacks what its state needs, or has too much, for a validator."""
    if (state == "unplaced") != (position_um is None):
        raise ValueError(
            f"keypoint {name!r} is {state} "
            + ("but has a position_um" if state == "unplaced" else "but has no position_um")
        )
    if (position_um is None) != (source is None):
        raise ValueError(f"keypoint {name!r} needs a source if, and only if, it has a position_um")


def _check_adoption(part: "KeypointAnnotation | BoxAnnotation") -> None:
    if (part.source == "adopted") != (part.adopted_from is not None):
        raise ValueError(f"{part.name!r} needs adopted_from if, and only if, its source is 'adopted'")


Part = KeypointAnnotation | BoxAnnotation
"""What a person places, one by one: keypoints or boxes, as the document's method says."""


def refuse_repeats(kind: str, names: Sequence[str]) -> None:
    """Raise an error about the first name that stands more than once, for a validator of a document."""
    if len(set(names)) == len(names):
        return
    seen: set[str] = set()
    for index, name in enumerate(names):
        if name in seen:
            # The index tells the reader of a file which line it is.
            raise PydanticCustomError(
                "repeated",
                "{kind} {name} stands more than once",
                {"kind": kind, "name": repr(name), "index": index},
            )
        seen.add(name)


def _each_keypoint_once(keypoints: tuple[KeypointAnnotation, ...]) -> tuple[KeypointAnnotation, ...]:
    refuse_repeats("keypoint", [keypoint.name for keypoint in keypoints])
    return keypoints


def _each_link_once(boxes: tuple[BoxAnnotation, ...]) -> tuple[BoxAnnotation, ...]:
    refuse_repeats("the box of link", [box.link for box in boxes])
    return boxes


def check_tool_copy(tool: str, tool_fingerprint: str | None, tool_copy: ToolSpecification | None) -> None:
    """Raise a ValueError if a document's copy of a tool is not the tool that it names, for a validator."""
    if tool_copy is None:
        return
    if tool_copy.name != tool:
        raise ValueError(f"tool is {tool!r}, but tool_copy is {tool_copy.name!r}")
    if tool_fingerprint not in (None, tool_copy.fingerprint):
        raise ValueError("tool_copy is not the specification that tool_fingerprint names")


class Annotation(Record):
    """An annotation document.

    Attributes
    ----------
    tool : str
        Name of the tool specification; ``tool_fingerprint`` pins its content, and ``tool_copy`` is the
        specification itself where it does not ship with the program.
    keypoints : tuple of KeypointAnnotation
        In the tool's order, for the method ``keypoints``; those of a document of boxes follow from its boxes
        (`annotations.documents.representations`) and are not stored.
    boxes : tuple of BoxAnnotation
        One a link at most, for the method ``boxes``.
    repeat : int
        Which of the annotator's passes over the volume this is; 0 for the first, and where there is one.
    flag : str or None
        Why somebody should look at this volume, in the annotator's words; None where nothing is the matter.
    derived_from : Derivation or None
        The document of the other method that this one was made from.
    predicted_from : PredictionOrigin or None
        The prediction that it was begun from.
    consensus_of : tuple of Contribution
        The annotations that a consensus was made from; empty for a person's own annotation.
    created, modified : datetime
        UTC. ``modified`` and ``program`` are stamped when the file is written; they are no edits.
    active_seconds, viewings, reopened, reviewer, reviewed
        See `Stamps`: also stamped, also no edits.
    program : str
        Version of the program that wrote the file.
    """

    schema_id: Literal["oct-annotation/1"] = Field(default=SCHEMA, alias="schema")
    volume: VolumeReference
    tool: str
    tool_fingerprint: str | None = None
    tool_copy: ToolSpecification | None = None
    annotator: str
    method: Method
    status: Status = "in_progress"
    keypoints: Annotated[tuple[KeypointAnnotation, ...], AfterValidator(_each_keypoint_once)] = ()
    boxes: Annotated[tuple[BoxAnnotation, ...], AfterValidator(_each_link_once)] = ()
    repeat: RepeatNumber = 0
    flag: FlagText | None = None
    derived_from: Derivation | None = None
    predicted_from: PredictionOrigin | None = None
    consensus_of: tuple[Contribution, ...] = ()
    created: Moment
    modified: Moment
    active_seconds: NonNegative = 0.0
    viewings: tuple[Viewing, ...] = ()
    reopened: Moment | None = None
    reviewer: str | None = None
    reviewed: Moment | None = None
    program: str = __version__

    @model_validator(mode="after")
    def _check_tool(self) -> Self:
        check_tool_copy(self.tool, self.tool_fingerprint, self.tool_copy)
        return self

    @model_validator(mode="after")
    def _check_method(self) -> Self:
        others: tuple[Part, ...] = self.boxes if self.method == "keypoints" else self.keypoints
        stray = next((part for part in others if part.state != "unplaced"), None)
        if stray is not None:
            raise ValueError(
                f"the method is {self.method!r}, so {stray.name!r} cannot be placed as well: "
                "the other representation is derived, and kept in a file of its own"
            )
        return self

    @property
    def begun_from(self) -> tuple[str, ...]:
        """Names of the checkpoints from whose predictions it was begun, or one of those it was made from."""
        own = () if self.predicted_from is None else (self.predicted_from.checkpoint,)
        others = (each.predicted_from for each in self.consensus_of if each.predicted_from is not None)
        return tuple(dict.fromkeys((*own, *others)))

    @property
    def stamps(self) -> Stamps:
        """What the file says of the work on the document, apart from its edits."""
        return Stamps(
            active_seconds=self.active_seconds,
            viewings=self.viewings,
            reopened=self.reopened,
            reviewer=self.reviewer,
            reviewed=self.reviewed,
        )

    @property
    def is_blind(self) -> bool:
        """Whether its author had seen nobody else's work on the volume when it was made."""
        return self.reopened is None and all(viewing.status == "done" for viewing in self.viewings)

    @property
    def parts(self) -> tuple[Part, ...]:
        """What a person places: the keypoints or the boxes, as the method says."""
        return self.keypoints if self.method == "keypoints" else self.boxes

    def part(self, name: str) -> Part:
        """Return the keypoint, or the box of the link, of that name; KeyError if the document has none."""
        for part in self.parts:
            if part.name == name:
                return part
        raise KeyError(name)

    def keypoint(self, name: str) -> KeypointAnnotation:
        """Return the keypoint of that name; KeyError if the document has none."""
        for keypoint in self.keypoints:
            if keypoint.name == name:
                return keypoint
        raise KeyError(name)

    @property
    def positions_um(self) -> Mapping[str, Vector]:
        """Positions in µm of the keypoints that are stored with one, by name."""
        return {
            keypoint.name: keypoint.position_um
            for keypoint in self.keypoints
            if keypoint.position_um is not None
        }

    @property
    def placed_boxes(self) -> Mapping[str, Box]:
        """The boxes that are placed, by their links."""
        return {part.link: part.box for part in self.boxes if part.box is not None}


def new_annotation(
    volume: VolumeReference,
    tool: ToolSpecification,
    annotator: str,
    method: Method,
    *,
    ships: bool,
    repeat: int = 0,
) -> Annotation:
    """Return a fresh document in which every keypoint of the tool, or every link's box, is unplaced.

    Parameters
    ----------
    ships : bool
        Whether the tool comes with the program; if not, a copy of it travels with the document.
    repeat : int
        Which of the annotator's passes over the volume it is.
    """
    moment = now()
    fresh = Annotation(
        volume=volume,
        tool=tool.name,
        tool_fingerprint=tool.fingerprint,
        tool_copy=None if ships else tool,
        annotator=annotator,
        method=method,
        repeat=repeat,
        created=moment,
        modified=moment,
    )
    return with_all_parts(fresh, tool)


def with_all_parts(annotation: Annotation, tool: ToolSpecification) -> Annotation:
    """Return the document with each keypoint, or each link's box, of the tool: absent ones are unplaced.

    They come in the tool's order; what the tool does not have is dropped.
    """
    if annotation.method == "keypoints":
        points = {keypoint.name: keypoint for keypoint in annotation.keypoints}
        keypoints = tuple(points.get(name, KeypointAnnotation(name=name)) for name in tool.keypoint_names)
        boxes: tuple[BoxAnnotation, ...] = ()
    else:
        known = {box.link: box for box in annotation.boxes}
        boxes = tuple(known.get(link.name, BoxAnnotation(link=link.name)) for link in tool.links)
        keypoints = ()
    if (keypoints, boxes) == (annotation.keypoints, annotation.boxes):
        return annotation
    return changed(annotation, keypoints=keypoints, boxes=boxes)


def is_untouched(annotation: Annotation) -> bool:
    """Say whether nobody has put anything into a document yet."""
    is_empty = not annotation.consensus_of and annotation.flag is None and annotation.status == "in_progress"
    return is_empty and all(part.anchor_um is None and not part.locked for part in annotation.parts)


def stamped(annotation: Annotation, stamps: Stamps) -> Annotation:
    """Return the document with what its file is to say of the work on it."""
    if annotation.stamps == stamps:
        return annotation
    return changed(
        annotation,
        active_seconds=stamps.active_seconds,
        viewings=stamps.viewings,
        reopened=stamps.reopened,
        reviewer=stamps.reviewer,
        reviewed=stamps.reviewed,
    )


def without_stamps(annotation: Annotation) -> Annotation:
    """Return the document as if just created, so that equal content is equal whenever it was written."""
    return changed(stamped(annotation, Stamps()), modified=annotation.created, program=__version__)
