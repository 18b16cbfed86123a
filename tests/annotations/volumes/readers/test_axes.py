import pytest

from annotations.volumes.readers.axes import kept_axes


@pytest.mark.parametrize(
    ("lengths", "spatial", "kept"),
    [
        ((5, 6, 7), (True, True, True), (0, 1, 2)),
        ((1, 6, 7), (True, True, True), (0, 1, 2)),
        ((1, 1, 5, 6, 7), (False, False, True, True, True), (2, 3, 4)),
        ((1, 5, 1, 6, 7, 1), (False, True, False, True, True, False), (1, 3, 4)),
        ((1, 1, 5, 6, 7), (True,) * 5, (2, 3, 4)),
        ((1, 1, 1, 6, 7), (True,) * 5, (2, 3, 4)),
        ((4, 1, 6, 7), (True,) * 4, (0, 2, 3)),
        ((1, 1, 6, 7), (False, True, True, True), (1, 2, 3)),
        ((2, 3, 4, 5), (True,) * 4, (0, 1, 2, 3)),
        ((2, 1, 3, 4, 5), (False, False, True, True, True), (0, 2, 3, 4)),
        ((1, 6, 7), (False, True, True), (1, 2)),
        ((), (), ()),
    ],
)
def test_axes_that_make_a_volume(
    lengths: tuple[int, ...], spatial: tuple[bool, ...], kept: tuple[int, ...]
) -> None:
    assert kept_axes(lengths, spatial) == kept
