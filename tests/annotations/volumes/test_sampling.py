"""What a network sees of a volume."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from annotations.volumes import Volume, open_volume
from annotations.volumes.sampling import (
    OMES_SAMPLING,
    PUBLISHED_SAMPLING,
    Sampling,
    depth_cells,
    sample_volume,
    sampled_voxels,
)
from annotations.volumes.spacing import (
    OMES_REALTIME_SPACING_UM,
    OMES_SPACING_UM,
    SpacingUm,
    read_sidecar,
    sidecar_path,
)
from annotations.volumes.volume import VolumeError

SPACING_UM = (20.0, 10.0, 5.0)
FUZZ = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


def stored(
    folder: Path, array: np.ndarray, *, depth_axis: int = 2, spacing_um: SpacingUm = SPACING_UM
) -> Volume:
    """Write a volume, with the axis along which its light travels, and open it."""
    path = folder / "v.npy"
    np.save(path, array)
    sidecar_path(path).write_text(
        f'schema = "oct-volume/1"\nspacing_um = {list(spacing_um)}\ndepth_axis = {depth_axis}\n'
    )
    assert read_sidecar(path) is not None
    return open_volume(path)


def sampling(shape: tuple[int, int, int], stride: tuple[float, float, float], **fields: Any) -> Sampling:
    """Return a sampling that takes every so manieth voxel of a volume of `SPACING_UM`."""
    spacing_um = tuple(step * each for step, each in zip(stride, SPACING_UM, strict=True))
    return Sampling(shape=shape, spacing_um=spacing_um, **fields)


def slow_samples(array: np.ndarray, spacing_um: SpacingUm, wanted: Sampling) -> np.ndarray:
    """Sample voxel by voxel, the obvious way, by where each voxel lies in µm."""
    samples = np.full(wanted.shape, wanted.value_range[0], dtype=np.float64)
    for index in np.ndindex(*wanted.shape):
        chosen: list[slice] = []
        for axis, place in enumerate(index):
            at_um = place * wanted.spacing_um[axis]
            voxels_um = np.arange(array.shape[axis]) * spacing_um[axis]
            nearest = round(at_um / spacing_um[axis])
            if axis == wanted.depth_axis and wanted.is_averaged:
                until_um = at_um + wanted.spacing_um[axis]
                slack = spacing_um[axis] * 1e-6
                [inside] = np.nonzero((voxels_um >= at_um - slack) & (voxels_um < until_um - slack))
                chosen.append(slice(inside[0], inside[-1] + 1) if len(inside) else slice(0, 0))
            else:
                chosen.append(slice(nearest, min(nearest + 1, array.shape[axis])))
        values = array[tuple(chosen)]
        if values.size:
            samples[index] = values.mean()
    return samples


@FUZZ
@given(
    volume_shape=st.tuples(*[st.integers(1, 14)] * 3),
    shape=st.tuples(*[st.integers(1, 6)] * 3),
    stride=st.tuples(*[st.sampled_from([1.0, 1.3, 2.0, 2.5, 3.0, 7.0])] * 3),
    depth_axis=st.integers(0, 2),
    is_averaged=st.booleans(),
    in_fortran_order=st.booleans(),
)
def test_samples_are_those_of_the_obvious_way(
    tmp_path: Path,
    volume_shape: tuple[int, int, int],
    shape: tuple[int, int, int],
    stride: tuple[float, float, float],
    depth_axis: int,
    is_averaged: bool,
    in_fortran_order: bool,
) -> None:
    array = np.random.default_rng(1).integers(0, 256, volume_shape, dtype=np.uint8)
    wanted = sampling(shape, stride, depth_axis=depth_axis, is_averaged=is_averaged)
    order = np.asfortranarray if in_fortran_order else np.ascontiguousarray

    with stored(tmp_path, order(array), depth_axis=depth_axis) as volume:
        samples = sample_volume(volume, SPACING_UM, wanted)

    assert samples.dtype == np.float32
    np.testing.assert_allclose(samples, slow_samples(array, SPACING_UM, wanted), rtol=1e-6)


def test_a_cell_s_mean_is_exact(tmp_path: Path) -> None:
    array = np.zeros((1, 1, 8), dtype=np.uint8)
    array[0, 0] = [0, 1, 255, 255, 254, 255, 3, 4]

    with stored(tmp_path, array) as volume:
        samples = sample_volume(volume, SPACING_UM, sampling((1, 1, 2), (1, 1, 4)))

    np.testing.assert_array_equal(samples, [[[127.75, 129.0]]])


def test_a_last_cell_that_is_not_full_is_the_mean_of_what_is_there(tmp_path: Path) -> None:
    array = np.array([[[1, 3, 10, 20, 7]]], dtype=np.uint8)

    with stored(tmp_path, array) as volume:
        samples = sample_volume(volume, SPACING_UM, sampling((1, 1, 4), (1, 1, 2)))

    np.testing.assert_array_equal(samples, [[[2, 15, 7, 0]]])


def test_what_lies_beyond_a_small_volume_is_empty(tmp_path: Path) -> None:
    array = np.full((2, 3, 4), 200, dtype=np.uint8)
    wanted = sampling((4, 4, 4), (1, 1, 1), value_range=(50.0, 250.0), padding_before=(1, 0, 2))

    with stored(tmp_path, array) as volume:
        samples = sample_volume(volume, SPACING_UM, wanted)

    assert (samples[:2, :3] == 200).all()
    assert (samples[2:] == 50).all()
    assert (samples[:2, 3:] == 50).all()
    scaled = wanted.scaled(samples)
    assert scaled.shape == wanted.padded_shape == (5, 4, 6)
    assert np.count_nonzero(scaled) == array.size
    np.testing.assert_allclose(scaled[1:3, :3, 2:6], 0.75)


def test_what_lies_beyond_the_grid_of_a_large_volume_is_not_seen(tmp_path: Path) -> None:
    array = np.full((9, 9, 9), 255, dtype=np.uint8)
    array[:4, :4, :4] = 7

    with stored(tmp_path, array) as volume:
        samples = sample_volume(volume, SPACING_UM, sampling((2, 2, 2), (2, 2, 2)))

    assert (samples == 7).all()


def test_values_are_scaled_to_0_and_1_and_cut_off_there() -> None:
    wanted = Sampling(shape=(1, 1, 4), spacing_um=(1.0, 1.0, 1.0), value_range=(10.0, 20.0))

    scaled = wanted.scaled(np.array([[[0, 10, 15, 90]]], dtype=np.float32))

    assert scaled.dtype == np.float32
    np.testing.assert_allclose(scaled, [[[0, 0, 0.5, 1]]])


def ramp_um(shape: tuple[int, int, int], spacing_um: SpacingUm) -> np.ndarray:
    """Return a volume whose values grow steadily with the place in µm, whatever its spacing."""
    place = np.indices(shape).T @ np.array(spacing_um)
    return np.asarray((place.T / 25).astype(np.uint16))


def test_full_and_real_time_volumes_are_seen_alike(tmp_path: Path) -> None:
    wanted = Sampling(
        shape=(4, 6, 5), spacing_um=OMES_SAMPLING.spacing_um, dtype="uint16", value_range=(0.0, 65535.0)
    )
    full_shape, live_shape = (4 * 39, 6 * 14, 5 * 14), (4, 6 * 14, 5 * 14)
    seen = []
    for shape, spacing_um in ((full_shape, OMES_SPACING_UM), (live_shape, OMES_REALTIME_SPACING_UM)):
        with stored(tmp_path, ramp_um(shape, spacing_um), spacing_um=spacing_um) as volume:
            seen.append(sample_volume(volume, spacing_um, wanted))
        # The same in µm as well: a sample's value is its place.
        place_um = np.stack(
            np.meshgrid(*(wanted.axis_um(axis, spacing_um) for axis in range(3)), indexing="ij")
        ).sum(axis=0)
        # A voxel of the full volume may lie half of its 15.9 µm off, and values are cut to whole numbers.
        assert np.abs(seen[-1] * 25 - place_um).max() <= 15.9 / 2 + 25

    assert np.abs(seen[0] - seen[1]).max() <= math.ceil(15.9 / 2 / 25)


@pytest.mark.parametrize("spacing_um", [OMES_SPACING_UM, OMES_REALTIME_SPACING_UM])
def test_the_scanner_s_volumes_fill_the_grid(spacing_um: SpacingUm) -> None:
    shape = (28 if spacing_um == OMES_REALTIME_SPACING_UM else 1096, 1936, 1152)
    for wanted in (OMES_SAMPLING, PUBLISHED_SAMPLING):
        planes = sampled_voxels(wanted, spacing_um, shape, 0)
        rows = sampled_voxels(wanted, spacing_um, shape, 1)
        cells = depth_cells(wanted, spacing_um, shape)
        assert (len(planes), len(rows), len(cells) - 1) == wanted.shape
        assert set(np.diff(rows)) == {14}
        # The last cell ends with the volume.
        assert set(np.diff(cells)[:-1]) == {14}
        assert np.abs(planes * spacing_um[0] - np.arange(28) * 622).max() <= spacing_um[0] / 2


def test_the_padded_inputs_are_those_that_the_networks_take() -> None:
    assert OMES_SAMPLING.padded_shape == (32, 160, 96)
    assert PUBLISHED_SAMPLING.padded_shape == (32, 144, 88)


@given(
    index=st.tuples(*[st.floats(-50, 200)] * 3),
    spacing_um=st.sampled_from([OMES_SPACING_UM, OMES_REALTIME_SPACING_UM]),
    wanted=st.sampled_from([OMES_SAMPLING, PUBLISHED_SAMPLING]),
)
def test_indices_and_micrometres_are_converted_both_ways(
    index: tuple[float, float, float], spacing_um: SpacingUm, wanted: Sampling
) -> None:
    there = wanted.to_um([index], spacing_um)

    np.testing.assert_allclose(wanted.to_index(there, spacing_um), [index], atol=1e-9)
    padding = np.array(wanted.padding_before)
    first_um = [wanted.axis_um(axis, spacing_um)[0] for axis in range(3)]
    np.testing.assert_allclose(wanted.to_um(padding, spacing_um), first_um)


def test_an_averaged_sample_lies_in_the_middle_of_its_voxels() -> None:
    averaged = sampling((1, 1, 3), (1, 1, 4))
    single = sampling((1, 1, 3), (1, 1, 4), is_averaged=False)

    # Voxels 0 to 3, 5 µm apart.
    np.testing.assert_allclose(averaged.axis_um(2, SPACING_UM), [7.5, 27.5, 47.5])
    np.testing.assert_allclose(single.axis_um(2, SPACING_UM), [0, 20, 40])


@pytest.mark.parametrize(
    ("array", "depth_axis", "spacing_um", "said"),
    [
        (np.zeros((4, 4, 4), dtype=np.uint16), 2, SPACING_UM, "uint16"),
        (np.zeros((4, 4, 4), dtype=np.float32), 2, SPACING_UM, "float32"),
        (np.zeros((4, 4, 4), dtype=np.uint8), 0, SPACING_UM, "along axis 0"),
        (np.zeros((4, 4, 4), dtype=np.uint8), 2, (90.0, 10.0, 5.0), "90 µm apart along axis 0"),
        (np.zeros((4, 4, 4), dtype=np.uint8), 2, (20.0, 10.0, 11.0), "11 µm apart along axis 2"),
    ],
)
def test_a_volume_of_another_kind_is_refused(
    tmp_path: Path, array: np.ndarray, depth_axis: int, spacing_um: SpacingUm, said: str
) -> None:
    with (
        stored(tmp_path, array, depth_axis=depth_axis, spacing_um=spacing_um) as volume,
        pytest.raises(VolumeError, match=said) as caught,
    ):
        sample_volume(volume, spacing_um, sampling((2, 2, 2), (2, 2, 2)))
    assert str(volume.path) in str(caught.value)
    assert caught.value.remedy


def test_voxels_a_little_farther_apart_than_the_samples_give_every_sample_a_value(tmp_path: Path) -> None:
    array = np.full((1, 1, 300), 9, dtype=np.uint8)
    with stored(tmp_path, array) as volume:
        samples = sample_volume(volume, (20.0, 10.0, 5.04), sampling((1, 1, 250), (1, 1, 1)))

    assert (samples == 9).all()


def test_a_spacing_that_is_a_little_coarser_is_taken(tmp_path: Path) -> None:
    array = np.arange(27, dtype=np.uint8).reshape(3, 3, 3)
    with stored(tmp_path, array) as volume:
        samples = sample_volume(volume, (20.1, 10.05, 5.02), sampling((3, 3, 3), (1, 1, 1)))

    np.testing.assert_array_equal(samples, array)


@pytest.mark.parametrize(
    "fields",
    [
        {"shape": (0, 1, 1)},
        {"shape": (1 << 9, 1 << 9, 1 << 9)},
        {"spacing_um": (0.0, 1.0, 1.0)},
        {"spacing_um": (1.0, float("nan"), 1.0)},
        {"depth_axis": 3},
        {"value_range": (1.0, 1.0)},
        {"padding_after": (-1, 0, 0)},
        {"surprise": 1},
    ],
)
def test_a_sampling_that_is_impossible_is_refused(fields: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Sampling.model_validate({"shape": (2, 2, 2), "spacing_um": (1.0, 1.0, 1.0)} | fields)
