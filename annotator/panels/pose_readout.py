"""What follows from the keypoints, as numbers and words: pose targets, link lengths, distances."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from annotations.geometry.frames import Vector
from annotations.geometry.targets import PoseTargets, pose_targets
from annotations.geometry.tool import ToolSpecification

_NARROW = "\N{NARROW NO-BREAK SPACE}"


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
    """

    name: str
    title: str
    values: tuple[float, ...] = ()
    texts: tuple[str, ...] = ()
    missing: str = ""


@dataclass(frozen=True)
class LinkLength:
    """A link's length as annotated, beside its nominal one; None where an end is missing."""

    link: str
    ends: tuple[str, str]
    color: str
    nominal_um: float
    measured_um: float | None

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
    """

    targets: tuple[Reading, ...]
    links: tuple[LinkLength, ...]
    names: tuple[str, ...]
    distances_um: Mapping[tuple[str, str], float]

    def table(self) -> str:
        """Return all as tab-separated text, one quantity a line, with units in the names."""
        lines = ["quantity\tvalue"]
        for reading in self.targets:
            columns = (
                [reading.name] if len(reading.values) < 2 else [f"{reading.name}_{axis}" for axis in "xyz"]
            )
            texts = [_plain(value) for value in reading.values] or [""]
            lines += [f"{column}\t{text}" for column, text in zip(columns, texts, strict=True)]
        for link in self.links:
            lines.append(f"length_{link.link}_um\t{_plain(link.measured_um)}")
            lines.append(f"nominal_length_{link.link}_um\t{_plain(link.nominal_um)}")
        lines += [
            f"distance_{first}_{second}_um\t{_plain(distance)}"
            for (first, second), distance in self.distances_um.items()
        ]
        return "\n".join(lines) + "\n"


def pose_readout(positions_um: Mapping[str, Vector], tool: ToolSpecification) -> PoseReadout:
    """Compute what follows from the keypoints that have a position in µm."""
    points = {name: np.asarray(positions_um[name]) for name in tool.keypoint_names if name in positions_um}
    distances_um = {
        (first, second): float(np.linalg.norm(points[first] - points[second]))
        for first, second in combinations(points, 2)
    }
    links = tuple(
        LinkLength(
            link.name,
            (link.base, link.tip),
            link.color,
            link.length_um,
            float(np.linalg.norm(points[link.tip] - points[link.base]))
            if link.base in points and link.tip in points
            else None,
        )
        for link in tool.links
    )
    return PoseReadout(_readings(positions_um, tool), links, tool.keypoint_names, distances_um)


def _readings(positions_um: Mapping[str, Vector], tool: ToolSpecification) -> tuple[Reading, ...]:
    targets = pose_targets(positions_um, tool)
    readings = []
    if tool.targets.position is not None:
        readings.append(_position(targets, _absent(tool.targets.position, positions_um)))
    if tool.targets.orientation is not None:
        ends = tool.targets.orientation
        readings.append(_orientation(targets, ends, _absent(ends, positions_um)))
    for angle in tool.targets.angles:
        links = [tool.link(angle.first), tool.link(angle.second)]
        corners = [end for link in links for end in (link.base, link.tip)]
        readings.append(_angle(targets, angle.name, _absent(corners, positions_um)))
    return tuple(readings)


def _position(targets: PoseTargets, absent: Sequence[str]) -> Reading:
    name, title = "position_um", "Position"
    if targets.position_um is None:
        return Reading(name, title, missing=_needs(absent))
    um = "  ".join(f"{value:.1f}" for value in targets.position_um)
    mm = "  ".join(f"{value / 1000:.3f}" for value in targets.position_um)
    return Reading(name, title, targets.position_um, (f"{um}{_NARROW}µm", f"{mm}{_NARROW}mm"))


def _orientation(targets: PoseTargets, ends: tuple[str, str], absent: Sequence[str]) -> Reading:
    name, title = "orientation", "Orientation"
    if targets.orientation is None:
        return Reading(name, title, missing=_needs(absent) or f"{ends[0]} and {ends[1]} are at one place")
    # Adding zero turns −0.0 into 0.0.
    text = "  ".join(f"{round(value, 4) + 0.0:.4f}" for value in targets.orientation)
    return Reading(name, title, targets.orientation, (text,))


def _angle(targets: PoseTargets, angle: str, absent: Sequence[str]) -> Reading:
    name, title = f"{angle}_deg", angle_title(angle)
    if angle not in targets.angles_deg:
        return Reading(name, title, missing=_needs(absent) or "the ends of a link are at one place")
    value = targets.angles_deg[angle]
    return Reading(name, title, (value,), (f"{value:.2f}°",))


def angle_title(name: str) -> str:
    """Write ``theta1`` as θ1; other names stay."""
    return f"θ{name.removeprefix('theta')}" if name.startswith("theta") else name


def _absent(names: Sequence[str], positions_um: Mapping[str, Vector]) -> list[str]:
    return [name for name in names if name not in positions_um]


def _needs(absent: Sequence[str]) -> str:
    return f"needs {', '.join(absent)}" if absent else ""


def _plain(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"
