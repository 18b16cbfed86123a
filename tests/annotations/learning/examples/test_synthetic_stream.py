"""Synthetic examples from several processes."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest

from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.learning.examples.synthetic_stream import SyntheticSeries, SyntheticStream, worker_count
from annotations.synthesis.conditions import PLAIN_CONDITIONS, TRAINING_CONDITIONS
from tests.annotations.learning.tiny_training import TOOL, tiny_settings

SERIES = SyntheticSeries(TOOL, tiny_settings().sampling, 5, TRAINING_CONDITIONS)

PARENT = """
import time
from tests.annotations.learning.examples.test_synthetic_stream import SERIES
from annotations.learning.examples.synthetic_stream import SyntheticStream
if __name__ == "__main__":
    stream = SyntheticStream(SERIES, 0, 2)
    stream.take()
    print(*[process.pid for process in stream._processes], flush=True)
    time.sleep(60)
"""


def taken(workers: int, first: int, count: int) -> list[tuple[bytes, bytes]]:
    with SyntheticStream(SERIES, first, workers) as stream:
        found = [stream.take() for _ in range(count)]
    return [(one.samples.tobytes(), one.keypoints_um.tobytes()) for one in found]


def test_the_examples_and_their_order_do_not_depend_on_the_number_of_processes() -> None:
    alone = taken(0, 0, 7)
    assert len(set(alone)) == 7
    assert taken(1, 0, 7) == alone
    assert taken(2, 0, 7) == alone


def test_it_begins_at_any_number() -> None:
    assert taken(2, 4, 2) == taken(0, 0, 6)[4:]


def test_another_seed_gives_other_examples() -> None:
    other = SyntheticSeries(TOOL, tiny_settings().sampling, 6, TRAINING_CONDITIONS)
    assert (other.example(0).keypoints_um != SERIES.example(0).keypoints_um).all()


def test_an_example_has_the_samplings_shape_and_grey_values() -> None:
    example = SERIES.example(0)
    assert example.samples.shape == SERIES.sampling.shape
    assert example.samples.dtype == np.float16
    assert 0 <= example.samples.min() < example.samples.max() <= 255
    assert np.isfinite(example.keypoints_um).all()


def test_no_process_is_left() -> None:
    with SyntheticStream(SERIES, 0, 2) as stream:
        stream.take()
        assert len(multiprocessing.active_children()) == 2
    assert not multiprocessing.active_children()
    stream.close()


def test_a_tool_without_links_cannot_be_made() -> None:
    fields = TOOL.model_dump(mode="json", by_alias=True)
    needle = ToolSpecification.model_validate(
        {"schema": fields["schema"], "name": "points", "keypoints": fields["keypoints"], "targets": {}}
    )
    series = SyntheticSeries(needle, SERIES.sampling, 5, PLAIN_CONDITIONS)
    with SyntheticStream(series, 0, 2) as stream:
        for _ in range(2):
            with pytest.raises(UserError, match="has no links"):
                stream.take()


def test_a_process_that_was_killed_is_told() -> None:
    with SyntheticStream(SERIES, 0, 1) as stream:
        stream.take()
        for process in stream._processes:
            process.kill()
        with pytest.raises(UserError, match="has ended"):
            take_many(stream, 1000)


def take_many(stream: SyntheticStream, count: int) -> None:
    for _ in range(count):
        stream.take()


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_processes_end_when_the_training_is_killed() -> None:
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        workers = [int(text) for text in parent.stdout.readline().split()]
        assert len(workers) == 2
        os.kill(parent.pid, signal.SIGKILL)
    deadline = time.monotonic() + 60
    while any(is_running(pid) for pid in workers):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def is_running(pid: int) -> bool:
    try:
        return bool(psutil.Process(pid).status() != psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return False


def test_how_many_processes_there_are() -> None:
    assert worker_count(0) == 0
    assert worker_count(3) == 3
    assert worker_count(-1) == max(1, (os.cpu_count() or 1) - 1)
