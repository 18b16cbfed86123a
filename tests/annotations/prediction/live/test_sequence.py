"""Recorded sequences, played."""

from pathlib import Path

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from annotations.prediction.live.sequence import RecordedSequence
from annotations.volumes import VolumeError

NAMES = ("v1.npy", "v2.npy", "v10.npy")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sequence")
    for name in NAMES:
        np.save(path / name, np.zeros((2, 3, 4), dtype=np.uint8))
    return path


class Clock:
    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


def test_volumes_come_at_their_rate_in_the_order_of_their_names(folder: Path) -> None:
    clock = Clock()
    sequence = RecordedSequence(folder, 10.0, loops=False, clock=clock)
    shown = []
    for _ in range(40):
        news = sequence.look()
        shown += [
            (arrival.volume_path.name, round(arrival.appeared_s - 1000, 6)) for arrival in news.arrivals
        ]
        clock.now_s += 0.01

    assert shown == [("v1.npy", 0.0), ("v2.npy", 0.1), ("v10.npy", 0.2)]
    assert sequence.look().is_over


@given(st.lists(st.floats(0.001, 1.0), min_size=1, max_size=30), st.booleans())
def test_every_volume_that_was_due_is_shown_or_counted(
    folder: Path, pauses_s: list[float], loops: bool
) -> None:
    clock = Clock()
    sequence = RecordedSequence(folder, 20.0, loops=loops, clock=clock)
    shown = passed = 0
    for pause_s in pauses_s:
        news = sequence.look()
        shown, passed = shown + len(news.arrivals), passed + news.passed
        assert len(news.arrivals) <= 1
        due = int((clock.now_s - 1000.0) * 20.0) + 1
        assert shown + passed == (due if loops else min(due, len(NAMES)))
        for arrival in news.arrivals:
            # The newest one: never late by a whole volume.
            assert 0 <= clock.now_s - arrival.appeared_s < 1 / 20 + 1e-6 or not loops
        clock.now_s += pause_s


def test_after_the_last_comes_the_first_again(folder: Path) -> None:
    clock = Clock()
    sequence = RecordedSequence(folder, 1.0, loops=True, clock=clock)
    shown = []
    for _ in range(7):
        shown += [arrival.volume_path.name for arrival in sequence.look().arrivals]
        clock.now_s += 1.0

    assert shown == [*NAMES, *NAMES, NAMES[0]]


def test_a_file_that_is_no_volume_is_told_once_and_passed(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "a.npy").write_bytes(b"none")
    np.save(tmp_path / "b.npy", np.zeros((2, 3, 4), dtype=np.uint8))
    clock = Clock()
    sequence = RecordedSequence(tmp_path, 1.0, loops=True, clock=clock)
    errors, shown = 0, 0
    for _ in range(6):
        news = sequence.look()
        errors, shown = errors + len(news.errors), shown + len(news.arrivals)
        clock.now_s += 1.0

    assert (errors, shown) == (1, 3)


def test_a_folder_without_volumes_is_no_sequence(tmp_path: Path) -> None:
    with pytest.raises(VolumeError, match="no volume in this folder"):
        RecordedSequence(tmp_path, 20.0, loops=True)
