"""Running a checkpoint's network."""

import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from onnx import helper, numpy_helper

from annotations.errors import UserError
from annotations.prediction import runtime
from annotations.prediction.checkpoint import CheckpointError, load_checkpoint
from annotations.prediction.runtime import Runtime
from tests.annotations.prediction.tiny_networks import DESCRIPTION, INPUT, network, save_tiny

IMPORTS_AND_RUNS = """
import sys
from pathlib import Path

import numpy as np

from annotations.prediction.checkpoint import load_checkpoint
from annotations.prediction.runtime import Runtime

assert "openvino" not in sys.modules
checkpoint = load_checkpoint(Path(sys.argv[1]))
Runtime(checkpoint, threads=1).heatmaps(np.zeros(checkpoint.description.sampling.padded_shape, np.float32))
assert "openvino" in sys.modules
print(*(name for name in sys.modules if "telemetry" in name or name.startswith("openvino.tools.ovc")))
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return save_tiny(tmp_path / "tiny.onnx").path


def padded_input(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random(INPUT[2:], dtype=np.float32)


def test_it_gives_what_another_runtime_gives(path: Path) -> None:
    values = padded_input()

    heatmaps = Runtime(load_checkpoint(path)).heatmaps(values)

    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    [expected] = session.run(None, {"volume": values[None, None]})
    assert heatmaps.dtype == np.float32
    assert heatmaps.shape == DESCRIPTION.output_shape[1:]
    np.testing.assert_allclose(heatmaps, expected[0], atol=1e-5)


def test_the_same_input_gives_the_same_heatmaps(path: Path) -> None:
    values = padded_input()
    first, second = Runtime(load_checkpoint(path)), Runtime(load_checkpoint(path), threads=1)

    np.testing.assert_array_equal(first.heatmaps(values), first.heatmaps(values))
    np.testing.assert_allclose(first.heatmaps(values), second.heatmaps(values), atol=1e-6)


def test_heatmaps_stay_what_they_are_when_the_next_volume_comes(path: Path) -> None:
    runtime = Runtime(load_checkpoint(path))
    first = runtime.heatmaps(padded_input(1))
    before = first.copy()

    second = runtime.heatmaps(padded_input(2))

    np.testing.assert_array_equal(first, before)
    assert not np.array_equal(first, second)


def test_an_input_in_another_order_in_memory_is_understood(path: Path) -> None:
    runtime = Runtime(load_checkpoint(path))
    values = padded_input()

    np.testing.assert_array_equal(runtime.heatmaps(np.asfortranarray(values)), runtime.heatmaps(values))


def test_it_works_in_another_thread_than_it_was_made_in(path: Path) -> None:
    runtime = Runtime(load_checkpoint(path))
    given: list[np.ndarray] = []
    worker = threading.Thread(target=lambda: given.append(runtime.heatmaps(padded_input())))
    worker.start()
    worker.join()

    np.testing.assert_array_equal(given[0], runtime.heatmaps(padded_input()))


def test_an_input_of_another_shape_is_refused(path: Path) -> None:
    with pytest.raises(ValueError, match="voxels"):
        Runtime(load_checkpoint(path)).heatmaps(np.zeros((8, 12, 11), dtype=np.float32))


def test_numbers_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    zero = numpy_helper.from_array(np.zeros(1, dtype=np.float32), "zero")
    model = network(
        [
            helper.make_node(
                "Conv", ["volume", "weights"], ["halved"], kernel_shape=[2] * 3, strides=[2] * 3
            ),
            helper.make_node("Div", ["halved", "zero"], ["heatmaps"]),
        ],
        [zero],
    )
    checkpoint = save_tiny(tmp_path / "infinite.onnx", model)

    with pytest.raises(CheckpointError, match="not finite") as caught:
        Runtime(checkpoint).heatmaps(padded_input())
    assert str(checkpoint.path) in str(caught.value)


def test_what_openvino_cannot_compile_is_told(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Core:
        def read_model(self, _model: object) -> None:
            raise RuntimeError("Exception from src/somewhere.cpp:3:\nno such operator.\n\n")

    monkeypatch.setattr(runtime.import_openvino(), "Core", Core)

    with pytest.raises(CheckpointError, match=r"cannot compile its network \(no such operator\)") as caught:
        Runtime(load_checkpoint(path))
    assert str(path) in str(caught.value)
    assert caught.value.remedy


def test_a_machine_without_openvino_is_told_so(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openvino", None)

    with pytest.raises(UserError, match="cannot be loaded") as caught:
        Runtime(load_checkpoint(path))
    assert "pip install" in caught.value.remedy


def test_running_a_network_writes_and_sends_nothing(path: Path, user_home: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS_AND_RUNS, str(path)], capture_output=True, text=True, check=False
    )

    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""
    # OpenVINO's reports begin with an identifier of the user in the home folder.
    assert list(user_home.iterdir()) == []


def test_modules_are_unimportable_only_while_openvino_is_imported() -> None:
    runtime.import_openvino()

    assert "openvino_telemetry" not in sys.modules
    assert "openvino.tools.ovc" not in sys.modules
