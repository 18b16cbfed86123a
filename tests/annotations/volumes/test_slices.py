from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.volumes import (
    Level,
    averaged_level,
    detail_block,
    level_slice,
    open_volume,
    strided_preview,
)

SPACING_UM = (15.9, 13.5, 9.4)


@given(
    shape=st.tuples(*[st.integers(1, 30)] * 3),
    budget=st.integers(1, 4000),
    axis=st.integers(0, 2),
    averaged=st.booleans(),
    data=st.data(),
)
def test_the_nearest_plane_of_a_level_is_shown(
    tmp_path_factory: pytest.TempPathFactory,
    shape: tuple[int, int, int],
    budget: int,
    axis: int,
    averaged: bool,
    data: st.DataObject,
) -> None:
    index = data.draw(st.integers(0, shape[axis] - 1))
    path = tmp_path_factory.mktemp("slices") / "v.npy"
    along = np.arange(shape[axis], dtype=np.float32)
    np.save(path, np.moveaxis(np.broadcast_to(along, (*np.delete(shape, axis), shape[axis])), -1, axis))
    volume = open_volume(path)
    level = (
        averaged_level(
            volume, SPACING_UM, budget_voxels=budget, progress=lambda _: None, cancelled=lambda: False
        )
        if averaged
        else strided_preview(volume, SPACING_UM, budget_voxels=budget)
    )
    image = level_slice(level, shape, SPACING_UM, axis, index)
    # Each value is the index that it was taken from, or the mean of the indices.
    assert np.abs(image.data - index).max() <= level.factors[axis] - 0.5
    across, down = (other for other in range(3) if other != axis)
    assert image.data.shape == (level.data.shape[across], level.data.shape[down])
    assert image.spacing_um == (level.spacing_um[across], level.spacing_um[down])
    assert image.origin_um == (level.origin_um[across], level.origin_um[down])
    assert (image.axis, image.index, image.sharp) == (axis, index, False)
    assert image.data.flags.c_contiguous


@pytest.mark.parametrize("index", [-1, 5])
def test_planes_outside_the_volume_are_refused(tmp_path: Path, ramp: np.ndarray, index: int) -> None:
    np.save(tmp_path / "v.npy", ramp)
    volume = open_volume(tmp_path / "v.npy")
    level = strided_preview(volume, SPACING_UM)
    with pytest.raises(IndexError, match=str(index)):
        level_slice(level, volume.shape, SPACING_UM, 0, index)


def test_a_detail_shows_the_planes_that_cross_it_only(tmp_path: Path, ramp: np.ndarray) -> None:
    np.save(tmp_path / "v.npy", ramp)
    detail: Level = detail_block(open_volume(tmp_path / "v.npy"), (1.0, 1.0, 1.0), (3, 3, 3), 2.0)
    image = level_slice(detail, ramp.shape, (1.0, 1.0, 1.0), 0, 3)
    np.testing.assert_array_equal(image.data, ramp[3, 2:5, 2:5])
    assert image.origin_um == (2.0, 2.0)
    with pytest.raises(IndexError, match="detail"):
        level_slice(detail, ramp.shape, (1.0, 1.0, 1.0), 0, 1)
