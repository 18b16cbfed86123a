import logging
from typing import Any

import numpy as np
import pytest

from annotations.volumes.file_metadata import (
    depth_axis_from_attributes,
    spacing_from_attributes,
    um_per_unit,
)


@pytest.mark.parametrize(
    ("unit", "um"),
    [
        ("um", 1),
        ("µm", 1),
        ("μm", 1),
        ("\\u00B5m", 1),
        ("Micron", 1),
        (b"micrometer", 1),
        ("micrometre", 1),
        ("nm", 1e-3),
        ("mm", 1e3),
        (" millimeter ", 1e3),
        ("cm", 1e4),
        ("m", 1e6),
        ("inch", 25_400),
        ("pixel", None),
        ("", None),
    ],
)
def test_units_of_length(unit: object, um: float | None) -> None:
    assert um_per_unit(unit) == um


@pytest.mark.parametrize(
    ("attributes", "spacing_um"),
    [
        ({"spacing_um": [1, 2, 3]}, (1, 2, 3)),
        ({"element_size_um": np.array([1.5, 2, 3])}, (1.5, 2, 3)),
        ({"voxel_size_mm": [0.5, 2, 3]}, (500, 2000, 3000)),
        ({"pixel_size_nm": [500, 2000, 3000]}, (0.5, 2, 3)),
        ({"resolution": [1, 2, 3], "units": "mm"}, (1000, 2000, 3000)),
        ({"resolution": [1, 2, 3], "unit": b"um"}, (1, 2, 3)),
        ({"spacing": [1, 2, 3], "spacing_unit": ["um", "mm", "um"]}, (1, 2000, 3)),
        ({"spacing": [1, 2, 3]}, None),
        ({"resolution": [1, 2, 3], "unit": "pixel"}, None),
        ({"spacing": [1, 2, 3], "spacing_unit": ["um", "um"]}, None),
        ({}, None),
    ],
)
def test_only_lengths_with_a_unit_count(
    attributes: dict[str, Any], spacing_um: tuple[float, ...] | None
) -> None:
    found = spacing_from_attributes(attributes, "v.h5")
    assert found == (None if spacing_um is None else pytest.approx(spacing_um))


@pytest.mark.parametrize("values", [[0, 1, 1], [1, -1, 1], [1, 1, np.nan], [1, 1, np.inf], ["a", "b", "c"]])
def test_an_impossible_spacing_counts_as_none_and_is_logged(
    values: list[Any], caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        assert spacing_from_attributes({"spacing_um": values}, "v.h5") is None
    assert "v.h5" in caplog.text


@pytest.mark.parametrize(
    ("attributes", "axis"),
    [
        ({"depth_axis": 0}, 0),
        ({"depth_axis": np.array(1)}, 1),
        ({"depth_axis": np.array([2])}, 2),
        ({"depth_axis": 3}, None),
        ({"depth_axis": "z"}, None),
        ({"depth_axis": [0, 1]}, None),
        ({}, None),
    ],
)
def test_the_depth_axis_is_one_of_three(attributes: dict[str, Any], axis: int | None) -> None:
    assert depth_axis_from_attributes(attributes) == axis
