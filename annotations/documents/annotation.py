"""The annotation document: one volume, one annotator, one method. Frozen; changed only by `edits`."""

import re
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from annotations import __version__
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
]
Method = Literal["keypoints", "boxes"]
Status = Literal["in_progress", "done"]

SCHEMA: Literal["oct-annotation/1"] = "oct-annotation/1"

PositionUm = tuple[Finite, Finite, Finite]
Length = Annotated[int, Field(gt=0, strict=True)]
Flag = Annotated[bool, Field(strict=True)]


def _written_moment(value: Any) -> datetime:
    # By itself pydantic would also take a number of seconds for a time.
    try:
        return value if isinstance(value, datetime) else datetime.fromisoformat(value)
    except (TypeError, ValueError):
        raise ValueError("a time is written like 2026-11-22T05:00:00Z") from None


def _utc_second(moment: datetime) -> datetime:
    if moment.tzinfo is None:
        raise ValueError("a time must say its zone, such as 2026-11-22T05:00:00Z")
    try:
        return moment.astimezone(UTC).replace(microsecond=0)
    except OverflowError:
        raise ValueError("a time must lie in the years 1 to 9999") from None


def _in_utc(moment: datetime) -> str:
    return moment.isoformat(timespec="seconds").replace("+00:00", "Z")


Moment = Annotated[
    datetime,
    BeforeValidator(_written_moment),
    AfterValidator(_utc_second),
    PlainSerializer(_in_utc, return_type=str, when_used="json"),
]


def _usable_path(value: str) -> str:
    # Halves of surrogate pairs are legal where Python puts them for the bytes of a name that is no Unicode.
    if not value or re.search("[\0\ud800-\udc7f\udd00-\udfff]", value):
        raise ValueError("a path is not empty, and holds nothing that no file's name can hold")
    return value


def now() -> datetime:
    """Return the present moment, UTC, to the second: the resolution that files keep."""
    return datetime.now(UTC).replace(microsecond=0)


class Record(BaseModel):
    """A frozen part of a document; unknown fields are refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", validate_by_name=True, validate_by_alias=True, serialize_by_alias=True
    )


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

    path: Annotated[str, AfterValidator(_usable_path)]
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
    locked : bool
        Refuses every change of position or state until unlocked.
    """

    name: str
    state: State = "unplaced"
    position_um: PositionUm | None = None
    certainty: Certainty = "sure"
    source: Source | None = None
    locked: Flag = False

    @model_validator(mode="after")
    def _check_position(self) -> Self:
        if (self.state == "unplaced") != (self.position_um is None):
            raise ValueError(
                f"keypoint {self.name!r} is {self.state} "
                + ("but has a position_um" if self.state == "unplaced" else "but has no position_um")
            )
        if (self.position_um is None) != (self.source is None):
            raise ValueError(f"keypoint {self.name!r} needs a source if, and only if, it has a position_um")
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
    source, locked
        As for a keypoint.
    """

    link: str
    state: State = "unplaced"
    center_um: PositionUm | None = None
    size_um: tuple[Positive, Positive, Positive] | None = None
    rotation_wxyz: Annotated[Quaternion, AfterValidator(quaternion)] | None = None
    certainty: Certainty = "sure"
    source: Source | None = None
    locked: Flag = False

    @model_validator(mode="after")
    def _check_placement(self) -> Self:
        parts = (self.center_um, self.size_um, self.rotation_wxyz, self.source)
        if any((part is None) != (self.state == "unplaced") for part in parts):
            raise ValueError(
                f"box {self.link!r} is {self.state}: center_um, size_um, rotation_wxyz and source must be "
                + ("absent" if self.state == "unplaced" else "there")
            )
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


Part = KeypointAnnotation | BoxAnnotation
"""What a person places, one by one: keypoints or boxes, as the document's method says."""


class Derivation(Record):
    """From which document another one was made, whose annotator placed none of its parts.

    Attributes
    ----------
    path : str
        The file of the original, relative to the new document's folder where possible.
    method : str
        The original's.
    roll_deg : float or None
        The roll of the root link's box, where a person had to say it.
    """

    path: Annotated[str, AfterValidator(_usable_path)]
    method: Method
    roll_deg: Finite | None = None


def _refuse_repeats(kind: str, names: list[str]) -> None:
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
    _refuse_repeats("keypoint", [keypoint.name for keypoint in keypoints])
    return keypoints


def _each_link_once(boxes: tuple[BoxAnnotation, ...]) -> tuple[BoxAnnotation, ...]:
    _refuse_repeats("the box of link", [box.link for box in boxes])
    return boxes


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
    derived_from : Derivation or None
        The document of the other method that this one was made from.
    created, modified : datetime
        UTC. ``modified`` and ``active_seconds`` are stamped when the file is written; they are no edits.
    active_seconds : float
        Time that the annotator was at work on this document.
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
    derived_from: Derivation | None = None
    created: Moment
    modified: Moment
    active_seconds: NonNegative = 0.0
    program: str = __version__

    @model_validator(mode="after")
    def _check_tool(self) -> Self:
        if self.tool_copy is None:
            return self
        if self.tool_copy.name != self.tool:
            raise ValueError(f"tool is {self.tool!r}, but tool_copy is {self.tool_copy.name!r}")
        if self.tool_fingerprint not in (None, self.tool_copy.fingerprint):
            raise ValueError("tool_copy is not the specification that tool_fingerprint names")
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


R = TypeVar("R", bound=Record)


def new_annotation(
    volume: VolumeReference, tool: ToolSpecification, annotator: str, method: Method, *, ships: bool
) -> Annotation:
    """Return a fresh document in which every keypoint of the tool, or every link's box, is unplaced.

    Parameters
    ----------
    ships : bool
        Whether the tool comes with the program; if not, a copy of it travels with the document.
    """
    moment = now()
    fresh = Annotation(
        volume=volume,
        tool=tool.name,
        tool_fingerprint=tool.fingerprint,
        tool_copy=None if ships else tool,
        annotator=annotator,
        method=method,
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


def changed(record: R, **fields: Any) -> R:
    """Return a copy of a record with some fields changed, validated as if it were read from a file."""
    values = {name: getattr(record, name) for name in type(record).model_fields}
    return type(record)(**(values | fields))


def without_stamps(annotation: Annotation) -> Annotation:
    """Return the document as if just created, so that equal content is equal whenever it was written."""
    return changed(annotation, modified=annotation.created, active_seconds=0.0, program=__version__)
