"""The signed numbers of which a target consists: bias, limits of agreement and correlation are of these."""

from collections.abc import Iterable, Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.deviation import mean_of_all, means_of_others
from annotations.agreement.measured import Measured, Metric

Array = NDArray[np.float64]
Frame = Literal["volume", "common"]

_VERTICAL = 1e-9


def component_names(target: str, metric: Metric) -> tuple[str, ...]:
    """Return what the components of a target are called, with their unit."""
    stem, _, unit = target.rpartition("_")
    match metric:
        case "distance":
            return tuple(f"{stem}_{axis}_{unit}" for axis in "xyz")
        case "angle":
            return tuple(f"{stem}_{number}_{unit}" for number in (1, 2))
        case _:
            return (target,)


def component_values(measured: Iterable[Measured], *, frame: Frame = "volume") -> Mapping[str, Array]:
    """Return each target's components as each annotator of each volume has them.

    Positions have x, y and z in µm. Directions have two angles in degrees, in the tangent plane at a mean
    direction m: the direction's angle to m, split along two axes across m (the sphere's logarithm map). The
    first axis is the way in which m goes when it turns about +z, the second that in which it tilts towards
    +z; (m, first, second) is right-handed. For m along z itself the first is +y, as at a yaw of zero. Angles
    of joints are their own component.

    Parameters
    ----------
    measured : iterable of Measured
        Targets of V volumes by A annotators.
    frame : str
        Where the tangent plane of directions is: ``volume``, at the mean of the annotators of each volume, so
        that differences between annotators are exact and always seen from the tool; ``common``, one plane at
        the mean over all volumes, in which volumes differ as the tool's directions do. There, differences
        across m that are seen under an angle φ to m are too large by φ / sin φ.

    Returns
    -------
    mapping of str to (V, A) array of float64
        By component, in the targets' order; NaN where an annotator has none, or directions have no mean.
    """
    found: dict[str, Array] = {}
    for target in measured:
        values = target.values
        if target.metric == "angle":
            values = _tangent_deg(target, frame)
        names = component_names(target.name, target.metric)
        found.update({name: values[..., axis] for axis, name in enumerate(names)})
    return found


def difference_from_others(values: Array) -> Array:
    """Return each annotator's value of a component less the mean of the others', (V, A).

    NaN where an annotator has none, or nobody else has.
    """
    component = Measured("component", "difference", values[..., np.newaxis])
    return values - means_of_others(component)[..., 0]


def _tangent_deg(measured: Measured, frame: Frame) -> Array:
    """Return directions as angles of shape (V, A, 2) in degrees."""
    directions = measured.values
    means = mean_of_all(measured)
    if frame == "common":
        of_volumes = Measured(measured.name, "angle", means[np.newaxis])
        means = np.broadcast_to(mean_of_all(of_volumes), means.shape)
    first, second = _across(means)
    along = np.einsum("vad,vd->va", directions, means)
    parts = np.stack([np.einsum("vad,vd->va", directions, axis) for axis in (first, second)], axis=-1)
    sine = np.hypot(parts[..., 0], parts[..., 1])
    angles_deg = np.degrees(np.arctan2(sine, along))
    # Of the direction opposite to the mean all that is known is the angle.
    shares = np.where(
        (sine > 0)[..., np.newaxis], parts / np.where(sine > 0, sine, 1.0)[..., np.newaxis], [1.0, 0.0]
    )
    tangent_deg: Array = angles_deg[..., np.newaxis] * shares
    return tangent_deg


def _across(directions: Array) -> tuple[Array, Array]:
    """Return two unit vectors across each direction of shape (V, 3): turning about +z, tilting towards it."""
    level = np.hypot(directions[:, 0], directions[:, 1])
    steep = level < _VERTICAL
    scale = np.where(steep, 1.0, level)
    first = np.stack([-directions[:, 1] / scale, directions[:, 0] / scale, np.zeros(len(directions))], axis=1)
    first[steep] = (0.0, 1.0, 0.0)
    return first, np.cross(directions, first)
