"""Clouds of heatmaps: where they are, how much they hold, and when there is none."""

import numpy as np
import pytest

from annotations.prediction.heatmap_cloud import HALF, MOST, HeatmapCloud, heatmap_cloud
from annotations.prediction.volume_heatmaps import VolumeHeatmaps

SPACING_UM = np.array((1244.0, 378.0, 263.0))
ORIGIN_UM = np.array((-900.0, -1800.0, -680.0))
MIDDLE_UM = np.array((8200.0, 12900.0, 5100.0))
SIGMA_UM = 900.0


def heatmaps(presence: float = 1.0, sigma_um: float = SIGMA_UM) -> VolumeHeatmaps:
    """A Gaussian on the grid of a network."""
    axes = np.meshgrid(*(np.arange(size) for size in (16, 80, 48)), indexing="ij")
    away_um = ORIGIN_UM + np.stack(axes, axis=-1) * SPACING_UM - MIDDLE_UM
    values = np.exp(-(away_um**2).sum(axis=-1) / (2 * sigma_um**2))
    share = (presence * values / values.sum()).astype(np.float32)
    return VolumeHeatmaps(("k0",), share[None], tuple(ORIGIN_UM), tuple(SPACING_UM))


def cloud(made: VolumeHeatmaps) -> HeatmapCloud:
    found = heatmap_cloud(made, "k0")
    assert found is not None
    return found


def test_a_cloud_lies_where_the_heatmap_does() -> None:
    found = cloud(heatmaps())
    inside = np.argwhere(found.likelihood >= found.most)

    middle_um = found.origin_um + inside.mean(axis=0) * found.spacing_um
    assert middle_um == pytest.approx(MIDDLE_UM, abs=100)


@pytest.mark.parametrize(("level", "share", "radii"), [("half", HALF, 1.538), ("most", MOST, 2.795)])
def test_surfaces_hold_their_shares_of_a_gaussian(level: str, share: float, radii: float) -> None:
    found = cloud(heatmaps())
    inside = found.likelihood >= getattr(found, level)

    assert found.likelihood[inside].sum() / found.likelihood.sum() == pytest.approx(share, abs=0.02)
    # What is drawn is smoothed a little.
    volume_um3 = inside.sum() * np.prod(found.spacing_um)
    assert (3 * volume_um3 / (4 * np.pi)) ** (1 / 3) == pytest.approx(radii * SIGMA_UM, rel=0.12)


def test_surfaces_are_closed() -> None:
    found = cloud(heatmaps(sigma_um=6000.0))

    for axis in range(3):
        assert not found.likelihood.take((0, -1), axis=axis).any()
    assert found.likelihood.size < 200_000


def test_one_voxel_makes_a_cloud_too() -> None:
    probability = np.zeros((1, 6, 6, 6), np.float32)
    probability[0, 2, 3, 4] = 1.0
    found = cloud(VolumeHeatmaps(("k0",), probability, (0.0, 0.0, 0.0), (500.0, 500.0, 500.0)))

    highest = np.unravel_index(found.likelihood.argmax(), found.likelihood.shape)
    place_um = np.asarray(found.origin_um) + highest * np.asarray(found.spacing_um)
    assert place_um == pytest.approx((1000.0, 1500.0, 2000.0), abs=260)
    assert found.half >= found.most > 0


def test_a_keypoint_that_is_not_seen_has_no_cloud() -> None:
    assert heatmap_cloud(heatmaps(presence=0.01), "k0") is None
    assert heatmap_cloud(heatmaps(), "k7") is None


def test_a_cloud_is_computed_once() -> None:
    made = heatmaps()

    assert heatmap_cloud(made, "k0") is heatmap_cloud(made, "k0")
