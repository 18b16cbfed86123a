import numpy as np
import pytest

from annotations.volumes import SliceImage
from annotator.slices.projection import Plane
from annotator.slices.readout import intensity_text, read_out
from annotator.slices.viewport import Area, Viewport

SHAPE, SPACING_UM = (4, 6, 5), (20.0, 10.0, 30.0)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("depth_axis", range(3))
def test_every_voxel_of_a_slice_is_read_out_where_it_is_drawn(axis: int, depth_axis: int) -> None:
    volume = np.arange(np.prod(SHAPE)).reshape(SHAPE)
    plane = Plane.across(axis, SHAPE, SPACING_UM, depth_axis)
    viewport = Viewport.fitted(plane, Area(0, 0, 200, 150))
    first, second = (other for other in range(3) if other != axis)
    image = SliceImage(
        volume.take(1, axis), (SPACING_UM[first], SPACING_UM[second]), (0.0, 0.0), axis, 1, every=(1, 1)
    )

    for index_voxel in np.ndindex(SHAPE):
        if index_voxel[axis] != 1:
            continue
        position_um = tuple(np.multiply(index_voxel, SPACING_UM))
        readout = read_out(viewport, 1, image, *viewport.pixel(position_um))
        assert readout.index_voxel == index_voxel
        assert readout.intensity == str(volume[index_voxel])
        assert readout.position_um == pytest.approx(position_um, abs=1e-9)


def test_the_intensity_never_comes_from_a_coarse_slice() -> None:
    plane = Plane.across(0, SHAPE, SPACING_UM, 2)
    viewport = Viewport.fitted(plane, Area(0, 0, 200, 150))
    coarse = SliceImage(np.zeros((2, 2)), (30.0, 60.0), (0.0, 0.0), 0, 1)
    stale = SliceImage(np.zeros((6, 5)), (10.0, 30.0), (0.0, 0.0), 0, 2, every=(1, 1))

    for image in (coarse, stale, None):
        assert read_out(viewport, 1, image, 100, 75).intensity == "…"


def test_outside_the_volume_there_is_a_position_but_no_voxel() -> None:
    plane = Plane.across(0, SHAPE, SPACING_UM, 2)
    viewport = Viewport.fitted(plane, Area(0, 0, 200, 150))

    readout = read_out(viewport, 1, None, 1, 1)

    assert readout.index_voxel is None
    assert readout.text.startswith("outside · 0.020, ")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.uint8(7), "7"),
        (np.uint64(2**63), str(2**63)),
        (np.float32(0.25), "0.25"),
        (np.float64(1234567.8), "1.23457e+06"),
        (np.float32(np.nan), "nan"),
    ],
)
def test_intensities_are_written_as_the_file_has_them(value: np.generic, text: str) -> None:
    assert intensity_text(value) == text
