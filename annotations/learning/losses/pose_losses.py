"""How far a network is from a tool's pose: by its keypoints, or by the numbers that it regresses."""

from collections.abc import Iterator, Sequence

import torch
from torch import Tensor

from annotations.geometry.tool import ToolSpecification
from annotations.learning.losses.weighted_mean import weighted_mean

_LEAST_SINE = 1e-6
"""Nearer to 0° and 180° than this, 6e-5°, the angle has no gradient worth the name, and gets none."""
_LEAST_MM = 1e-6
_LEAST_SHARE = 0.1
"""A link that is found shorter than this share of its true length says little of its direction, and its
gradient, which grows with one over the length, would drown the others."""


def unsigned_angles_deg(first: Tensor, second: Tensor) -> Tensor:
    """Return the angles between vectors in mm, (n, 3) and (n, 3) to (n,), in [0, 180] degrees.

    atan2(‖a × b‖, a · b) with gradients that are finite everywhere. They vanish at 0° and 180°, and for a
    vector of no length, whose angle is 0 here.
    """
    lengths = [
        torch.linalg.vector_norm(vectors.detach(), dim=-1, keepdim=True) for vectors in (first, second)
    ]
    is_defined = torch.minimum(*lengths) > _LEAST_MM
    # The angle depends on no length, so that the lengths need no gradient.
    a, b = (
        torch.where(is_defined, vectors, 1.0) / torch.where(is_defined, length, 1.0)
        for vectors, length in zip((first, second), lengths, strict=True)
    )
    sine = torch.linalg.cross(a, b).square().sum(dim=-1).clamp(min=_LEAST_SINE**2).sqrt()
    angles = torch.rad2deg(torch.atan2(sine, (a * b).sum(dim=-1)))
    return torch.where(is_defined[..., 0], angles, 0.0)


class PoseLoss:
    """The errors of a tool's pose targets by the published formulas, from the keypoints that a network finds.

    A target counts for an example if all its keypoints are known there. One that the tool lacks, or whose
    keypoints the network does not find, is left out.

    Parameters
    ----------
    tool : ToolSpecification
    keypoints : sequence of str
        Names of the network's heatmaps, in their order.
    mm_per_degree : float
        What a degree counts in the total.
    """

    def __init__(self, tool: ToolSpecification, keypoints: Sequence[str], mm_per_degree: float) -> None:
        place = {name: index for index, name in enumerate(keypoints)}
        targets = tool.targets
        self._mm_per_degree = mm_per_degree
        self._position = _places(place, targets.position or ())
        self._orientation = _places(place, targets.orientation or ())
        self._angles: dict[str, list[int]] = {}
        for angle in targets.angles:
            links = (tool.link(angle.first), tool.link(angle.second))
            ends = _places(place, [name for link in links for name in (link.base, link.tip)])
            if ends:
                self._angles[f"{angle.name}_deg"] = ends

    def __call__(
        self, found_mm: Tensor, true_mm: Tensor, is_known: Tensor, weight: Tensor
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """Return the loss in mm, shape (), and its parts.

        Parameters
        ----------
        found_mm, true_mm : Tensor, shape (n, K, 3)
            Keypoints in one metric frame; finite, also where they are not known.
        is_known : Tensor of bool, shape (n, K)
        weight : Tensor, shape (n,)
            Of each example.

        Returns
        -------
        total : Tensor, shape ()
            The error of the position, and those of the orientation and of each angle by `mm_per_degree`.
        parts : dict of str to Tensor, shape ()
            ``position_mm``, ``orientation_deg`` and ``<angle>_deg``: means over the examples.
        """
        parts: dict[str, Tensor] = {}
        total = found_mm.new_zeros(())
        if self._position:
            apart = (found_mm - true_mm)[:, self._position].mean(dim=1)
            # A length has no gradient at 0.
            distances = apart.square().sum(dim=-1).clamp(min=_LEAST_MM**2).sqrt()
            is_counted = is_known[:, self._position].all(dim=1)
            parts["position_mm"] = weighted_mean(distances, is_counted, weight)
            total = total + parts["position_mm"]
        for name, ends, apart_deg, is_long in self._turns(found_mm, true_mm):
            is_counted = is_known[:, ends].all(dim=1) & is_long
            parts[name] = weighted_mean(apart_deg, is_counted, weight)
            total = total + self._mm_per_degree * parts[name]
        return total, parts

    def _turns(
        self, found_mm: Tensor, true_mm: Tensor
    ) -> Iterator[tuple[str, Sequence[int], Tensor, Tensor]]:
        """Yield each error in degrees with its name, its keypoints, and where its vectors are long enough."""
        if self._orientation:
            (found,), (true,) = (_ways(points, self._orientation) for points in (found_mm, true_mm))
            apart_deg = unsigned_angles_deg(found, true)
            yield "orientation_deg", self._orientation, apart_deg, _is_long(found, true)
        for name, ends in self._angles.items():
            found_ways, true_ways = (_ways(points, ends) for points in (found_mm, true_mm))
            apart_deg = (unsigned_angles_deg(*found_ways) - unsigned_angles_deg(*true_ways)).abs()
            is_long = _is_long(found_ways[0], true_ways[0]) & _is_long(found_ways[1], true_ways[1])
            yield name, ends, apart_deg, is_long


def regression_loss(output: Tensor, scaled: Tensor, weight: Tensor | None = None) -> Tensor:
    """Return the mean absolute difference of regressed numbers from a scaled pose, shape ().

    Parameters
    ----------
    output : Tensor, shape (n, P)
        A network's.
    scaled : Tensor, shape (n, P)
        See `annotations.learning.pose_vector`; NaN for what is not known.
    weight : Tensor, shape (n,), optional
        Of each example, as in `HeatmapTargets`; 1 unless given.
    """
    is_known = ~scaled.isnan()
    losses = (output.float() - torch.where(is_known, scaled, 0.0)).abs()
    return weighted_mean(losses, is_known, losses.new_ones(len(losses)) if weight is None else weight)


def _places(place: dict[str, int], names: Sequence[str]) -> list[int]:
    """Return where keypoints stand among the network's; none unless all of them do."""
    return [place[name] for name in names] if all(name in place for name in names) else []


def _ways(points_mm: Tensor, ends: Sequence[int]) -> list[Tensor]:
    """Return the vectors, each (n, 3), from each base to its tip: ends are base, tip, base, tip."""
    return [points_mm[:, tip] - points_mm[:, base] for base, tip in zip(ends[::2], ends[1::2], strict=True)]


def _is_long(found: Tensor, true: Tensor) -> Tensor:
    """Say which vectors that were found, (n, 3), are long enough to have a direction, shape (n,)."""
    found_mm, true_mm = (torch.linalg.vector_norm(vectors.detach(), dim=-1) for vectors in (found, true))
    is_long: Tensor = (found_mm > _LEAST_SHARE * true_mm) & (true_mm > _LEAST_MM)
    return is_long
