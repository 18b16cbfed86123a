import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.grid import Grid
from annotations.synthesis.out_of_view import moved_out_of_view
from annotations.synthesis.scene import SceneSeed, random_scene
from tests.annotations.synthesis.counted_share import share_out_of_view

FORCEPS = shipped_tools()["magnetic-forceps"]


@given(st.integers(0, 2**32), st.floats(0.01, 0.9), st.floats(0, 360))
def test_as_much_of_the_tool_is_out_of_view_as_was_asked_for(
    seed: int, share: float, heading_deg: float
) -> None:
    pose = random_scene(FORCEPS, SceneSeed(seed)).pose

    moved = moved_out_of_view(pose, FORCEPS, Grid(), share, heading_deg)

    # A link along the volume's side leaves it nearly at once, and the count has steps.
    assert share_out_of_view(moved, FORCEPS, Grid()) == pytest.approx(share, abs=3e-3)


@given(st.integers(0, 2**32), st.floats(0, 360))
def test_the_tool_moves_the_way_that_was_asked_for(seed: int, heading_deg: float) -> None:
    pose = random_scene(FORCEPS, SceneSeed(seed)).pose

    moved = moved_out_of_view(pose, FORCEPS, Grid(), 0.2, heading_deg)

    way = np.subtract(moved.position_um, pose.position_um)
    assert way[2] == 0
    heading = np.radians(heading_deg)
    assert way[:2] / np.linalg.norm(way) == pytest.approx([np.cos(heading), np.sin(heading)], abs=1e-9)
