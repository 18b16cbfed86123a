"""From where the scene is seen: a frozen camera, and pure functions that turn, shift and zoom it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry.frames import Vector, vector
from annotator.session.viewing.view import Preset

PRESETS: tuple[Preset, ...] = get_args(Preset)

VIEW_ANGLE_DEG = 30.0
_DEGREES_A_VIEW = 200.0  # a drag across the whole view turns the volume a little more than half way round
_MARGIN = 1.08
_NEAREST_UM = 10.0
_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """How the scene is projected, in the volume's frame.

    Attributes
    ----------
    focal_um : (float, float, float)
        The point in the middle of the picture.
    forward, up : (float, float, float)
        Unit vectors at right angles: where the camera looks, and what is up in the picture.
    height_um : float
        What the picture's height shows at the focal point.
    scope_um : float
        Diagonal of what there is to see; the camera stays outside of it in parallel projection.
    parallel : bool
        Parallel projection, in which one scale holds at every depth; else perspective.
    """

    focal_um: Vector
    forward: Vector
    up: Vector
    height_um: float
    scope_um: float
    parallel: bool = True

    @cached_property
    def right(self) -> Vector:
        """Unit vector to the right in the picture."""
        return vector(np.cross(self.forward, self.up))

    @property
    def distance_um(self) -> float:
        """Distance of the eye from the focal point."""
        if self.parallel:
            return 3 * self.scope_um
        return self.height_um / 2 / math.tan(math.radians(VIEW_ANGLE_DEG / 2))

    @property
    def eye_um(self) -> Vector:
        """Where the eye is; in parallel projection anywhere in front of everything will do."""
        return vector(np.asarray(self.focal_um) - self.distance_um * np.asarray(self.forward))

    @property
    def clipping_um(self) -> tuple[float, float]:
        """Nearest and farthest distance from the eye that is drawn."""
        distance_um = self.distance_um
        return max(distance_um - 2 * self.scope_um, 0.01 * distance_um), distance_um + 2 * self.scope_um


def preset(name: Preset, low_um: ArrayLike, high_um: ArrayLike, depth_axis: int, aspect: float) -> Camera:
    """Return a camera that sees a whole box from one of the preset directions, in parallel projection.

    Depth runs down in the picture, as in a B-scan; looking along depth, the axis after it points up.

    Parameters
    ----------
    name : str
        The axis along which the camera looks, or ``home``: obliquely, from the scanner's side.
    low_um, high_um : array_like of float, shape (3,)
        The box's corners.
    depth_axis : int
        Axis along which the light runs.
    aspect : float
        The picture's width over its height.
    """
    depth = np.eye(3)[depth_axis]
    if name == "home":
        others = [np.eye(3)[axis] for axis in range(3) if axis != depth_axis]
        forward = 0.85 * others[0] + 0.45 * others[1] + 0.55 * depth
        up = -depth
    else:
        axis = "xyz".index(name[1])
        forward = np.eye(3)[axis] * (1 if name[0] == "+" else -1)
        up = np.eye(3)[(depth_axis + 1) % 3] if axis == depth_axis else -depth
    low, high = np.asarray(low_um, dtype=float), np.asarray(high_um, dtype=float)
    forward, up = _upright(forward, up)
    scope_um = max(float(np.linalg.norm(high - low)), _NEAREST_UM)
    camera = Camera(vector((low + high) / 2), vector(forward), vector(up), scope_um, scope_um)
    return fitted(camera, low, high, aspect)


def fitted(camera: Camera, low_um: ArrayLike, high_um: ArrayLike, aspect: float) -> Camera:
    """Return the camera moved and zoomed, not turned, so that a box just fits into the picture."""
    low, high = np.asarray(low_um, dtype=float), np.asarray(high_um, dtype=float)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, 8).T
    middle = (low + high) / 2
    up = np.abs((corners - middle) @ camera.up)
    right = np.abs((corners - middle) @ camera.right)
    # In perspective a near corner needs more room than one in the middle, and a far corner less.
    spread = 0.0 if camera.parallel else math.tan(math.radians(VIEW_ANGLE_DEG / 2))
    nearer = -((corners - middle) @ camera.forward) * spread
    fitting_um = 2 * _MARGIN * max((up + nearer).max(), (right / aspect + nearer).max())
    return replace(camera, focal_um=vector(middle), height_um=_zoomable(camera, fitting_um))


def turned(camera: Camera, right_part: float, down_part: float) -> Camera:
    """Return the camera after a drag that turns the volume under it, given as parts of the picture's size."""
    azimuth = _turn(camera.up, -math.radians(_DEGREES_A_VIEW * right_part))
    elevation = _turn(camera.right, -math.radians(_DEGREES_A_VIEW * down_part))
    forward, up = _upright(azimuth @ elevation @ camera.forward, azimuth @ elevation @ camera.up)
    return replace(camera, forward=vector(forward), up=vector(up))


def shifted(camera: Camera, right_um: float, down_um: float) -> Camera:
    """Return the camera after a drag that moves the volume right and down, in µm at the focal point."""
    focal = np.asarray(camera.focal_um) - right_um * np.asarray(camera.right)
    return replace(camera, focal_um=vector(focal + down_um * np.asarray(camera.up)))


def zoomed(camera: Camera, factor: float, right_um: float = 0.0, down_um: float = 0.0) -> Camera:
    """Return the camera magnifying ``factor`` times more; a point of the picture stays where it is.

    The point is given by its distance from the middle, in µm at the focal point before zooming.
    """
    height_um = _zoomable(camera, camera.height_um / factor)
    moved = 1 - height_um / camera.height_um
    return replace(shifted(camera, -right_um * moved, -down_um * moved), height_um=height_um)


def aimed(camera: Camera, position_um: Vector, height_um: float) -> Camera:
    """Return the camera with a position in the middle of the picture, not turned."""
    return replace(camera, focal_um=position_um, height_um=_zoomable(camera, height_um))


def _zoomable(camera: Camera, height_um: float) -> float:
    return float(np.clip(height_um, _NEAREST_UM, 20 * camera.scope_um))


def _upright(forward: ArrayLike, up: ArrayLike) -> tuple[_Floats, _Floats]:
    ahead = np.asarray(forward, dtype=float) / np.linalg.norm(forward)
    above = np.asarray(up, dtype=float) - (np.asarray(up) @ ahead) * ahead
    return ahead, above / np.linalg.norm(above)


def _turn(axis: Sequence[float], angle_rad: float) -> _Floats:
    """Matrix of a right-handed rotation about a unit axis (Rodrigues' formula)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle_rad) * cross + (1 - math.cos(angle_rad)) * (cross @ cross)
