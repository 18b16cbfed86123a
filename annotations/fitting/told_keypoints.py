"""Which keypoints a fit tells the positions of: the others lie where what is open was put by the program."""

import math
from collections.abc import Mapping

from annotations.fitting.chain import chain_of
from annotations.fitting.evidence import SIGMA_UM
from annotations.fitting.pose_fit import ToolFit
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import keypoints_um
from annotations.geometry.tool import ToolSpecification

_ALIKE_SIGMAS = 4.0
"""Poses that explain the data alike put a keypoint at one place if they put it no further apart than this."""


def told_keypoints_um(
    fit: ToolFit, tool: ToolSpecification, sigma_um: float = SIGMA_UM
) -> Mapping[str, Vector]:
    """Return where a fit puts those keypoints in µm, by name, that what is seen tells the place of.

    That is none while place or direction of the root link is open, none on a link that a joint with an open
    angle turns, and none that another pose, which explains the data as well, puts elsewhere.

    Parameters
    ----------
    fit : ToolFit
    tool : ToolSpecification
    sigma_um : float
        Usual standard deviation along each axis of what was fitted to.
    """
    chain = chain_of(tool)
    whole = {"x_um", "y_um", "z_um", "rotation_y_deg", "rotation_z_deg"}
    if chain is None or whole & set(fit.open_parameters):
        return {}
    open_joints = [f"{name}_deg" in fit.open_parameters for name in chain.joints]
    open_links = {link for place, link in enumerate(chain.links) if chain.turned[open_joints, place].any()}
    rivals_um = [keypoints_um(pose, tool) for pose in fit.alternatives]
    told_um = {}
    for name, position_um in fit.keypoints_um.items():
        link = tool.link_of(name)
        if link is None or link.name in open_links:
            continue
        if all(math.dist(position_um, rival_um[name]) <= _ALIKE_SIGMAS * sigma_um for rival_um in rivals_um):
            told_um[name] = position_um
    return told_um
