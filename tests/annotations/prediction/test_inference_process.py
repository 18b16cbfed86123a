"""A network in a process of its own: what it says, and what becomes of a process that dies."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from annotations.errors import Cancelled, UserError
from annotations.geometry.tool_library import find_tool
from annotations.prediction import inference_child
from annotations.prediction.checkpoint import CheckpointError, load_checkpoint
from annotations.prediction.heatmaps import decode
from annotations.prediction.inference_process import InferenceCrashed, InferenceProcess
from annotations.prediction.prediction_file import load_prediction
from annotations.prediction.predictor import Predictor
from annotations.prediction.runtime import Runtime
from annotations.prediction.shipped import shipped_checkpoint
from annotations.prediction.volume_prediction import predict_volume
from annotations.synthesis import REALTIME_SHAPE, write_study
from annotations.volumes import DatasetChoiceNeeded, SpacingUm, VolumeError, open_volume
from tests.annotations.prediction.tiny_networks import SAMPLING, save_tiny, weights

SPACING_UM: SpacingUm = (600.0, 100.0, 50.0)
PATIENCE_S = 30.0
PARENT = """
import os, signal, sys
from pathlib import Path
from annotations.prediction.inference_process import InferenceProcess
process = InferenceProcess(Path(sys.argv[1]), threads=1)
process.start(lambda: False)
print(process._child._process.pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def never() -> bool:
    return False


@pytest.fixture
def checkpoint_path(tmp_path: Path) -> Path:
    return save_tiny(tmp_path / "tiny.onnx").path


@pytest.fixture
def volume_path(tmp_path: Path) -> Path:
    path = tmp_path / "volume.npy"
    np.save(path, np.random.default_rng(3).integers(0, 255, (6, 20, 16), dtype=np.uint8))
    return path


@pytest.fixture
def process(checkpoint_path: Path) -> Iterator[InferenceProcess]:
    made = InferenceProcess(checkpoint_path, threads=1)
    yield made
    made.close()


@pytest.fixture(scope="module")
def lasting(tmp_path_factory: pytest.TempPathFactory) -> Iterator[InferenceProcess]:
    """One for all tests that do no harm to it: to start takes a second."""
    made = InferenceProcess(save_tiny(tmp_path_factory.mktemp("lasting") / "tiny.onnx").path, threads=1)
    yield made
    made.close()


def predicted(process: InferenceProcess, volume_path: Path, **changes: object) -> object:
    asked = {
        "dataset": None,
        "spacing_um": SPACING_UM,
        "prediction_path": volume_path.with_suffix(".json"),
        "cancelled": never,
    }
    return process.predict(volume_path, **(asked | changes))  # type: ignore[arg-type]


def pid_of(process: InferenceProcess) -> int:
    assert process._child is not None
    return process._child._process.pid


def replace_worker(monkeypatch: pytest.MonkeyPatch, lines: str, *, serves: bool = True) -> None:
    """Let a worker begin with some lines, in which ``w`` is its module."""
    script = f"import os, sys, time\nimport annotations.prediction.inference_worker as w\n{lines}\n"
    end = "w.main()" if serves else ""
    monkeypatch.setattr(inference_child, "_COMMAND", (sys.executable, "-c", script + end))


def test_it_says_what_the_network_says_in_this_process(
    process: InferenceProcess, checkpoint_path: Path, volume_path: Path
) -> None:
    checkpoint = load_checkpoint(checkpoint_path)
    predictor = Predictor(checkpoint, Runtime(checkpoint, threads=1))
    path = volume_path.with_suffix(".json")
    with open_volume(volume_path) as volume:
        expected = predict_volume(predictor, volume, SPACING_UM, path)

    found = predicted(process, volume_path)

    moment = {"created": expected.created}
    assert found.model_copy(update=moment) == expected  # type: ignore[attr-defined]
    assert not path.exists()


def test_heatmaps_lie_in_the_frame_of_the_volume_and_sum_to_the_presence(
    lasting: InferenceProcess, checkpoint_path: Path, volume_path: Path
) -> None:
    checkpoint = load_checkpoint(checkpoint_path)
    found = lasting.heatmaps(volume_path, dataset=None, spacing_um=SPACING_UM, cancelled=never)

    with open_volume(volume_path) as volume:
        predictor = Predictor(checkpoint, Runtime(checkpoint, threads=1))
        keypoints = predictor.predict(volume, SPACING_UM)
    sums = found.probability.sum(axis=(1, 2, 3))
    np.testing.assert_allclose(sums, keypoints.presence, rtol=1e-4)
    grid_um = [
        found.origin_um[axis] + np.arange(found.probability.shape[axis + 1]) * found.spacing_um[axis]
        for axis in range(3)
    ]
    for place, name in enumerate(found.names):
        if name in keypoints.by_name:
            share = found.probability[place] / sums[place]
            mean_um = [
                float(
                    (
                        share.sum(axis=tuple(other for other in range(3) if other != axis)) * grid_um[axis]
                    ).sum()
                )
                for axis in range(3)
            ]
            np.testing.assert_allclose(mean_um, keypoints.by_name[name], rtol=1e-3, atol=0.5)


def test_a_look_gives_the_brightest_samples_along_each_axis(
    lasting: InferenceProcess, volume_path: Path
) -> None:
    frame = lasting.look(volume_path, dataset=None, spacing_um=SPACING_UM, depth_axis=2, cancelled=never)

    assert [picture.shape for picture in frame.projections] == [(10, 8), (6, 8), (6, 10)]
    whole = np.load(volume_path)[:, ::2]
    # Pairs along the depth are averaged.
    means = whole.reshape(6, 10, 8, 2).mean(axis=3)
    for axis, picture in enumerate(frame.projections):
        np.testing.assert_allclose(picture, means.max(axis=axis), atol=1)
    assert frame.spacing_um == SAMPLING.spacing_um
    np.testing.assert_allclose(frame.origin_um, (0, 0, 25))


def test_what_was_looked_at_is_kept_where_others_look_for_it(
    process: InferenceProcess, volume_path: Path, tmp_path: Path
) -> None:
    with pytest.raises(UserError, match="nothing to keep"):
        process.keep(tmp_path, never)
    process.look(volume_path, dataset=None, spacing_um=SPACING_UM, depth_axis=2, cancelled=never)

    path = process.keep(tmp_path, never)

    assert path == tmp_path / "predictions" / "Tiny" / "volume.json"
    assert load_prediction(path).volume.path == "../../volume.npy"


def test_errors_come_in_the_same_kind_and_words(lasting: InferenceProcess, tmp_path: Path) -> None:
    absent, cut, several = tmp_path / "absent.npy", tmp_path / "cut.npy", tmp_path / "several.npz"
    whole = np.zeros((6, 20, 16), dtype=np.uint8)
    np.save(cut, whole)
    cut.write_bytes(cut.read_bytes()[:-100])
    np.savez(several, first=whole, second=whole)
    for path in (absent, cut, several):
        with pytest.raises(VolumeError) as expected:
            open_volume(path)
        with pytest.raises(VolumeError) as found:
            predicted(lasting, path)
        assert (type(found.value), str(found.value)) == (type(expected.value), str(expected.value))
        assert found.value.where == path
    assert isinstance(found.value, DatasetChoiceNeeded)
    assert [choice.name for choice in found.value.choices] == ["first", "second"]
    # None of them was its end.
    np.save(absent, whole)
    assert predicted(lasting, absent) is not None


def test_an_unknown_spacing_is_refused_over_there_as_here(
    lasting: InferenceProcess, volume_path: Path
) -> None:
    with pytest.raises(VolumeError, match="how far apart its voxels are"):
        predicted(lasting, volume_path, spacing_um=None)


@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
def test_a_killed_process_is_told_of_and_replaced(process: InferenceProcess, volume_path: Path) -> None:
    before = predicted(process, volume_path)
    first = pid_of(process)
    stopped = threading.Event()
    # Stopped first, so that it dies within the call.
    os.kill(first, signal.SIGSTOP)

    def kill() -> None:
        stopped.wait(PATIENCE_S)
        os.kill(first, signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()

    def then_kill() -> bool:
        stopped.set()
        return False

    with pytest.raises(InferenceCrashed, match=r"killed.*memory is full, or by somebody") as caught:
        predicted(process, volume_path, cancelled=then_kill)
    killer.join()
    assert "started anew" in caught.value.remedy

    after = predicted(process, volume_path)

    assert after.keypoints == before.keypoints  # type: ignore[attr-defined]
    assert pid_of(process) != first


def test_one_that_ran_out_of_memory_says_so(
    process: InferenceProcess, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_worker(
        monkeypatch,
        "def fail(*given, **named): raise MemoryError\nw.predict_volume = fail",
    )

    with pytest.raises(InferenceCrashed, match="could not get enough memory"):
        predicted(process, volume_path)


def test_an_error_that_nobody_foresaw_is_told_with_its_words(
    process: InferenceProcess, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_worker(
        monkeypatch,
        "def fail(*given, **named): raise ZeroDivisionError('by nothing')\nw.predict_volume = fail",
    )

    with pytest.raises(InferenceCrashed, match="ZeroDivisionError: by nothing"):
        predicted(process, volume_path)


def test_one_that_cannot_even_start_says_its_last_words(
    process: InferenceProcess, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_worker(monkeypatch, "sys.exit('no such thing')", serves=False)

    with pytest.raises(InferenceCrashed, match="code 1: no such thing"):
        predicted(process, volume_path)


def test_garbage_in_place_of_an_answer_is_no_answer(
    process: InferenceProcess, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        replace_worker(patched, "os.write(1, b'Hello, world! ' * 20); time.sleep(60)", serves=False)
        with pytest.raises(InferenceCrashed, match="makes no sense"):
            predicted(process, volume_path)

    assert predicted(process, volume_path) is not None


def test_what_libraries_print_disturbs_no_answer(
    process: InferenceProcess, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_worker(
        monkeypatch,
        "real = w.predict_volume\n"
        "def loud(*given):\n"
        "    print('noise', flush=True); os.write(1, b'more noise')\n"
        "    return real(*given)\n"
        "w.predict_volume = loud",
    )

    assert predicted(process, volume_path) is not None


def test_a_wish_to_stop_ends_the_process(
    process: InferenceProcess, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_worker(monkeypatch, "w.predict_volume = lambda *given: time.sleep(600)")
    process.start(never)
    child = process._child
    assert child is not None

    with pytest.raises(Cancelled):
        predicted(process, volume_path, cancelled=lambda: True)

    assert child._process.returncode is not None


def test_closing_cancels_the_call_that_waits(
    process: InferenceProcess, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_worker(monkeypatch, "w.predict_volume = lambda *given: time.sleep(600)")
    process.start(never)
    threading.Timer(0.2, process.close).start()

    with pytest.raises(Cancelled):
        predicted(process, volume_path)


def test_a_second_caller_waits_for_its_turn_and_may_give_up(
    process: InferenceProcess, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_worker(monkeypatch, "w.predict_volume = lambda *given: time.sleep(600)")
    process.start(never)
    ends = threading.Event()

    def call() -> None:
        with pytest.raises(Cancelled):
            predicted(process, volume_path, cancelled=ends.is_set)

    first = threading.Thread(target=call)
    first.start()
    while not process._turn.locked():
        time.sleep(0.01)
    with pytest.raises(Cancelled):
        predicted(process, volume_path, cancelled=lambda: True)
    assert first.is_alive()

    ends.set()
    first.join(PATIENCE_S)
    assert not first.is_alive()


def test_a_checkpoint_that_is_replaced_meanwhile_is_not_taken_for_the_first(
    process: InferenceProcess, checkpoint_path: Path, volume_path: Path
) -> None:
    before = predicted(process, volume_path)
    content = checkpoint_path.read_bytes()
    checkpoint_path.write_bytes(content.replace(weights().tobytes(), weights(seed=1).tobytes()))
    assert checkpoint_path.read_bytes() != content
    # The one that runs has it in memory.
    assert predicted(process, volume_path).keypoints == before.keypoints  # type: ignore[attr-defined]
    process.close()

    with pytest.raises(CheckpointError, match="another checkpoint has taken its place"):
        predicted(process, volume_path)

    checkpoint_path.unlink()
    with pytest.raises(CheckpointError, match="could not be read"):
        predicted(process, volume_path)
    checkpoint_path.write_bytes(content)
    assert predicted(process, volume_path).keypoints == before.keypoints  # type: ignore[attr-defined]


@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
def test_it_ends_with_the_program_that_started_it_however_that_ends(checkpoint_path: Path) -> None:
    parent = subprocess.run(
        [sys.executable, "-c", PARENT, str(checkpoint_path)], capture_output=True, text=True, check=False
    )
    assert parent.returncode == -signal.SIGKILL
    child, until_s = int(parent.stdout), time.monotonic() + PATIENCE_S

    while _is_running(child) and time.monotonic() < until_s:
        time.sleep(0.02)

    assert not _is_running(child)


def test_the_shipped_checkpoint_finds_the_tool_in_a_live_volume(tmp_path: Path) -> None:
    shipped = shipped_checkpoint("magnetic-forceps")
    if shipped is None:
        pytest.skip("no checkpoint ships with these sources")
    tool = find_tool("magnetic-forceps")
    study = write_study(tmp_path / "study", tool, count=1, seed=4, shape=REALTIME_SHAPE)
    path = tmp_path / "study" / study.volumes[0].path
    with open_volume(path) as volume:
        spacing_um = volume.spacing_um
    assert spacing_um is not None
    process = InferenceProcess(shipped, threads=1)
    try:
        frame = process.look(path, dataset=None, spacing_um=spacing_um, depth_axis=2, cancelled=never)
        raw = process.heatmaps(path, dataset=None, spacing_um=spacing_um, cancelled=never)
    finally:
        process.close()

    assert [keypoint.name for keypoint in frame.keypoints] == list(tool.keypoint_names)
    assert frame.pose is not None
    assert frame.pose.rms_um < 500
    assert frame.projections[2].shape == (28, 139)
    assert raw.probability.shape[0] == len(tool.keypoint_names)


def test_probabilities_have_the_mean_that_is_decoded() -> None:
    from annotations.prediction.heatmaps import HeatmapConvention, probabilities

    values = np.random.default_rng(5).normal(size=(3, 4, 5, 6)).astype(np.float32)
    for target, decoding in (
        ("distribution", "integral"),
        ("gaussian", "argmax"),
        ("gaussian", "soft-argmax"),
    ):
        convention = HeatmapConvention(target=target, decoding=decoding, temperature=5.0)  # type: ignore[arg-type]
        given = probabilities(values, convention)
        decoded = decode(values, convention)
        np.testing.assert_allclose(given.sum(axis=(1, 2, 3)), decoded.presence, rtol=1e-4)
        assert (given >= 0).all()


def _is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    # A zombie runs no more; whoever adopted it may be slow to ask.
    status = Path(f"/proc/{pid}/stat")
    return not (status.exists() and status.read_text().rpartition(")")[2].split()[0] == "Z")


def test_the_depth_axis_that_somebody_has_said_counts_rather_than_the_files(
    lasting: InferenceProcess, volume_path: Path
) -> None:
    assert predicted(lasting, volume_path, depth_axis=2)

    with pytest.raises(VolumeError, match="depth"):
        predicted(lasting, volume_path, depth_axis=0)
    with pytest.raises(VolumeError, match="depth"):
        lasting.heatmaps(volume_path, dataset=None, spacing_um=SPACING_UM, depth_axis=0, cancelled=never)
