"""What errors may depend on, from the truth alone: how deep the tool lies, and how much of it is in view."""

import hashlib
import json
from collections.abc import Mapping

import numpy as np

from annotations.documents.annotation import VolumeReference
from annotations.geometry.frames import Vector, um_to_voxel
from annotations.geometry.tool import ToolSpecification

_DECIMALS_UM = 3


def depth_um(truth_um: Mapping[str, Vector], depth_axis: int) -> float | None:
    """Return the mean of keypoints' positions in µm along the axis of the light; None where there is none."""
    depths_um = [position_um[depth_axis] for position_um in truth_um.values()]
    return sum(depths_um) / len(depths_um) if depths_um else None


def visible_share(
    truth_um: Mapping[str, Vector], tool: ToolSpecification, volume: VolumeReference
) -> float | None:
    """Return which share of the length of the links' axes lies inside a volume, 0 to 1.

    The outer halves of the volume's voxels are inside, as for `VolumeReference.contains`.

    Parameters
    ----------
    truth_um : mapping of str to (float, float, float)
        Position in µm of each keypoint that is known.
    tool : ToolSpecification
    volume : VolumeReference

    Returns
    -------
    float or None
        Over the links of which both ends are known; None where there is none that has a length.
    """
    inside_um = length_um = 0.0
    for link in tool.links:
        if link.base in truth_um and link.tip in truth_um:
            ends_um = np.array([truth_um[link.base], truth_um[link.tip]])
            of_link_um = float(np.linalg.norm(ends_um[1] - ends_um[0]))
            length_um += of_link_um
            inside_um += of_link_um * _share_inside(um_to_voxel(ends_um, volume.spacing_um), volume.shape)
    return min(1.0, inside_um / length_um) if length_um > 0 else None


def truth_sha256(truth_um: Mapping[str, Vector]) -> str:
    """Return the SHA-256 of where an annotation has keypoints, by which it is noticed that one was moved.

    To the nanometre: the keypoints of boxes are computed, and may differ in the last digits elsewhere. What
    else the file says, such as who looked at it and when, changes nothing here.

    Parameters
    ----------
    truth_um : mapping of str to (float, float, float)
        Positions in µm by name.
    """
    # Adding zero turns −0 into 0.
    rounded = {
        name: [round(value, _DECIMALS_UM) + 0.0 for value in position_um]
        for name, position_um in truth_um.items()
    }
    return hashlib.sha256(json.dumps(rounded, sort_keys=True).encode()).hexdigest()


def _share_inside(ends_voxel: np.ndarray, shape: tuple[int, int, int]) -> float:
    """Return which share of a straight line lies inside, by clipping it at each pair of faces.

    J. Liang and B. Barsky, *A new concept and method for line clipping*, ACM TOG 3, 1984.
    """
    begin, direction = ends_voxel[0], ends_voxel[1] - ends_voxel[0]
    enters, leaves = 0.0, 1.0
    for axis, count in enumerate(shape):
        low, high = -0.5 - begin[axis], count - 0.5 - begin[axis]
        if direction[axis] == 0:
            if low > 0 or high < 0:
                return 0.0
            continue
        # Of a line that hardly goes along the axis, infinity: it leaves through no face of it.
        with np.errstate(over="ignore"):
            first, second = sorted((low / direction[axis], high / direction[axis]))
        enters, leaves = max(enters, float(first)), min(leaves, float(second))
    return max(0.0, leaves - enters)
