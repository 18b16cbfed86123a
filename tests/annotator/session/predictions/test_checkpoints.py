"""Checkpoints and weights that are opened in the application."""

import importlib.util
import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from annotations.errors import UserError
from tests.annotations.prediction.tiny_networks import save_tiny
from tests.annotator.stub_converter import stub_converter
from tests.needs_torch import needs_torch

ROOT = Path(__file__).parents[3]
# In a process of its own, so that this one stays without torch.
WRITE_WEIGHTS = """
import sys
from pathlib import Path
from annotations.documents.record import changed
from annotations.learning.settings.network_settings import NetworkSettings
from annotations.learning.architectures.networks import build_network
from annotations.learning.training.state_file import write_state
from annotations.volumes.sampling import Sampling
from tests.annotations.prediction.tiny_networks import DESCRIPTION

sampling = Sampling(shape=(16, 32, 32), spacing_um=(600.0, 200.0, 100.0))
settings = NetworkSettings(keypoints=2, input_shape=(16, 32, 32), width=0.1)
weights = build_network(settings).state_dict()
write_state(Path(sys.argv[1]), changed(DESCRIPTION, sampling=sampling), settings, weights)
"""
CANCELLED = "Cancelled: nothing was written"


@pytest.fixture
def stub(tmp_path, monkeypatch):
    return stub_converter(tmp_path, monkeypatch)


@pytest.fixture
def weights(tmp_path):
    path = tmp_path / "training" / "best.pt"
    path.parent.mkdir()
    path.write_bytes(b"weights")
    return path


@pytest.fixture
def made(tmp_path):
    """What a converter makes."""
    return save_tiny(tmp_path / "made.onnx").path


@pytest.fixture
def output(weights):
    return weights.with_suffix(".onnx")


def failure(qtbot, session, weights, output) -> UserError:
    """Convert, and return why that failed."""
    with qtbot.waitSignal(session.error_raised, timeout=60_000) as raised:
        session.checkpoints.convert(weights, output)
    (error,) = raised.args
    return error


def test_a_checkpoint_is_read_and_what_is_open_stays(qtbot, session, made):
    document = session.document
    with qtbot.waitSignal(session.checkpoints.opened) as opened:
        session.open_path(made)
    assert opened.args[0].description.name == "Tiny"
    assert session.document is document


def test_a_checkpoint_that_is_none_is_an_error(qtbot, session, tmp_path):
    path = tmp_path / "wrong.onnx"
    path.write_bytes(b"PK\x03\x04")
    with qtbot.waitSignal(session.error_raised) as raised:
        session.open_path(path)
    assert raised.args[0].where == path
    assert "PyTorch" in str(raised.args[0])


@pytest.mark.parametrize("name", ["best.pt", "BEST.PT"])
def test_weights_are_offered_to_become_a_checkpoint(qtbot, session, tmp_path, name):
    path = tmp_path / name
    path.touch()
    document = session.document
    with qtbot.waitSignal(session.checkpoints.conversion_requested) as requested:
        session.open_path(path)
    assert requested.args == [path]
    assert session.document is document


def test_weights_that_are_not_there_are_an_error(qtbot, empty_session, tmp_path):
    with qtbot.waitSignal(empty_session.error_raised) as raised:
        empty_session.open_path(tmp_path / "nowhere.pt")
    assert "no such file" in raised.args[0].problem


def test_weights_become_a_checkpoint(qtbot, session, stub, weights, output, made):
    stub(f"shutil.copy({str(made)!r}, output)")
    messages = []
    session.message_posted.connect(messages.append)
    with qtbot.waitSignal(session.checkpoints.converted, timeout=30_000) as converted:
        session.checkpoints.convert(weights, output)
        (job,) = session.jobs.shown
        assert job.shown
        assert job.title == "Making best.onnx"
    assert converted.args[0].path == output
    assert output.read_bytes() == made.read_bytes()
    assert messages == [f"The checkpoint is in {output}"]
    assert sorted(path.name for path in weights.parent.iterdir()) == ["best.onnx", "best.pt"]


