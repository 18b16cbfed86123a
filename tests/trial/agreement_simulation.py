"""Compares simulated annotators whose noise is known: ``python -m tests.trial.agreement_simulation``.

Three annotators, thirty volumes, both methods. Prints one such study as a table beside the closed forms.

Keypoints have isotropic normal noise, of an own σ along each axis for each keypoint. Boxes have isotropic
noise of σ_c at the centre and of σ_r (radians) in the rotation, and of σ_l = L σ_r in the length L; that
makes the noise at both ends isotropic, with σ² = σ_c² + (σ_r L/2)². To first order, with links of length L,
the noise along one axis, or of one number, is

    position      √(σ_k0² + σ_k1²) / 2                 boxes: σ_c
    direction     √(σ_base² + σ_tip²) / L              boxes: σ_r
    angle         √(σ_first² + σ_second²), of the directions of the two links: the part in their plane

and the mean distance from the truth follows from the distributions of Maxwell for positions, σ √(8/π), of
Rayleigh for directions, σ √(π/2), and the half-normal one for numbers, σ √(2/π). The statistics are multiples
of these: see `annotations.agreement.deviation`.
"""

import argparse
import math
import sys
from collections.abc import Mapping
from functools import cache

import numpy as np

from annotations.agreement.compared import Compared
from annotations.agreement.figures import figures
from annotations.agreement.results import Statistics
from annotations.documents.record import Method
from annotations.documents.standing import STANDINGS
from annotations.geometry.boxes import box_ends_um
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import quaternion
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool

ANNOTATORS, VOLUMES = 3, 30

KEYPOINT_SIGMAS_UM = np.array([90.0, 60.0, 50.0, 40.0, 30.0, 45.0])
CENTER_SIGMA_UM = 40.0
ROTATION_SIGMA = math.radians(0.4)

MAXWELL, RAYLEIGH, HALF_NORMAL = math.sqrt(8 / math.pi), math.sqrt(math.pi / 2), math.sqrt(2 / math.pi)

# Away from 0°, where the unsigned angle is biased.
_JOINTS_DEG = (25.0, 65.0)
_POSES = 40


def simulated(method: Method, volumes: int, seed: int, annotators: int = ANNOTATORS) -> Compared:
    """Return what simulated annotators made of volumes with tools in random poses."""
    random = np.random.default_rng(seed)
    true_um, centers_um, lengths_um, rotations_wxyz = _truth()
    which = random.integers(_POSES, size=(volumes, 1))
    shape = (volumes, annotators)
    found_wxyz = None
    if method == "keypoints":
        noise_um = random.normal(size=(*shape, *true_um.shape[1:])) * KEYPOINT_SIGMAS_UM[:, np.newaxis]
        positions_um = true_um[which] + noise_um
    else:
        links = lengths_um.shape[1]
        found_um = centers_um[which] + CENTER_SIGMA_UM * random.normal(size=(*shape, links, 3))
        factors = 1 + ROTATION_SIGMA * random.normal(size=(*shape, links))
        found_wxyz = _turned(rotations_wxyz[which], ROTATION_SIGMA * random.normal(size=(*shape, links, 3)))
        ends_um = box_ends_um(found_um, lengths_um[which] * factors, found_wxyz)
        positions_um = np.stack(ends_um, axis=3).reshape(*shape, 2 * links, 3)
    everywhere = np.ones(shape, dtype=np.bool_)
    return Compared(
        method=method,
        volumes=tuple(f"v{number:03}" for number in range(volumes)),
        annotators=tuple(f"annotator {number + 1}" for number in range(annotators)),
        positions_um=positions_um,
        standing=np.full(positions_um.shape[:3], STANDINGS.index("counted"), dtype=np.uint8),
        doubtful=np.zeros(positions_um.shape[:3], dtype=np.bool_),
        rotations_wxyz=found_wxyz,
        has_document=everywhere,
        is_done=everywhere,
        is_blind=everywhere,
        is_flagged=~everywhere,
        is_from_prediction=~everywhere,
        active_seconds=random.gamma(9.0, 5.0, size=shape),
    )


