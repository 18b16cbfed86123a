"""What the data leave open about a pose, in words: nothing of it is invented, and nothing is passed over."""

import math
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass
from typing import Literal

from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool import Joint, ToolSpecification

Kind = Literal["roll", "sense", "angle", "direction", "place"]

_SHOWN_DEG = 2.0
"""Angles that differ by less are not worth a word."""


@dataclass(frozen=True)
class OpenQuestion:
    """One thing that the data leave open.

    Attributes
    ----------
    kind : str
        ``roll`` about the root link's own axis; ``sense``: two signs of a joint's angle fit alike; ``angle``
        of a joint; ``direction`` of the root link; ``place`` of the root link.
    joint : str
        The joint that it is about; empty where it is about none.
    text : str
        A sentence for a person.
    """

    kind: Kind
    joint: str
    text: str


def open_questions(
    tool: ToolSpecification,
    pose: ToolPose,
    alternatives: Iterable[ToolPose],
    open_parameters: Set[str],
    unseen_joints: Set[str],
) -> tuple[OpenQuestion, ...]:
    """Say what is open about a pose.

    Parameters
    ----------
    alternatives : iterable of ToolPose
        Other legal poses that fit as well.
    open_parameters : set of str
        Names of a fit's parameters that the data do not determine.
    unseen_joints : set of str
        Joints beyond which the data show nothing.
    """
    found = []
    if any(f"{axis}_um" in open_parameters for axis in "xyz"):
        found.append(OpenQuestion("place", "", "Where the tool's root link lies along its way is not seen."))
    if {"rotation_y_deg", "rotation_z_deg"} & open_parameters:
        found.append(OpenQuestion("direction", "", "Which way the tool's root link points is not seen."))
    if "rotation_x_deg" in open_parameters:
        text = "What is seen lies on one line to within the noise, so the roll about the shaft is open."
        found.append(OpenQuestion("roll", "", text))
    for joint in tool.joints:
        if joint.name in unseen_joints:
            text = f"{joint.child} is not seen, so {joint.name} is open."
            found.append(OpenQuestion("angle", joint.name, text))
        elif f"{joint.name}_deg" in open_parameters:
            text = f"Too little of {joint.child} is seen to tell {joint.name}."
            found.append(OpenQuestion("angle", joint.name, text))
    for other in alternatives:
        found += _rival(tool.joints, pose.angles_deg, other.angles_deg)
    return tuple(dict.fromkeys(found))


def _rival(
    joints: Iterable[Joint], angles_deg: Mapping[str, float], others_deg: Mapping[str, float]
) -> Iterable[OpenQuestion]:
    pairs = [(joint.name, angles_deg[joint.name], others_deg[joint.name]) for joint in joints]
    shown = [pair for pair in pairs if _apart_deg(pair) > _SHOWN_DEG]
    if not shown:
        return [OpenQuestion("direction", "", "Another pose, turned as a whole, fits the data as well.")]
    # The sense of the bend is the question where the greatest change is one of sign.
    name, angle_deg, other_deg = max(shown, key=_apart_deg)
    told = " and ".join(f"{name} = {first:+z.0f}° or {second:+z.0f}°" for name, first, second in shown)
    if angle_deg * other_deg < 0:
        text = f"The data fit two senses of the hinge alike: {told}."
        return [OpenQuestion("sense", name, text)]
    return [OpenQuestion("angle", name, f"The data fit two poses alike: {told}.")]


def _apart_deg(pair: tuple[str, float, float]) -> float:
    """Return how far apart two angles in degrees are, which a name precedes; a full turn is none."""
    return abs(math.remainder(pair[1] - pair[2], 360.0))
