"""What follows from what is placed, as numbers and words: pose targets, link lengths, distances."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from annotations.documents.annotation import Annotation
from annotations.documents.representations import document_targets, keypoint_positions_um, keypoints_of
from annotations.fitting.evidence import part_sigma_um
from annotations.fitting.plausibility import Plausibility, length_plausibility
from annotations.geometry.targets import PoseTargets
from annotations.geometry.tool import ToolSpecification
from annotator.looks.angles import angle_title, signed_text

_NARROW = "\N{NARROW NO-BREAK SPACE}"
_MINUS = "\N{MINUS SIGN}"
# By more a signed angle cannot differ in size from the unsigned one because somebody clicked a little off.
_CONTRADICTION_DEG = 5.0


@dataclass(frozen=True)
class Reading:
    """One pose target.

    Attributes
    ----------
    name : str
        Stable, as in exported tables: ``position_um``, ``orientation``, ``theta1_deg``.
    title : str
        For a person.
    values : tuple of float
        Empty where the target is not known.
    texts : tuple of str
        One line or two for a person.
    missing : str
        Why it is not known: ``needs k2, k3``.
    signed_deg : float or None
        Of an angle, where the hinge axis is known.
    doubt : str
        The signed angle, with what speaks against it, where it contradicts the unsigned one.
    """

    name: str
    title: str
    values: tuple[float, ...] = ()
    texts: tuple[str, ...] = ()
    missing: str = ""
    signed_deg: float | None = None
    doubt: str = ""


@dataclass(frozen=True)
class LinkLength:
    """A link's length as annotated, beside its nominal one; None where an end is missing.

    Attributes
    ----------
    plausibility : str
        Whether what clicks are off, and lengths that nobody has calibrated, explain the difference.
    """

    link: str
    ends: tuple[str, str]
    color: str
    nominal_um: float
    measured_um: float | None
    plausibility: Plausibility = "plausible"

    @property
    def deviation(self) -> float | None:
        """Measured over nominal length, less one."""
        return None if self.measured_um is None else self.measured_um / self.nominal_um - 1


@dataclass(frozen=True)
class PoseReadout:
    """Everything that the pose panel shows.

    Attributes
    ----------
    targets : tuple of Reading
    links : tuple of LinkLength
    names : tuple of str
        Keypoints, in the tool's order.
    distances_um : mapping of (str, str) to float
        Between each pair of keypoints with positions, in the order of ``names``.
    provenance : tuple of (str, str, str)
        Name, state and source of each keypoint or box: what is computed must not pass for what was seen.
    """

    targets: tuple[Reading, ...]
    links: tuple[LinkLength, ...]
    names: tuple[str, ...]
    distances_um: Mapping[tuple[str, str], float]
    provenance: tuple[tuple[str, str, str], ...] = ()

    def table(self) -> str:
        """Return all as tab-separated text, one quantity a line, with units in the names."""
        lines = ["quantity\tvalue"]
        for reading in self.targets:
            columns = (
                [reading.name] if len(reading.values) < 2 else [f"{reading.name}_{axis}" for axis in "xyz"]
            )
            texts = [_plain(value) for value in reading.values] or [""]
            lines += [f"{column}\t{text}" for column, text in zip(columns, texts, strict=True)]
            if reading.signed_deg is not None:
                lines.append(f"{reading.name.removesuffix('_deg')}_signed_deg\t{_plain(reading.signed_deg)}")
        for link in self.links:
            lines.append(f"length_{link.link}_um\t{_plain(link.measured_um)}")
            lines.append(f"nominal_length_{link.link}_um\t{_plain(link.nominal_um)}")
        lines += [
            f"distance_{first}_{second}_um\t{_plain(distance)}"
            for (first, second), distance in self.distances_um.items()
        ]
        for name, state, source in self.provenance:
            lines += [f"state_{name}\t{state}", f"source_{name}\t{source}"]
        return "\n".join(lines) + "\n"


def pose_readout(document: Annotation, tool: ToolSpecification) -> PoseReadout:
    """Compute what follows from the keypoints of a document of either method."""
    positions_um = keypoint_positions_um(document, tool)
    points = {name: np.asarray(positions_um[name]) for name in tool.keypoint_names if name in positions_um}
    distances_um = {
        (first, second): float(np.linalg.norm(points[first] - points[second]))
        for first, second in combinations(points, 2)
    }
    return PoseReadout(
        _readings(document, tool),
        _lengths(document, tool),
        tool.keypoint_names,
        distances_um,
        tuple((part.name, part.state, part.source or "") for part in document.parts),
    )


def _lengths(document: Annotation, tool: ToolSpecification) -> tuple[LinkLength, ...]:
    keypoints = {keypoint.name: keypoint for keypoint in keypoints_of(document, tool)}
    lengths = []
    for link in tool.links:
        nominal = LinkLength(link.name, (link.base, link.tip), link.color, link.length_um, None)
        ends = [keypoints[name] for name in nominal.ends if name in keypoints]
        places_um = [end.position_um for end in ends if end.position_um is not None]
        if len(places_um) == 2:
            measured_um = math.dist(*places_um)
            judged = length_plausibility(measured_um, link, map(part_sigma_um, ends))
            nominal = replace(nominal, measured_um=measured_um, plausibility=judged)
        lengths.append(nominal)
    return tuple(lengths)


def _readings(document: Annotation, tool: ToolSpecification) -> tuple[Reading, ...]:
    targets = document_targets(document, tool)
    readings = []
    if tool.targets.position is not None:
        readings.append(_position(targets, _absent(tool.targets.position, document, tool)))
    if tool.targets.orientation is not None:
        ends = tool.targets.orientation
        readings.append(_orientation(targets, ends, _absent(ends, document, tool)))
    for angle in tool.targets.angles:
        links = [tool.link(angle.first), tool.link(angle.second)]
        corners = [end for link in links for end in (link.base, link.tip)]
        hinged = next((joint.parent for joint in tool.joints if joint.name == angle.name), angle.first)
        readings.append(_angle(targets, angle.name, hinged, _absent(corners, document, tool)))
    return tuple(readings)


def _position(targets: PoseTargets, absent: Sequence[str]) -> Reading:
    name, title = "position_um", "Position"
    if targets.position_um is None:
        return Reading(name, title, missing=_needs(absent))
    um = "  ".join(f"{value:z.1f}" for value in targets.position_um)
    mm = "  ".join(f"{value / 1000:z.3f}" for value in targets.position_um)
    return Reading(name, title, targets.position_um, (f"{um}{_NARROW}µm", f"{mm}{_NARROW}mm"))


def _orientation(targets: PoseTargets, ends: tuple[str, str], absent: Sequence[str]) -> Reading:
    name, title = "orientation", "Orientation"
    if targets.orientation is None:
        return Reading(name, title, missing=_needs(absent) or f"{ends[0]} and {ends[1]} are at one place")
    text = "  ".join(f"{value:z.4f}" for value in targets.orientation)
    return Reading(name, title, targets.orientation, (text,))


def _angle(targets: PoseTargets, angle: str, hinged: str, absent: Sequence[str]) -> Reading:
    """Write an angle; ``hinged`` is the link whose box has the hinge."""
    name, title = f"{angle}_deg", angle_title(angle)
    if angle not in targets.angles_deg:
        return Reading(name, title, missing=_needs(absent) or "the ends of a link are at one place")
    value, signed_deg = targets.angles_deg[angle], targets.signed_angles_deg.get(angle)
    text = f"{value:.2f}°"
    if signed_deg is None:
        return Reading(name, title, (value,), (text,))
    signed = f"signed {signed_text(signed_deg, 2)}"
    if abs(abs(signed_deg) - value) > _CONTRADICTION_DEG:
        doubt = f"{signed}: the hinge of {hinged}'s box is not across the bend, see Check"
        return Reading(name, title, (value,), (text,), signed_deg=signed_deg, doubt=doubt)
    return Reading(name, title, (value,), (f"{text}   {signed}",), signed_deg=signed_deg)


def with_titles(text: str, tool: ToolSpecification) -> str:
    """Write the names of joints and the minus signs in a sentence as everywhere in the window."""
    text = re.sub(r"-(?=\d)", _MINUS, text)
    for joint in tool.joints:
        text = text.replace(joint.name, angle_title(joint.name))
    return text


def _absent(names: Sequence[str], document: Annotation, tool: ToolSpecification) -> list[str]:
    """Return what still has to be placed: keypoints, or the links whose boxes give them."""
    known = keypoint_positions_um(document, tool)
    absent = [name for name in names if name not in known]
    if document.method == "keypoints":
        return absent
    links = [(name, tool.link_of(name)) for name in absent]
    return list(dict.fromkeys(link.name if link is not None else name for name, link in links))


def _needs(absent: Sequence[str]) -> str:
    return f"needs {', '.join(absent)}" if absent else ""


def _plain(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"
