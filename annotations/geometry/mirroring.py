"""Tools seen in a mirror across an array axis, which is what a flip of a volume shows."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry.tool import ToolSpecification

_ROUNDING = 1e-6
"""As far as a specification's unit vectors may be off."""


def mirrored_um(position_um: ArrayLike, axis: int, plane_um: float) -> NDArray[np.float64]:
    """Return positions in a mirror.

    Parameters
    ----------
    position_um : array_like, shape (…, 3)
        In µm; NaN stays NaN.
    axis : int
        The array axis that the mirror is perpendicular to.
    plane_um : float
        Where it stands on that axis.

    Returns
    -------
    ndarray of float64, shape (…, 3)
    """
    mirrored = np.array(position_um, dtype=np.float64)
    mirrored[..., axis] = 2 * plane_um - mirrored[..., axis]
    return mirrored


def has_mirrored_poses(tool: ToolSpecification) -> bool:
    """Say whether a tool in a mirror is that tool in another pose: one with an oblique hinge is not.

    Each link is its own mirror image, y → −y in its frame. With the mirror M and S = diag(1, −1, 1), a
    rotation R becomes M R S, and in the mirrored frame the turn about the hinge h by θ becomes
    S · turn(h, θ) · S = turn(−S h, θ). About a hinge along own y, the angle stays; about one in the own xz
    plane, it changes its sign; and for any other, the turn in the mirror is not one about this hinge.
    """
    return all(_is_mirrored(*joint.hinge_axis) for joint in tool.joints)


def _is_mirrored(x: float, y: float, z: float) -> bool:
    return max(abs(x), abs(z)) <= _ROUNDING or abs(y) <= _ROUNDING
