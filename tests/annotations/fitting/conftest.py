"""Documents of posed tools, as a hand that trembles would write them."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from annotations.documents.annotation import (
    Annotation,
    BoxAnnotation,
    KeypointAnnotation,
    VolumeReference,
    new_annotation,
)
from annotations.documents.record import changed
from annotations.fitting.evidence import ROLL_SIGMA_DEG
from annotations.geometry import rotations
from annotations.geometry.boxes import Box, box_between
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools

REFERENCE = VolumeReference(
    path="v001.npy",
    shape=(1096, 1936, 1152),
    dtype="uint8",
    spacing_um=(15.9, 13.5, 9.4),
    fingerprint="…",
)


@pytest.fixture(scope="session")
def forceps() -> ToolSpecification:
    return shipped_tools()["magnetic-forceps"]


@pytest.fixture(scope="session")
def needle() -> ToolSpecification:
    return shipped_tools()["needle"]


@pytest.fixture(scope="session")
def random_pose() -> Callable[..., ToolPose]:
    """Draw a pose of a tool, each joint within its limits, less a margin."""

    def draw(tool: ToolSpecification, rng: np.random.Generator, margin_deg: float = 0.0) -> ToolPose:
        angles_deg = {
            joint.name: float(rng.uniform(joint.limits_deg[0] + margin_deg, joint.limits_deg[1] - margin_deg))
            for joint in tool.joints
        }
        rotation_wxyz = rotations.quaternion(rng.normal(size=4))
        return ToolPose(vector(rng.uniform(0, 15_000, 3)), rotation_wxyz, angles_deg)

    return draw


@pytest.fixture(scope="session")
def noisy() -> Callable[..., dict[str, Vector]]:
    """See each keypoint of a posed tool with noise along each axis."""

    def see(
        pose: ToolPose, tool: ToolSpecification, rng: np.random.Generator, sigma_um: float = 50.0
    ) -> dict[str, Vector]:
        return {
            name: vector(position_um + rng.normal(0, sigma_um, 3))
            for name, position_um in keypoints_um(pose, tool).items()
        }

    return see


@pytest.fixture(scope="session")
def keypoint_document() -> Callable[..., Annotation]:
    """Write positions down; fields that are not as usual are given by the keypoint's name."""

    def write(
        tool: ToolSpecification,
        positions_um: Mapping[str, Vector],
        fields: Mapping[str, Mapping[str, str]] | None = None,
    ) -> Annotation:
        blank = new_annotation(REFERENCE, tool, "anna", "keypoints", ships=True)
        unusual = fields or {}
        keypoints = tuple(
            KeypointAnnotation.model_validate(
                {"name": name, "state": "placed", "position_um": positions_um[name], "source": "clicked"}
                | unusual.get(name, {})
            )
            if name in positions_um
            else KeypointAnnotation(name=name)
            for name in tool.keypoint_names
        )
        return changed(blank, keypoints=keypoints)

    return write


@pytest.fixture(scope="session")
def box_document() -> Callable[..., Annotation]:
    def write(tool: ToolSpecification, boxes: Mapping[str, Box]) -> Annotation:
        blank = new_annotation(REFERENCE, tool, "anna", "boxes", ships=True)
        parts = tuple(
            BoxAnnotation(
                link=link.name,
                state="placed",
                center_um=boxes[link.name].center_um,
                size_um=boxes[link.name].size_um,
                rotation_wxyz=boxes[link.name].rotation_wxyz,
                source="clicked",
            )
            if link.name in boxes
            else BoxAnnotation(link=link.name)
            for link in tool.links
        )
        return changed(blank, boxes=parts)

    return write


@pytest.fixture(scope="session")
def noisy_boxes() -> Callable[..., dict[str, Box]]:
    """See each link's box of a posed tool: both ends with noise, and a roll that is a few degrees off."""

    def see(
        pose: ToolPose, tool: ToolSpecification, rng: np.random.Generator, sigma_um: float = 50.0
    ) -> dict[str, Box]:
        boxes = {}
        for name, box in link_boxes(pose, tool).items():
            base_um, tip_um = (
                np.array(end) + rng.normal(0, sigma_um, 3) for end in (box.base_um, box.tip_um)
            )
            roll_rad = np.radians(rng.normal(0, ROLL_SIGMA_DEG))
            side = np.cos(roll_rad) * box.axes[:, 1] + np.sin(roll_rad) * box.axes[:, 2]
            boxes[name] = box_between(base_um, tip_um, tool.link(name).cross_section_um, side)
        return boxes

    return see
