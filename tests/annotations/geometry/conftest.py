"""Tools to test with, and what Hypothesis draws when it is asked for a `ToolPose` or a `Box`."""

import math
from collections.abc import Callable

import hypothesis.strategies as st
import pytest

from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.rotations import quaternion
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import parse_tool, shipped_tools

NINE_KEYPOINTS = """
schema = "oct-tool/1"
name = "long-needle"
title = "A needle with nine marks"
keypoints = [
    { name = "tip" }, { name = "mark1" }, { name = "mark2" }, { name = "mark3" }, { name = "mark4" },
    { name = "mark5" }, { name = "mark6" }, { name = "mark7" }, { name = "hub", label = "where it is held" },
]
[[links]]
name = "shaft"
base = "hub"
tip = "tip"
length_um = 9000
cross_section_um = [300.0, 300]
color = "#A0B1C2"
[targets]
position = ["tip"]
orientation = ["hub", "tip"]
"""

positions = st.tuples(*[st.floats(-30_000, 30_000)] * 3)
rotations = (
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda values: math.hypot(*values) > 1e-3).map(quaternion)
)
sizes = st.tuples(*[st.floats(10, 20_000)] * 3)
angles = st.fixed_dictionaries({"theta1": st.floats(-90, 90), "theta2": st.floats(0, 90)})

st.register_type_strategy(Box, st.builds(Box, positions, sizes, rotations))
st.register_type_strategy(ToolPose, st.builds(ToolPose, positions, rotations, angles))


@pytest.fixture(scope="session")
def forceps() -> ToolSpecification:
    return shipped_tools()["magnetic-forceps"]


@pytest.fixture(scope="session")
def needle() -> ToolSpecification:
    return shipped_tools()["needle"]


@pytest.fixture(scope="session")
def nine_keypoints_toml() -> str:
    return NINE_KEYPOINTS


@pytest.fixture(scope="session")
def nine_keypoints(nine_keypoints_toml: str) -> ToolSpecification:
    return parse_tool(nine_keypoints_toml, "long-needle.toml")


@pytest.fixture(scope="session")
def chain() -> Callable[..., ToolSpecification]:
    """Make a tool of links of one length that follow each other, with joints in the order asked for."""

    def make(links: int, length_um: float = 1000.0, joints_backwards: bool = False) -> ToolSpecification:
        joints = [
            {
                "name": f"theta{index}",
                "parent": f"link{index - 1}",
                "child": f"link{index}",
                "limits_deg": (-180.0, 180.0),
            }
            for index in range(1, links)
        ]
        return ToolSpecification.model_validate(
            {
                "schema": "oct-tool/1",
                "name": f"chain-{links}",
                "keypoints": [{"name": f"k{index}"} for index in range(links + 1)],
                "links": [
                    {
                        "name": f"link{index}",
                        "base": f"k{index}",
                        "tip": f"k{index + 1}",
                        "length_um": length_um,
                        "cross_section_um": (10.0, 10.0),
                        "color": "#000000",
                    }
                    for index in range(links)
                ],
                "joints": joints[::-1] if joints_backwards else joints,
            }
        )

    return make
