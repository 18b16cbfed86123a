import numpy as np

from annotations.volumes import SliceImage
from annotator.slices.slice_cache import SliceCache


def slice_of(axis: int, index: int, size: int = 100) -> SliceImage:
    return SliceImage(np.zeros((size, 1), np.uint8), (1.0, 1.0), (0.0, 0.0), axis, index, every=(1, 1))


def bytes_held(cache: SliceCache) -> int:
    return sum(image.data.nbytes for image in cache._slices.values())


def test_the_slice_unused_for_longest_goes_first() -> None:
    cache = SliceCache(300)
    for index in range(3):
        cache.put(slice_of(0, index))
    cache.get(0, 0)

    cache.put(slice_of(1, 0))

    assert (0, 1) not in cache
    assert all(key in cache for key in [(0, 0), (0, 2), (1, 0)])


def test_the_bytes_stay_within_the_limit() -> None:
    cache = SliceCache(1000)
    for index in range(50):
        cache.put(slice_of(2, index, size=70 + index))
        assert bytes_held(cache) <= 1000


def test_a_slice_put_again_counts_once() -> None:
    cache = SliceCache(250)
    cache.put(slice_of(0, 0))
    newer = slice_of(0, 0)
    cache.put(newer)
    cache.put(slice_of(0, 1))

    assert bytes_held(cache) == 200
    assert cache.get(0, 0) is newer


def test_one_slice_is_kept_even_if_it_is_larger_than_the_limit() -> None:
    cache = SliceCache(10)
    cache.put(slice_of(0, 0))
    cache.put(slice_of(0, 1))

    assert (0, 1) in cache
    assert (0, 0) not in cache
