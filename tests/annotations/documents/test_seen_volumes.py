from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from annotations.documents.seen_volumes import FoundVolume, look_at_volumes
from annotations.errors import Cancelled

WriteVolume = Callable[..., Path]


def test_what_cannot_be_read_and_what_is_the_same_is_told(tmp_path: Path, write_volume: WriteVolume) -> None:
    first, other = write_volume(tmp_path / "a.npy", 1), write_volume(tmp_path / "b.npy", 2)
    twin, broken = tmp_path / "twin.npy", tmp_path / "broken.npy"
    twin.write_bytes(first.read_bytes())
    broken.write_bytes(bytes(range(100)))
    np.savez(tmp_path / "both.npz", x=np.zeros((2, 3, 4)), y=np.zeros((2, 3, 4)))
    found = look_at_volumes([first, other, twin, broken, tmp_path / "both.npz"])
    assert found == (
        FoundVolume(first),
        FoundVolume(other),
        FoundVolume(twin, same_as=first),
        FoundVolume(broken, problem="its content is of no format that can be opened"),
        FoundVolume(tmp_path / "both.npz"),
    )


def test_known_volumes_are_compared_with_and_not_told(tmp_path: Path, write_volume: WriteVolume) -> None:
    known, new = write_volume(tmp_path / "a.npy", 1), tmp_path / "new.npy"
    new.write_bytes(known.read_bytes())
    assert look_at_volumes([known, new], known=[known]) == (
        FoundVolume(known),
        FoundVolume(new, same_as=known),
    )


def test_looking_says_how_far_it_is_and_can_be_stopped(tmp_path: Path, write_volume: WriteVolume) -> None:
    paths = [write_volume(tmp_path / f"{number}.npy", number) for number in range(3)]
    shares: list[float] = []
    look_at_volumes(paths, progress=shares.append)
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    with pytest.raises(Cancelled):
        look_at_volumes(paths, cancelled=lambda: True)
