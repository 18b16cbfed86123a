import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from annotations.volumes import (
    Ray,
    brightest_sample,
    clip_to_box,
    closest_approach,
    first_surface,
    intensities_along,
)

ORIGIN_UM = (120.0, -40.0, 7.0)
SPACING_UM = (15.9, 13.5, 9.4)
SHAPE = (24, 28, 40)

coordinate = st.floats(-1e4, 1e4)
points = st.tuples(coordinate, coordinate, coordinate)


@st.composite
def directions(draw: st.DrawFn) -> tuple[float, float, float]:
    azimuth, height = draw(st.floats(0, 2 * math.pi)), draw(st.floats(-1, 1))
    flat = math.sqrt(1 - height * height)
    return (flat * math.cos(azimuth), flat * math.sin(azimuth), height)


def centres_um() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x, y, z = (
        origin + np.arange(length) * step
        for origin, length, step in zip(ORIGIN_UM, SHAPE, SPACING_UM, strict=True)
    )
    return x[:, None, None], y[None, :, None], z[None, None, :]


CENTRE_UM = np.add(ORIGIN_UM, np.multiply(np.subtract(SHAPE, 1), SPACING_UM) / 2)
HALF_UM = np.multiply(np.subtract(SHAPE, 1), SPACING_UM) / 2


def test_a_ray_has_a_unit_direction() -> None:
    assert Ray((1, 2, 3), (0, 0, -5)) == Ray((1.0, 2.0, 3.0), (0.0, 0.0, -1.0))
    assert Ray.through((1, 1, 1), (1, 4, 1)) == Ray((1, 1, 1), (0, 1, 0))
    assert Ray((0, 0, 0), (3e-200, 4e-200, 0)).direction == pytest.approx((0.6, 0.8, 0))
    assert Ray((1, 2, 3), (0, 2, 0)).at(10) == (1, 12, 3)


@pytest.mark.parametrize("direction", [(0, 0, 0), (math.nan, 0, 1), (math.inf, 0, 0)])
def test_a_ray_without_a_direction_is_refused(direction: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="ray"):
        Ray((0, 0, 0), direction)


def test_a_ray_from_nowhere_is_refused() -> None:
    with pytest.raises(ValueError, match="ray"):
        Ray((math.nan, 0, 0), (0, 0, 1))


@given(points, directions(), st.tuples(*[st.floats(0, 1)] * 3))
def test_a_ray_towards_a_point_in_a_box_enters_and_leaves_it(
    start: tuple[float, float, float],
    direction: tuple[float, float, float],
    share: tuple[float, float, float],
) -> None:
    low, high = np.array([-3.0, 5.0, 100.0]), np.array([40.0, 6.0, 900.0])
    target = low + np.array(share) * (high - low)
    ray = Ray(tuple(target - 5000 * np.array(direction)), direction)
    span = clip_to_box(ray, low - 1e-6, high + 1e-6)
    assert span is not None
    enter, leave = span
    assert enter - 1e-3 <= 5000 <= leave + 1e-3
    for distance in span:
        at = np.array(ray.at(distance))
        assert np.all(at >= low - 1e-3)
        assert np.all(at <= high + 1e-3)


@pytest.mark.parametrize(
    ("origin", "direction", "span"),
    [
        ((0.5, 0.5, -2), (0, 0, 1), (2, 3)),
        ((0.5, 0.5, 0.5), (0, 0, 1), (0, 0.5)),
        ((0.5, 0.5, 2), (0, 0, 1), None),
        ((0.5, 1.5, -2), (0, 0, 1), None),
        ((1, 1, -2), (0, 0, 1), (2, 3)),
        ((-1, -1, -1), (1, 1, 1), (math.sqrt(3), 2 * math.sqrt(3))),
        ((-1, 0.5, 0.5), (1, 1, 0), None),
    ],
)
def test_clipping(
    origin: tuple[float, ...], direction: tuple[float, ...], span: tuple[float, float] | None
) -> None:
    found = clip_to_box(Ray(origin, direction), (0, 0, 0), (1, 1, 1))
    assert found == (None if span is None else pytest.approx(span))


@given(normal=directions(), direction=directions(), share=st.floats(-0.5, 0.5))
def test_the_surface_of_a_plane_is_where_the_ray_crosses_it(
    normal: tuple[float, float, float], direction: tuple[float, float, float], share: float
) -> None:
    """A linear field is trilinear, so the crossing is exact up to the refinement."""
    slope = float(np.dot(normal, direction))
    assume(slope > 0.1)
    x, y, z = centres_um()
    field = normal[0] * (x - CENTRE_UM[0]) + normal[1] * (y - CENTRE_UM[1]) + normal[2] * (z - CENTRE_UM[2])
    # The crossing lies on the ray through the centre, within the volume.
    crossing = CENTRE_UM + share * HALF_UM.min() * np.array(direction)
    threshold = float(np.dot(normal, crossing - CENTRE_UM))
    ray = Ray(tuple(CENTRE_UM - 2000 * np.array(direction)), direction)
    found = first_surface(field, SPACING_UM, ORIGIN_UM, ray, threshold)
    assert found is not None
    assert np.linalg.norm(found - crossing) < 0.005 * max(SPACING_UM)