def test_a_checkpoint_is_replaced_only_by_a_whole_one(qtbot, session, stub, weights, output, made):
    output.write_bytes(b"the one before")
    stub("sys.exit(1)")
    failure(qtbot, session, weights, output)
    assert output.read_bytes() == b"the one before"
    stub('open(output, "w").write("half a network")')
    error = failure(qtbot, session, weights, output)
    assert error.where == weights
    assert "cannot be used" in str(error)
    assert output.read_bytes() == b"the one before"
    stub(f"shutil.copy({str(made)!r}, output)")
    with qtbot.waitSignal(session.checkpoints.converted, timeout=30_000):
        session.checkpoints.convert(weights, output)
    assert output.read_bytes() == made.read_bytes()


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (
            'sys.exit(print(json.dumps({"error": f"{weights}: it holds code. Choose another."})) or 1)',
            "it holds code. Choose another",
        ),
        ('raise ImportError("no such library")', "ImportError: no such library"),
        ("sys.exit(3)", "The conversion ended with code 3"),
        ("pass", "The conversion ended with code 0"),
    ],
    ids=["it says why", "it crashes", "it says nothing", "it makes nothing"],
)
def test_a_conversion_that_fails_says_why(qtbot, session, stub, weights, output, lines, reason):
    stub(lines)
    error = failure(qtbot, session, weights, output)
    assert error.problem == "no checkpoint was made of these weights"
    assert error.where == weights
    assert error.remedy == reason
    assert not output.exists()


def test_a_conversion_can_be_cancelled(qtbot, session, stub, weights, output):
    stub('open(weights + ".begun", "w").close(); time.sleep(600)')
    begun = weights.with_name("best.pt.begun")
    session.checkpoints.convert(weights, output)
    qtbot.waitUntil(begun.exists, timeout=30_000)
    (job,) = session.jobs.shown
    with qtbot.waitSignal(session.message_posted, timeout=30_000) as posted:
        session.jobs.cancel(job)
    assert posted.args == [CANCELLED]
    assert not output.exists()
    # And another one can begin.
    stub("sys.exit(3)")
    assert "code 3" in failure(qtbot, session, weights, output).remedy


def test_a_checkpoint_whose_making_is_cancelled_when_it_is_written_is_there(
    qtbot, session, stub, weights, output, made, cancelled_too_late
):
    stub(f"shutil.copy({str(made)!r}, output)")
    cancelled_too_late.add("Making best.onnx")
    with qtbot.waitSignal(session.checkpoints.converted, timeout=30_000):
        session.checkpoints.convert(weights, output)
    assert output.read_bytes() == made.read_bytes()


def test_one_conversion_at_a_time(qtbot, session, stub, weights, output):
    stub("time.sleep(600)")
    session.checkpoints.convert(weights, output)
    with qtbot.waitSignal(session.message_posted) as posted:
        session.checkpoints.convert(weights, output)
    assert posted.args == ["A checkpoint is being made already"]
    (job,) = session.jobs.shown
    session.jobs.cancel(job)
    qtbot.waitUntil(lambda: not session.jobs.running, timeout=30_000)


def test_a_checkpoint_does_not_take_the_place_of_its_weights(qtbot, session, weights):
    assert "the place of the weights" in failure(qtbot, session, weights, weights).problem
    assert weights.read_bytes() == b"weights"


@pytest.mark.skipif(importlib.util.find_spec("torch") is not None, reason="it is installed")
def test_without_torch_the_real_converter_names_the_extra(qtbot, session, weights, output):
    assert "oct-annotator[train]" in failure(qtbot, session, weights, output).remedy


@needs_torch
class TestWithTorch:
    """Weights of a network, and the real converter."""

    def test_weights_become_a_checkpoint_and_this_process_stays_without_torch(
        self, qtbot, session, tmp_path, weights, output
    ):
        subprocess.run([sys.executable, "-c", WRITE_WEIGHTS, str(weights)], cwd=ROOT, check=True)
        had_torch = "torch" in sys.modules
        with qtbot.waitSignal(session.checkpoints.converted, timeout=100_000) as converted:
            session.checkpoints.convert(weights, output)
        assert converted.args[0].description.name == "Tiny"
        assert ("torch" in sys.modules) == had_torch

    def test_a_pickle_with_code_in_it_is_refused_and_does_nothing(
        self, qtbot, session, tmp_path, weights, output
    ):
        weights.write_bytes(pickle.dumps(Hostile(tmp_path / "trace")))
        error = failure(qtbot, session, weights, output)
        assert "more than tensors and plain values" in error.remedy
        assert not (tmp_path / "trace").exists()
        assert not output.exists()


class Hostile:
    """Makes a folder when it is unpickled."""

    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return os.mkdir, (str(self.folder),)
