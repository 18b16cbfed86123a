"""Whether a checkpoint fits what is open: the tool that is annotated, and the volume."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.volumes import Volume, VolumeError

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.checkpoint import Checkpoint


def tool_unfitness(checkpoint: "Checkpoint", tool: ToolSpecification) -> str:
    """Return why a checkpoint's keypoints are not those of a tool, without a full stop; empty if they are.

    Lengths and colours may differ, as after a calibration: a network finds what it was trained on.
    """
    theirs = checkpoint.description.tool
    if theirs.fingerprint == tool.fingerprint:
        return ""
    if theirs.name == tool.name:
        whose = f"it is for a tool that is called {tool.name!r} as well, but is another one"
    else:
        whose = f"it is for the tool {theirs.name!r}, and what is open is annotated with {tool.name!r}"
    unknown = [name for name in theirs.keypoint_names if name not in tool.keypoint_names]
    if unknown:
        return f"{whose}, which has no {_listed(unknown)}"
    absent = [name for name in tool.keypoint_names if name not in theirs.keypoint_names]
    if absent:
        return f"{whose}: it knows nothing of {_listed(absent)}"
    ends = {link.name: (link.base, link.tip) for link in tool.links}
    differing = [link.name for link in theirs.links if ends.get(link.name) != (link.base, link.tip)]
    if differing or len(ends) != len(theirs.links):
        return f"{whose}: its links end at other keypoints"
    return ""


def tool_differences(checkpoint: "Checkpoint", tool: ToolSpecification) -> str:
    """Return in what a checkpoint's tool differs from one with the same keypoints, without a full stop.

    Empty where they are the same. Its poses are those of its own tool, and where that is far from the one in
    the volumes hardly any keypoint can belong to one pose.
    """
    theirs = checkpoint.description.tool
    if theirs.fingerprint == tool.fingerprint:
        return ""
    lengths_um = {link.name: link.length_um for link in tool.links}
    differing = [
        f"{link.name} is {link.length_um:g} µm long there and {lengths_um[link.name]:g} µm here"
        for link in theirs.links
        if link.name in lengths_um and link.length_um != lengths_um[link.name]
    ]
    joints = {joint.name: joint for joint in tool.joints}
    differing += [f"the joint {each.name} differs" for each in theirs.joints if joints.get(each.name) != each]
    if not differing and theirs.name == tool.name:
        return ""
    whose = f"it was trained on the tool {theirs.name!r}" if theirs.name != tool.name else "its tool differs"
    said = f": {_listed(differing)}" if differing else ""
    return f"{whose}{said}; the poses that it is fitted with are of that tool"


def volume_unfitness(checkpoint: "Checkpoint", volume: Volume, spacing_um: Vector) -> str:
    """Return why a network cannot be shown a volume, without a full stop; empty where it can."""
    from annotations.volumes.sampling import check_fits  # late: few sessions predict

    try:
        check_fits(volume, spacing_um, checkpoint.description.sampling)
    except VolumeError as error:
        return f"the open volume is not for it: {error.problem}"
    return ""


def _listed(names: Iterable[str]) -> str:
    return " and ".join(names)
