import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from annotations.geometry import rotations
from annotations.geometry.body import LinkBody, link_bodies, surface_from_above
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool_library import shipped_tools

FORCEPS = shipped_tools()["magnetic-forceps"]


@st.composite
def bodies(draw: st.DrawFn) -> LinkBody:
    length, width, height = (draw(st.floats(200, 6000)) for _ in range(3))
    is_round = draw(st.booleans())
    raw = draw(st.tuples(*[st.floats(-1, 1)] * 4))
    assume(np.linalg.norm(raw) > 0.1)
    return LinkBody(
        center_um=np.array(draw(st.tuples(*[st.floats(-2e4, 2e4)] * 3))),
        axes=rotations.matrix(raw),
        half_size_um=np.array([length, width, width if is_round else height]),
        is_round=is_round,
    )


def columns_over(body: LinkBody, count: int = 15) -> tuple[np.ndarray, np.ndarray]:
    low, high = body.bounds_um()
    x, y = np.meshgrid(
        np.linspace(low[0] - 50, high[0] + 50, count),
        np.linspace(low[1] - 50, high[1] + 50, count),
        indexing="ij",
    )
    return x.ravel(), y.ravel()


@given(bodies())
def test_light_ends_on_the_surface_with_nothing_of_the_body_above(body: LinkBody) -> None:
    x, y = columns_over(body)
    hit = body.first_hit(x, y)
    struck = np.isfinite(hit.depth_um)
    assert struck.any()
    on_surface = np.column_stack([x, y, hit.depth_um])[struck]

    assert np.abs(body.distance_um(on_surface)).max() < 0.01
    for height_um in (1.0, 30.0, 1000.0):
        assert body.distance_um(on_surface - [0, 0, height_um]).min() > -0.01


@given(bodies())
def test_a_column_without_a_hit_passes_beside_the_body(body: LinkBody) -> None:
    x, y = columns_over(body)
    missed = ~np.isfinite(body.first_hit(x, y).depth_um)
    low, high = body.bounds_um()
    along = np.column_stack([np.repeat(x[missed], 60), np.repeat(y[missed], 60)])
    depths = np.tile(np.linspace(low[2], high[2], 60), missed.sum())

    assert body.distance_um(np.column_stack([along, depths])).min(initial=np.inf) > -0.01


@given(bodies(), st.integers(0, 10_000))
def test_distance_is_that_to_the_nearest_place_of_the_surface_on_either_side(
    body: LinkBody, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    positions = body.center_um + rng.uniform(-1.2, 1.2, (50, 3)) * body.half_size_um @ body.axes.T
    distance = body.distance_um(positions)
    step_um = 1e-3
    slope = np.stack(
        [body.distance_um(positions + step_um * np.eye(3)[axis]) - distance for axis in range(3)], axis=-1
    )
    # Where two faces are equally near the slope jumps, and a step may straddle that.
    smooth = np.abs(np.linalg.norm(slope / step_um, axis=-1) - 1) < 1e-3

    assert smooth.mean() > 0.9
    nearest = positions - distance[:, None] * slope / step_um
    assert np.abs(body.distance_um(nearest[smooth])).max() < 1e-2 * body.half_size_um.max()


@given(bodies())
def test_bounds_hold_the_body_and_touch_it(body: LinkBody) -> None:
    x, y = columns_over(body)
    low, high = body.bounds_um()
    hit = body.first_hit(x, y)
    struck = np.isfinite(hit.depth_um)

    assert hit.depth_um[struck].min() >= low[2] - 0.01
    assert np.all((x[struck] >= low[0]) & (x[struck] <= high[0]))
    # Rounded edges keep within the bounds of the sharp shape, by less than their own radius.
    corners = np.array([low, high])
    for axis in range(3):
        for corner in corners:
            assert (
                body.distance_um(np.where(np.arange(3) == axis, corner, body.center_um)) > -body.edge_um - 1
            )


@given(bodies(), st.integers(0, 10_000))
def test_facing_is_the_slope_of_the_height(body: LinkBody, seed: int) -> None:
    x, y = columns_over(body)
    index = np.random.default_rng(seed).integers(len(x))
    step_um = 0.05
    around = body.first_hit(
        x[index] + np.array([-1, 1, 0, 0, 0]) * step_um, y[index] + np.array([0, 0, -1, 1, 0]) * step_um
    )
    assume(np.all(np.isfinite(around.depth_um)))
    slope_x, slope_y = np.diff(around.depth_um)[[0, 2]] / (2 * step_um)
    assume(np.hypot(slope_x, slope_y) < 3)

    assert around.facing[4] == pytest.approx(1 / np.sqrt(1 + slope_x**2 + slope_y**2), abs=0.02)


def test_distance_of_a_cylinder_is_that_of_the_formula() -> None:
    body = LinkBody(np.zeros(3), np.eye(3), np.array([5000.0, 2000.0, 2000.0]), is_round=True)

    positions = [[0, 3000, 0], [0, 1200, 1600], [5100, 0, 0], [0, 0, -1000], [4900, 0, 0]]
    assert body.distance_um(positions) == pytest.approx([1000, 0, 100, -1000, -100])


def test_distance_of_a_box_is_that_of_the_formula() -> None:
    body = LinkBody(np.zeros(3), np.eye(3), np.array([3000.0, 2000.0, 1000.0]), is_round=False)

    positions = [[0, 2300, 0], [0, 0, -1000], [3001, 0, 0], [0, 0, 0], [0, -1700, 0]]
    assert body.distance_um(positions) == pytest.approx([300, 0, 1, -1000, -300])


def test_each_links_body_lies_between_its_keypoints() -> None:
    pose = ToolPose((8000.0, 9000.0, 3000.0), rotations.quaternion((1, 0.2, -0.1, 0.5)), {"theta1": 40.0})
    points = keypoints_um(pose, FORCEPS)

    for name, body in link_bodies(pose, FORCEPS).items():
        link = FORCEPS.link(name)
        ends = np.array([points[link.base], points[link.tip]])
        assert body.center_um == pytest.approx(ends.mean(axis=0))
        assert body.distance_um(ends) == pytest.approx([0, 0], abs=1e-6)
        assert body.is_round == (link.cross_section_um[0] == link.cross_section_um[1])


@pytest.mark.parametrize("upper_first", [True, False])
def test_the_nearer_of_two_bodies_is_seen(upper_first: bool) -> None:
    half = np.array([1000.0, 500.0, 500.0])
    upper = LinkBody(np.array([0.0, 0.0, 1000.0]), np.eye(3), half, is_round=True)
    lower = LinkBody(np.array([0.0, 0.0, 3000.0]), np.eye(3), half * [3, 1, 1], is_round=True)
    x = np.array([-2000.0, 0.0, 2000.0, 4000.0])

    surface = surface_from_above([upper, lower] if upper_first else [lower, upper], x, np.zeros(1))

    assert surface.depth_um[:, 0] == pytest.approx([2500, 500, 2500, np.inf])
    assert surface.facing[:, 0] == pytest.approx([1, 1, 1, 0])