def distances_from_truth(method: Method) -> Mapping[str, float]:
    """Return the closed form of the mean distance from the truth, by target, and by keypoint and part."""
    tool = forceps()
    lengths_um = np.array([link.length_um for link in tool.links])
    if method == "keypoints":
        at_keypoints_um = KEYPOINT_SIGMAS_UM
        pairs_um = np.hypot(KEYPOINT_SIGMAS_UM[::2], KEYPOINT_SIGMAS_UM[1::2])
        position_um, directions = pairs_um[0] / 2, pairs_um / lengths_um
    else:
        at_keypoints_um = np.repeat(np.hypot(CENTER_SIGMA_UM, ROTATION_SIGMA * lengths_um / 2), 2)
        position_um, directions = CENTER_SIGMA_UM, np.full(len(lengths_um), ROTATION_SIGMA)
    directions_deg = np.degrees(directions)
    found = {
        "position_um": MAXWELL * position_um,
        "orientation_deg": RAYLEIGH * directions_deg[0],
        "theta1_deg": HALF_NORMAL * np.hypot(directions_deg[0], directions_deg[1]),
        "theta2_deg": HALF_NORMAL * np.hypot(directions_deg[1], directions_deg[2]),
    }
    for name, sigma_um in zip(tool.keypoint_names, at_keypoints_um, strict=True):
        found[f"{name} distance_um"] = MAXWELL * sigma_um
        found[f"{name} along_um"] = HALF_NORMAL * sigma_um
        found[f"{name} across_um"] = RAYLEIGH * sigma_um
    return found


def closed_forms(distance: float, annotators: int = ANNOTATORS) -> Mapping[str, float]:
    """Return the three statistics that follow from a mean distance from the truth."""
    share = (annotators - 1) / annotators
    return {
        "published": distance * math.sqrt(share),
        "leave_one_out": distance / math.sqrt(share),
        "pairwise": distance * math.sqrt(2),
    }


@cache
def forceps() -> ToolSpecification:
    """Return the published instrument."""
    return find_tool("magnetic-forceps")


@cache
def _truth() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return keypoints, and centres, lengths and rotations of boxes, of tools in random poses."""
    random, tool = np.random.default_rng(0), forceps()
    keypoints, boxes = [], []
    for _ in range(_POSES):
        angles_deg = dict(zip(("theta1", "theta2"), random.uniform(*_JOINTS_DEG, size=2), strict=True))
        where_um = random.uniform(2e3, 9e3, size=3)
        pose = ToolPose(tuple(where_um), quaternion(random.normal(size=4)), angles_deg)
        keypoints.append(list(keypoints_um(pose, tool).values()))
        boxes.append(link_boxes(pose, tool).values())
    return (
        np.array(keypoints),
        np.array([[box.center_um for box in each] for each in boxes]),
        np.array([[box.size_um[0] for box in each] for each in boxes]),
        np.array([[box.rotation_wxyz for box in each] for each in boxes]),
    )


def _turned(rotations_wxyz: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return rotations (…, 4), turned besides by small rotation vectors (…, 3) in radians."""
    w, xyz = rotations_wxyz[..., :1], rotations_wxyz[..., 1:]
    half = turns / 2
    real = w - (half * xyz).sum(axis=-1, keepdims=True)
    turned = np.concatenate([real, xyz + w * half + np.cross(half, xyz)], axis=-1)
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)


def main() -> None:
    """Simulate one study, and print it."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.trial.agreement_simulation",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for number, method in enumerate(("keypoints", "boxes")):
        found = figures(simulated(method, VOLUMES, 2 * options.seed + number), forceps())
        rows: dict[str, Statistics | None] = dict(found.targets)
        for name, keypoint in found.keypoints.items():
            for part in ("distance_um", "along_um", "across_um"):
                rows[f"{name} {part}"] = getattr(keypoint, part)
        sys.stdout.write(f"{method}: mean [95 % interval] of {VOLUMES} volumes, and the closed form\n")
        sys.stdout.write(f"{'':<16}{'published':>32}{'leave one out':>32}{'pairwise':>32}\n")
        for name, statistics in rows.items():
            expected = closed_forms(distances_from_truth(method)[name])
            cells = []
            for statistic, value in expected.items():
                estimate = getattr(statistics, statistic)
                low, high = estimate.ci95
                cells.append(f"{estimate.mean:8.2f} [{low:6.2f}, {high:6.2f}] {value:7.2f}")
            sys.stdout.write(f"{name:<16}" + "".join(f"{cell:>32}" for cell in cells) + "\n")


if __name__ == "__main__":
    main()