@given(direction=directions(), share=st.floats(0.2, 0.8))
def test_the_surface_of_a_sphere_is_met_on_the_near_side(
    direction: tuple[float, float, float], share: float
) -> None:
    x, y, z = centres_um()
    radius = share * HALF_UM.min()
    depth = radius - np.sqrt((x - CENTRE_UM[0]) ** 2 + (y - CENTRE_UM[1]) ** 2 + (z - CENTRE_UM[2]) ** 2)
    ray = Ray(tuple(CENTRE_UM - 3000 * np.array(direction)), direction)
    found = first_surface(depth, SPACING_UM, ORIGIN_UM, ray, 0.0)
    assert found is not None
    np.testing.assert_allclose(found, CENTRE_UM - radius * np.array(direction), atol=0.15 * max(SPACING_UM))


@given(points, points, st.floats(-1, 2))
def test_a_surface_lies_on_the_ray_and_in_the_volume_and_is_bright(
    start: tuple[float, float, float], target: tuple[float, float, float], threshold: float
) -> None:
    assume(start != target)
    data = np.random.default_rng(5).random(SHAPE)
    ray = Ray.through(start, target)
    found = first_surface(data, SPACING_UM, ORIGIN_UM, ray, threshold)
    inside = clip_to_box(ray, CENTRE_UM - HALF_UM, CENTRE_UM + HALF_UM)
    if inside is None or threshold > 1:
        assert found is None
    if found is not None:
        along = np.dot(np.subtract(found, ray.origin_um), ray.direction)
        np.testing.assert_allclose(ray.at(along), found, atol=1e-6)
        assert np.all(np.abs(found - CENTRE_UM) <= HALF_UM + 1e-6)
    if inside is not None and threshold <= 0:
        assert found == pytest.approx(ray.at(inside[0]))


def test_a_volume_that_starts_bright_is_met_at_its_border() -> None:
    ray = Ray((0, 0, -100), (0, 0, 1))
    assert first_surface(np.ones((3, 3, 3)), (1, 1, 1), (0, 0, 0), ray, 0.5) == (0, 0, 0)


def test_a_volume_of_one_plane_is_met() -> None:
    data = np.zeros((1, 4, 4), np.uint8)
    data[0, 2, 2] = 200
    found = first_surface(data, (622.0, 13.5, 9.4), (0, 0, 0), Ray((-5000, 27, 18.8), (1, 0, 0)), 100)
    assert found == pytest.approx((-311, 27, 18.8))
    along_the_plane = Ray((0, -100, 18.8), (0, 1, 0))
    found = first_surface(data, (622.0, 13.5, 9.4), (0, 0, 0), along_the_plane, 100)
    assert found == pytest.approx((0, 27 - 13.5 / 2, 18.8), abs=0.02)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("dtype", ["u1", "i2", "f2", "f4", "f8"])
def test_every_type_of_data_is_sampled(dtype: str) -> None:
    data = np.zeros((5, 5, 5), dtype)
    data[2, 2, 2:] = 100
    ray = Ray((2, 2, -9), (0, 0, 1))
    assert first_surface(data, (1, 1, 1), (0, 0, 0), ray, 50) == pytest.approx((2, 2, 1.5), abs=2e-3)
    assert brightest_sample(data, (1, 1, 1), (0, 0, 0), ray) == (2, 2, 3)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_nan_is_no_surface_and_infinity_is_one() -> None:
    data = np.zeros((3, 3, 9))
    data[1, 1, 2] = np.nan
    data[1, 1, 6] = np.inf
    ray = Ray((1, 1, -5), (0, 0, 1))
    found = first_surface(data, (1, 1, 1), (0, 0, 0), ray, 1)
    assert found is not None
    assert 5 <= found[2] <= 5.1
    assert brightest_sample(data, (1, 1, 1), (0, 0, 0), ray) == (1, 1, 6)
    nothing = np.full((3, 3, 3), np.nan)
    assert first_surface(nothing, (1, 1, 1), (0, 0, 0), ray, 0) is None
    assert brightest_sample(nothing, (1, 1, 1), (0, 0, 0), ray) is None


