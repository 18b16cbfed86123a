"""From a volume to keypoints in micrometres."""

from pathlib import Path

import numpy as np
import pytest

from annotations.geometry.frames import Vector
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.prediction.predictor import Predictor
from annotations.volumes import VolumeError, open_volume
from annotations.volumes.sampling import OMES_SAMPLING, PUBLISHED_SAMPLING, sample_volume
from tests.annotations.prediction.known_keypoints import (
    COARSE,
    KnowingNetwork,
    checkpoint,
    described,
    heatmaps_of,
)

FULL_UM, REAL_TIME_UM = (200.0, 150.0, 100.0), (1300.0, 150.0, 100.0)
KNOWN_UM = {
    "k0": (3000.0, 4000.0, 2000.0),
    "k1": (9000.0, 15000.0, 4000.0),
    "k2": (12345.6, 20000.1, 9876.5),
    # Out of view, within the margin.
    "k3": (-2000.0, 4000.0, 2000.0),
    "k4": (5000.0, -1500.0, 11000.0),
}


def write_volume(path: Path, spacing_um: Vector) -> Path:
    shape = [
        int(np.ceil(extent_um / um)) for extent_um, um in zip((17400, 26100, 10800), spacing_um, strict=True)
    ]
    np.save(path, np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8))
    return path


@pytest.mark.parametrize("spacing_um", [FULL_UM, REAL_TIME_UM], ids=["full", "real-time"])
def test_known_keypoints_are_found_in_either_kind_of_volume(tmp_path: Path, spacing_um: Vector) -> None:
    description = described(COARSE)
    network = KnowingNetwork(heatmaps_of(description, KNOWN_UM, spacing_um))

    with open_volume(write_volume(tmp_path / "v.npy", spacing_um)) as volume:
        found = Predictor(checkpoint(description), network).predict(volume, spacing_um)

    voxel_um = 2 * np.array(COARSE.spacing_um)
    for name, position_um in KNOWN_UM.items():
        np.testing.assert_array_less(np.abs(found.by_name[name] - np.array(position_um)), 0.01 * voxel_um)
    assert set(found.by_name) == set(KNOWN_UM)
    assert found.names == description.keypoints


def test_a_keypoint_beyond_the_range_has_no_position(tmp_path: Path) -> None:
    description = described(COARSE)
    beyond = {**KNOWN_UM, "k5": (60000.0, 0.0, 0.0)}
    network = KnowingNetwork(heatmaps_of(description, beyond, FULL_UM))

    found = Predictor(checkpoint(description), network).predict_samples(
        np.zeros(COARSE.shape, dtype=np.float32), FULL_UM
    )

    assert np.isnan(found.positions_um[5]).all()
    assert found.presence[5] < 0.5 < found.presence[:5].min()


def test_the_network_sees_the_samples_scaled_and_padded(tmp_path: Path) -> None:
    description = described(COARSE)
    network = KnowingNetwork(heatmaps_of(description, KNOWN_UM, FULL_UM))
    predictor = Predictor(checkpoint(description), network)

    with open_volume(write_volume(tmp_path / "v.npy", FULL_UM)) as volume:
        direct = predictor.predict(volume, FULL_UM)
        by_samples = predictor.predict_samples(sample_volume(volume, FULL_UM, COARSE), FULL_UM)

    first, second = network.seen
    assert first.shape == COARSE.padded_shape
    assert first.max() <= 1
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(direct.positions_um, by_samples.positions_um)


def test_the_stages_are_timed() -> None:
    description = described(COARSE)
    network = KnowingNetwork(heatmaps_of(description, KNOWN_UM, FULL_UM))

    times = Predictor(checkpoint(description), network).predict_samples(np.zeros(COARSE.shape), FULL_UM).times

    assert times.sampling_s == 0
    assert times.network_s > 0
    assert times.decoding_s > 0


def test_the_spread_of_a_sure_network_is_what_it_was_taught() -> None:
    description = described(OMES_SAMPLING)
    middle_um = (8000.0, 13000.0, 5000.0)
    network = KnowingNetwork(heatmaps_of(description, dict.fromkeys(KNOWN_UM, middle_um), FULL_UM))

    found = Predictor(checkpoint(description), network).predict_samples(
        np.zeros(OMES_SAMPLING.shape), FULL_UM
    )

    taught_um = 2 * np.multiply(description.heatmaps.sigma_voxel, OMES_SAMPLING.spacing_um)
    np.testing.assert_allclose(found.spread_um[0], taught_um, rtol=0.02)


@pytest.mark.parametrize(
    ("convention", "off_voxel"),
    [
        (HeatmapConvention(reduction=(1, 1, 1), target="gaussian", decoding="argmax"), 0.5),
        (
            HeatmapConvention(
                reduction=(1, 1, 1),
                target="gaussian",
                decoding="soft-argmax",
                temperature=100.0,
                shrink=0.8,
            ),
            0.5 / 0.8,
        ),
    ],
    ids=["argmax", "soft-argmax, shrunk"],
)
def test_the_published_conventions_are_undone(convention: HeatmapConvention, off_voxel: float) -> None:
    description = described(PUBLISHED_SAMPLING, convention)
    inside_um = {"k0": (5000.0, 9000.0, 3000.0), "k3": (9100.0, 15100.0, 7200.0)}
    network = KnowingNetwork(heatmaps_of(description, inside_um, (15.9, 13.5, 9.4)))

    found = Predictor(checkpoint(description), network).predict_samples(
        np.zeros(PUBLISHED_SAMPLING.shape), (15.9, 13.5, 9.4)
    )

    assert set(found.by_name) == set(inside_um)
    for name, position_um in inside_um.items():
        off = np.abs(found.by_name[name] - np.array(position_um)) / PUBLISHED_SAMPLING.spacing_um
        assert off.max() <= off_voxel + 1e-6


def test_a_volume_of_another_kind_is_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", np.zeros((20, 20, 20), dtype=np.uint16))
    network = KnowingNetwork(heatmaps_of(described(COARSE), KNOWN_UM, FULL_UM))

    with open_volume(tmp_path / "v.npy") as volume, pytest.raises(VolumeError, match="uint16"):
        Predictor(checkpoint(described(COARSE)), network).predict(volume, FULL_UM)
    assert not network.seen
