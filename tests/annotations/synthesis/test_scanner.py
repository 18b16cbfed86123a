import numpy as np
import pytest

from annotations.geometry.body import Surface
from annotations.synthesis.grid import Grid
from annotations.synthesis.scanner import Scanner

GRID = Grid((1, 1, 1152))
Z_UM = GRID.axis_um(2)
EVERY_BIT_PATTERN = np.arange(65536, dtype=np.uint16)


def facing_surface(*depths_um: float, facing: float = 1.0) -> Surface:
    depths = np.array(depths_um)
    return Surface(depths, np.where(np.isfinite(depths), facing, 0.0))


@pytest.mark.parametrize("depth_um", [310.0, 2004.0, 5500.0])
@pytest.mark.parametrize("facing", [1.0, 0.7])
def test_the_brightest_voxel_of_a_column_is_its_surface(depth_um: float, facing: float) -> None:
    power = Scanner().mean_power(facing_surface(depth_um, facing=facing), GRID)[0]

    assert abs(Z_UM[power.argmax()] - depth_um) <= GRID.spacing_um[2]


def test_nearer_surfaces_are_brighter_and_those_beyond_the_signals_end_are_not_seen() -> None:
    power = Scanner().mean_power(facing_surface(1000, 2500, 4000, 5500, 6800), GRID).max(axis=1)
    free = Scanner().mean_power(facing_surface(np.inf), GRID).max()

    assert np.all(np.diff(power) < 0)
    assert power[3] > 50 * free
    assert power[4] <= free


def test_a_surface_seen_from_the_side_is_fainter() -> None:
    seen = [Scanner().mean_power(facing_surface(2000, facing=cosine), GRID).max() for cosine in (1, 0.7, 0.2)]

    assert seen[0] > 1.5 * seen[1] > 3 * seen[2]


def test_below_a_surface_the_signal_decays_into_shadow() -> None:
    struck, free = Scanner().mean_power(facing_surface(1500, np.inf), GRID)
    below = 1500 + 3 * Scanner().axial_sigma_um < Z_UM

    assert np.all(np.diff(struck[below]) <= 0)
    shadow = (Z_UM > 4500) & (Z_UM < 5500)
    assert np.all(struck[shadow] < free[shadow])
    assert struck[shadow] == pytest.approx(1, abs=0.01)


def test_above_a_surface_the_medium_looks_as_if_there_were_none() -> None:
    struck, free = Scanner().mean_power(facing_surface(3000, np.inf), GRID)
    above = Z_UM < 3000 - 60

    assert struck[above] == pytest.approx(free[above], rel=1e-3)


def test_speckle_multiplies_the_power_by_a_variate_of_mean_one() -> None:
    scanner = Scanner(medium_db=-100, noise_grey=120.0, looks=4.0)
    grid = Grid((1, 1, 65536))

    grey = scanner.image(facing_surface(np.inf), grid, EVERY_BIT_PATTERN[None])[0].astype(float)

    # Grey values are cut to whole numbers: half of one is what is missing on average.
    power = 10 ** ((grey + 0.5 - 120) / scanner.grey_per_db / 10)
    assert power.mean() == pytest.approx(1, rel=0.02)
    assert power.var() == pytest.approx(1 / 4, rel=0.05)


def test_speckle_has_the_same_contrast_on_bright_and_dark() -> None:
    spread = []
    for decibels in (0.0, 20.0):
        scanner = Scanner(medium_db=decibels, attenuation_db_per_mm=0, signal_end_um=1e12, noise_grey=80)
        grey = scanner.image(facing_surface(np.inf), Grid((1, 1, 65536)), EVERY_BIT_PATTERN[None])
        spread.append(grey.std())

    assert spread[0] == pytest.approx(spread[1], rel=0.03)


def test_grey_values_saturate_instead_of_wrapping() -> None:
    bits = np.zeros((2, 1152), dtype=np.uint16)
    bits[1] = 65535
    surface = facing_surface(400, 400)

    dark, bright = Scanner(surface_db=100).image(surface, GRID, bits)

    assert dark.dtype == np.uint8
    assert bright.max() == 255
    assert dark[-1] == 0


def test_a_single_plane_of_depth_can_be_made() -> None:
    image = Scanner().image(facing_surface(0.0), Grid((1, 1, 1)), np.full((1, 1), 32768, dtype=np.uint16))

    assert image.shape == (1, 1)
    assert image[0, 0] > 100
