"""Tool specifications: which keypoints, links and joints an instrument has, and which targets follow."""

import hashlib
import json
import math
import re
from collections.abc import Iterable, Sequence
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from annotations.errors import UserError

# Strict: a file that says "5" or true where a number belongs is wrong, and nobody should have to guess.
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Finite, Field(gt=0)]
NonNegative = Annotated[Finite, Field(ge=0)]


def _plain_name(value: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", value):
        raise ValueError(
            f"a name holds letters, digits, '_', '-' and '.', and begins with a letter or digit: {value!r}"
        )
    return value


def _hex_color(value: str) -> str:
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", value):
        raise ValueError(f"a colour is written #rrggbb, not {value!r}")
    return value.lower()


Name = Annotated[str, AfterValidator(_plain_name)]
Color = Annotated[str, AfterValidator(_hex_color)]


class ToolError(UserError):
    """A tool specification that is absent, ambiguous or wrong."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", serialize_by_alias=True)


class Keypoint(_Part):
    """A named point of the tool, with a label that says to an annotator where it is."""

    name: Name
    label: str = ""


class Link(_Part):
    """A rigid part between two keypoints, from the base towards the tip.

    Attributes
    ----------
    base, tip : str
        The keypoints at the ends of the link's axis.
    length_um : float
        Nominal distance between them, in µm.
    cross_section_um : (float, float)
        Width and height in µm along the link's own y and z.
    color : str
        ``#rrggbb``, the link's colour in every view.
    """

    name: Name
    base: str
    tip: str
    length_um: Positive
    cross_section_um: tuple[Positive, Positive]
    color: Color

    @property
    def is_round(self) -> bool:
        """Whether the link's body is a cylinder; one that is wider than high, or the reverse, is a block."""
        width, height = self.cross_section_um
        return width == height


class Joint(_Part):
    """A hinge between two links.

    Attributes
    ----------
    name : str
        Also the name of the joint's angle, such as ``theta1``.
    parent, child : str
        The links it connects; the child turns.
    hinge_axis : (float, float, float)
        Unit vector of the hinge in the parent's own frame (+x along the link towards the tip).
    limits_deg : (float, float)
        Smallest and largest signed angle.
    offsets_um : (float, float)
        Distance from the parent's tip to the hinge and from the hinge to the child's base, along the links.
    """

    name: Name
    parent: str
    child: str
    hinge_axis: tuple[Finite, Finite, Finite] = (0.0, 1.0, 0.0)
    limits_deg: tuple[Finite, Finite]
    offsets_um: tuple[NonNegative, NonNegative] = (0.0, 0.0)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if abs(math.hypot(*self.hinge_axis) - 1) > 1e-6:
            raise ValueError("hinge_axis must be a unit vector")
        if not -180 <= self.limits_deg[0] < self.limits_deg[1] <= 180:
            raise ValueError("limits_deg must be two angles in [-180, 180], the smaller first")
        return self


class AngleTarget(_Part):
    """The angle between two links, named after the joint between them."""

    name: Name
    first: str
    second: str


class Targets(_Part):
    """Which parts of the tool give the pose targets; what a tool lacks is absent everywhere.

    Attributes
    ----------
    position : tuple of str
        The keypoints whose mean is the position.
    orientation : (str, str) or None
        The keypoints from which and to which the direction runs.
    angles : tuple of AngleTarget
        Pairs of links whose angle is a target.
    """

    position: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    orientation: tuple[str, str] | None = None
    angles: tuple[AngleTarget, ...] = ()


class ToolSpecification(_Part):
    """An instrument as data: its keypoints from base to tip, links, joints and targets."""

    schema_id: Literal["oct-tool/1"] = Field(alias="schema")
    name: Name
    title: str = ""
    keypoints: Annotated[tuple[Keypoint, ...], Field(min_length=1)]
    links: tuple[Link, ...] = ()
    joints: tuple[Joint, ...] = ()
    targets: Targets = Targets()

    @property
    def keypoint_names(self) -> tuple[str, ...]:
        """Names of the keypoints, in the order in which they are annotated."""
        return tuple(keypoint.name for keypoint in self.keypoints)

    @property
    def fingerprint(self) -> str:
        """SHA-256, as hexadecimal digits, of the specification's content."""
        # Without defaults, so that a field that a later version adds leaves old fingerprints as they are.
        content = self.model_dump(mode="json", exclude_defaults=True)
        text = json.dumps(content, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def root(self) -> Link | None:
        """The first link that is no child of a joint; a pose places it. None where the tool has no links."""
        children = {joint.child for joint in self.joints}
        return next((link for link in self.links if link.name not in children), None)

    def link(self, name: str) -> Link:
        """Return the link of that name; KeyError if the tool has none."""
        for link in self.links:
            if link.name == name:
                return link
        raise KeyError(name)

    def link_of(self, keypoint: str) -> Link | None:
        """Return the first link that ends at a keypoint, or None."""
        return next((link for link in self.links if keypoint in (link.base, link.tip)), None)

    @model_validator(mode="after")
    def _check_references(self) -> Self:
        points = self.keypoint_names
        links = [link.name for link in self.links]
        _refuse_repeats("keypoint", points)
        _refuse_repeats("link", links)
        _refuse_repeats("joint", [joint.name for joint in self.joints])
        _refuse_repeats("child of a joint", [joint.child for joint in self.joints])
        for link in self.links:
            _require(f"link {link.name}", (link.base, link.tip), points)
            if link.base == link.tip:
                raise ValueError(f"link {link.name} begins and ends at {link.base}")
        for joint in self.joints:
            _require(f"joint {joint.name}", (joint.parent, joint.child), links)
        self._check_chain()
        _require("targets.position", self.targets.position or (), points)
        _require("targets.orientation", self.targets.orientation or (), points)
        _refuse_repeats("angle target", [angle.name for angle in self.targets.angles])
        ends = {joint.name: (joint.parent, joint.child) for joint in self.joints}
        for angle in self.targets.angles:
            pair = (angle.first, angle.second)
            _require(f"target {angle.name}", pair, links)
            if ends.get(angle.name, pair) != pair:
                raise ValueError(
                    f"target {angle.name} is the angle from {angle.first} to {angle.second}, "
                    f"but the joint of that name is between {' and '.join(ends[angle.name])}"
                )
        return self

    def _check_chain(self) -> None:
        parent_of = {joint.child: joint.parent for joint in self.joints}
        for start in parent_of:
            seen, link = {start}, start
            while link in parent_of:
                link = parent_of[link]
                if link in seen:
                    raise ValueError(f"the joints form a circle through link {link}")
                seen.add(link)


def _refuse_repeats(kind: str, names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{kind} {name!r} stands more than once")


def _require(user: str, wanted: Iterable[str], known: Sequence[str]) -> None:
    for name in wanted:
        if name not in known:
            raise ValueError(f"{user} names {name!r}, which is not among {', '.join(known) or 'none'}")
