"""Samples of intensities: enough, and from everywhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.volumes import Level, evenly_sampled, intensity_window, surface_threshold
from annotations.volumes.intensity_samples import intensity_samples

sides = st.tuples(*[st.integers(1, 12)] * 3)


@given(shape=sides, count=st.integers(1, 2000), order=st.sampled_from("CF"))
def test_there_are_enough_samples_from_every_plane(
    shape: tuple[int, int, int], count: int, order: str
) -> None:
    places = np.arange(np.prod(shape)).reshape(shape, order=order)
    sampled = evenly_sampled(places, count)
    assert np.unique(sampled).size == sampled.size
    assert sampled.size >= min(count, places.size)
    # With fewer of them, 71 of these shapes and steps are less even.
    if sampled.size >= 8 * max(shape):
        for axis, along in enumerate(np.unravel_index(sampled, shape, order=order)):
            counts = np.bincount(along, minlength=shape[axis])
            assert counts.max() <= 2 * counts.min() + 2


@pytest.mark.parametrize("shape", [(3, 570, 570), (4, 500, 500), (570, 3, 570), (570, 570, 3)])
@pytest.mark.parametrize("order", ["C", "F"])
def test_a_thin_volume_is_not_judged_by_one_plane(shape: tuple[int, int, int], order: str) -> None:
    thin = int(np.argmin(shape))
    data = np.full(shape, 120, np.uint8)
    data[(slice(None),) * thin + (0,)] = 5
    level = Level(np.array(data, order=order), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), "strided", (1, 1, 1))
    assert intensity_window(level) == (5.0, 120.0)
    assert surface_threshold(level) > 5


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
def test_percentiles_are_those_of_all(dtype: type) -> None:
    data = np.random.default_rng(3).integers(0, 100, (40, 50, 60)).astype(dtype)
    samples = intensity_samples(data)
    assert samples.size == data.size
    for percent in (0.0, 1.0, 50.0, 99.8, 100.0):
        assert samples.percentile(percent) == pytest.approx(np.percentile(data, percent))
