"""The pose of the tool that fits predicted keypoints best, whatever single ones of them are far off.

A network has each keypoint from a heatmap of its own, and now and then one is millimetres off. The tool
cannot look like that: the residuals of the fit show it, and without that keypoint they are small.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from annotations.fitting.chain import chain_of
from annotations.fitting.chain_solver import ChainSolver, Solution
from annotations.fitting.evidence import BodyPoint
from annotations.fitting.pose_fit import ToolFit, fit_points
from annotations.fitting.told_keypoints import told_keypoints_um
from annotations.geometry import rotations
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.prediction.checkpoint_description import CheckpointDescription
from annotations.prediction.predictor import PredictedKeypoints

_SHARE_OF_WIDTH = 0.3
"""What a trained network is off by along each axis, in widths of the heatmaps that it was taught."""
_IMPLAUSIBLE = 3.0
"""χ² per degree of freedom beyond which some keypoint is taken to be far off. Of magnetic forceps whose links
are 2 % longer or shorter than nominal, and keypoints 0.15 mm off along each axis, less than one in a thousand
has more than 2; with one of the keypoints 5 to 6 mm off, 97 % have."""
_LEAST_GAIN = 2.5
"""By which factor χ² per degree of freedom is smaller for each keypoint that is left out."""
_LEAST_KEYPOINTS = 4
_MOST_LEFT_OUT = 2


@dataclass(frozen=True, eq=False)
class PredictedPose:
    """The fit of a tool to predicted keypoints.

    Attributes
    ----------
    fit : ToolFit
        To all keypoints but those that were left out.
    keypoints_um : mapping of str to (float, float, float)
        Where it puts the keypoints that count, and the others of which they tell the place
        (`told_keypoints_um`).
    residuals_um : mapping of str to float
        How far from there each of them was predicted, those included that were left out.
    left_out : tuple of str
        Keypoints that the tool cannot have where they were predicted, in the order of the prediction.
    """

    fit: ToolFit
    keypoints_um: Mapping[str, Vector]
    residuals_um: Mapping[str, float]
    left_out: tuple[str, ...]


def fit_prediction(predicted: PredictedKeypoints, description: CheckpointDescription) -> PredictedPose | None:
    """Fit the tool to predicted keypoints.

    All of them count at first, each with what the spread of its heatmap says of it. Where they are further
    from the fit than the errors of a network explain, one of them is left out, or two: those without which
    the rest fits best. At least four stay. One fit takes 5 ms, and to leave out a keypoint as long as four.

    Parameters
    ----------
    predicted : PredictedKeypoints
    description : CheckpointDescription
        Of the checkpoint that predicted them.

    Returns
    -------
    PredictedPose or None
        None where the keypoints do not tell the direction of any link.
    """
    tool = description.tool
    points = _body_points(predicted, description)
    fit = fit_points(points, tool)
    if fit is None:
        return None
    best = latest = fit
    left_out: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    most = min(_MOST_LEFT_OUT, len(points) - _LEAST_KEYPOINTS)
    while _misfit(best) > _IMPLAUSIBLE and len(without) < most:
        # One after the other: of two that are far off, the first found is nearly always one.
        worst = _worst(points, tool, latest)
        if worst is None:
            break
        points = tuple(point for point in points if point is not worst)
        without = (*without, worst.keypoint)
        better = fit_points(points, tool)
        if better is None:
            break
        latest = better
        if _misfit(better) * _LEAST_GAIN ** len(without) < _misfit(fit):
            best, left_out = better, without
    # A keypoint that counts tells its own place at least.
    counted_um = {name: best.keypoints_um[name] for name in best.residuals_um}
    told_um = {**counted_um, **told_keypoints_um(best, tool, _usual_sigma_um(description))}
    return PredictedPose(
        best,
        told_um,
        {
            name: math.dist(position_um, told_um[name])
            for name, position_um in predicted.by_name.items()
            if name in told_um
        },
        tuple(name for name in predicted.names if name in left_out),
    )


def _body_points(predicted: PredictedKeypoints, description: CheckpointDescription) -> tuple[BodyPoint, ...]:
    tool = description.tool
    taught_um, usual_um = _taught_um(description), _usual_sigma_um(description)
    points = []
    for name, spread_um in zip(predicted.names, predicted.spread_um, strict=True):
        position_um, link = predicted.by_name.get(name), tool.link_of(name)
        if position_um is None or link is None:
            continue
        more = max(float(np.mean(np.square(spread_um))) - taught_um**2, 0.0)
        local_um = (0.0 if name == link.base else link.length_um, 0.0, 0.0)
        points.append(BodyPoint(link.name, local_um, position_um, math.sqrt(usual_um**2 + more), name))
    return tuple(points)


def _taught_um(description: CheckpointDescription) -> float:
    """Return how wide the heatmaps are that the network was taught, as they are where it is sure.

    It is a standard deviation along each axis, the root mean square of the three.
    """
    sampling, convention = description.sampling, description.heatmaps
    voxel_um = np.multiply(convention.reduction, sampling.spacing_um) / convention.shrink
    return float(np.sqrt(np.mean(np.square(voxel_um * convention.sigma_voxel))))


def _usual_sigma_um(description: CheckpointDescription) -> float:
    """Return by how much the network is usually off along each axis, as a standard deviation."""
    return _SHARE_OF_WIDTH * _taught_um(description)


def _worst(points: Sequence[BodyPoint], tool: ToolSpecification, fit: ToolFit) -> BodyPoint | None:
    """Return the point without which the others fit best, by a short descent from the fit to them all."""
    chain = chain_of(tool)
    if chain is None:
        return None
    angles_rad = np.radians([fit.pose.angles_deg[name] for name in chain.joints])
    axes, no_stretch_um = rotations.matrix(fit.pose.rotation_wxyz), np.zeros(len(chain.links))
    start = Solution(axes, angles_rad, no_stretch_um, fit.chi_square, frozenset())

    def chi_square_without(point: BodyPoint) -> float:
        others = [each for each in points if each is not point and each.link in chain.links]
        return ChainSolver(chain, others).next_to(start).chi_square

    return min((point for point in points if point.link in chain.links), key=chi_square_without, default=None)


def _misfit(fit: ToolFit) -> float:
    """Return χ² per degree of freedom: about 1 where residuals are what their standard deviations say."""
    return fit.chi_square / max(fit.degrees_of_freedom, 1)