@given(
    st.tuples(*[st.integers(2, length - 3) for length in SHAPE]),
    directions(),
)
def test_the_brightest_sample_is_the_bright_voxel(
    place: tuple[int, int, int], direction: tuple[float, float, float]
) -> None:
    data = np.random.default_rng(1).random(SHAPE)
    data[place] = 50.0
    position = np.add(ORIGIN_UM, np.multiply(place, SPACING_UM))
    ray = Ray(tuple(position - 2000 * np.array(direction)), direction)
    found = brightest_sample(data, SPACING_UM, ORIGIN_UM, ray)
    assert found is not None
    assert np.abs((found - position) / SPACING_UM).max() <= 0.26


def test_of_a_saturated_reflection_the_middle_is_taken() -> None:
    data = np.zeros((3, 3, 30), np.uint8)
    data[:, :, 8:19] = 255
    data[:, :, 25:] = 255
    assert brightest_sample(data, (1, 1, 1), (0, 0, 0), Ray((1, 1, 40), (0, 0, -1))) == (1, 1, 27)
    assert brightest_sample(data, (1, 1, 1), (0, 0, 0), Ray((1, 1, -1), (0, 0, 1))) == (1, 1, 13)


def test_a_ray_that_misses_meets_nothing() -> None:
    ray = Ray((100, 100, 100), (0, 0, 1))
    assert first_surface(np.ones((3, 3, 3)), (1, 1, 1), (0, 0, 0), ray, 0) is None
    assert brightest_sample(np.ones((3, 3, 3)), (1, 1, 1), (0, 0, 0), ray) is None


@given(points, directions(), directions(), st.floats(-3000, 3000), st.floats(-3000, 3000))
def test_rays_that_meet_do_so_without_a_gap(
    meeting: tuple[float, float, float],
    along_a: tuple[float, float, float],
    along_b: tuple[float, float, float],
    back_a: float,
    back_b: float,
) -> None:
    assume(np.linalg.norm(np.cross(along_a, along_b)) > 0.01)
    ray_a = Ray(tuple(np.array(meeting) - back_a * np.array(along_a)), along_a)
    ray_b = Ray(tuple(np.array(meeting) - back_b * np.array(along_b)), along_b)
    found = closest_approach(ray_a, ray_b)
    np.testing.assert_allclose(found.position_um, meeting, atol=1e-4)
    assert found.gap_um == pytest.approx(0, abs=1e-4)


def test_rays_that_pass_each_other_meet_half_way() -> None:
    found = closest_approach(Ray((-9, 0, 0), (1, 0, 0)), Ray((5, -7, 4), (0, 1, 0)))
    assert found.position_um == pytest.approx((5, 0, 2))
    assert found.gap_um == pytest.approx(4)
    assert found.angle_deg == pytest.approx(90)


@pytest.mark.parametrize("sense", [1, -1])
def test_parallel_rays_say_so(sense: int) -> None:
    found = closest_approach(Ray((1, 0, 0), (0, 0, 1)), Ray((1, 6, 50), (0, 0, sense)))
    assert found.position_um == pytest.approx((1, 3, 0))
    assert found.gap_um == pytest.approx(6)
    assert found.angle_deg == 0


@given(directions(), st.floats(0.001, 90))
def test_the_angle_between_rays_keeps_its_digits(along: tuple[float, float, float], angle_deg: float) -> None:
    other = np.cross(along, (1, 0, 0) if abs(along[0]) < 0.7 else (0, 1, 0))
    other /= np.linalg.norm(other)
    turned = math.cos(math.radians(angle_deg)) * np.array(along) + math.sin(math.radians(angle_deg)) * other
    found = closest_approach(Ray((0, 0, 0), along), Ray((9, 9, 9), tuple(turned)))
    assert found.angle_deg == pytest.approx(angle_deg, rel=1e-8)


def test_the_intensities_along_a_ray_are_those_at_its_positions() -> None:
    x, y, z = np.indices((9, 11, 13), dtype=float)
    low, high = (ORIGIN_UM + np.multiply(index, SPACING_UM) for index in ((1, 2, -3), (7, 6, 14)))
    ray = Ray.through(low, high)
    sampled = intensities_along(2 * x + 3 * y - z, SPACING_UM, ORIGIN_UM, ray)
    assert sampled is not None
    distances_um, values = sampled
    assert np.ptp(np.diff(distances_um)) == pytest.approx(0, abs=1e-9)
    index = (np.array([ray.at(float(at)) for at in distances_um]) - ORIGIN_UM) / SPACING_UM
    assert np.abs(np.diff(index, axis=0)).max() <= 0.5001
    np.testing.assert_allclose(values, index @ (2, 3, -1), atol=1e-9)
    away = Ray(ray.origin_um, (-1.0, 0.0, 0.0))
    assert intensities_along(x, SPACING_UM, ORIGIN_UM, away) is None
