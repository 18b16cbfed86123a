import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry.kinematics import link_frames
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.grid import Grid
from annotations.synthesis.out_of_view import moved_out_of_view, share_out_of_view
from annotations.synthesis.scene import SceneSeed, random_scene

FORCEPS = shipped_tools()["magnetic-forceps"]


@given(st.integers(0, 2**32), st.floats(0.01, 0.9), st.floats(0, 360))
def test_as_much_of_the_tool_is_out_of_view_as_was_asked_for(
    seed: int, share: float, heading_deg: float
) -> None:
    pose = random_scene(FORCEPS, SceneSeed(seed)).pose

    moved = moved_out_of_view(pose, FORCEPS, Grid(), share, heading_deg)

    # Counted point by point along the links.
    steps = (np.arange(4000) + 0.5) / 4000
    outside, whole = 0.0, 0.0
    for name, frame in link_frames(moved, FORCEPS).items():
        length_um = FORCEPS.link(name).length_um
        index = (frame.base_um + np.outer(steps, frame.axes[:, 0]) * length_um) / Grid().spacing_um
        beside = np.any((index < -0.5) | (index > np.array(Grid().shape) - 0.5), axis=1)
        outside, whole = outside + beside.mean() * length_um, whole + length_um
    assert outside / whole == pytest.approx(share, abs=1e-3)
    # A link along the volume's side leaves it nearly at once.
    assert share_out_of_view(moved, FORCEPS, Grid()) == pytest.approx(share, abs=1e-4)


@given(st.integers(0, 2**32), st.floats(0, 360))
def test_the_tool_moves_the_way_that_was_asked_for(seed: int, heading_deg: float) -> None:
    pose = random_scene(FORCEPS, SceneSeed(seed)).pose

    moved = moved_out_of_view(pose, FORCEPS, Grid(), 0.2, heading_deg)

    way = np.subtract(moved.position_um, pose.position_um)
    assert way[2] == 0
    assert np.degrees(np.arctan2(way[1], way[0])) % 360 == pytest.approx(heading_deg % 360, abs=1e-6)
