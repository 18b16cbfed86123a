"""A real session on a small volume, with a bright slab whose surfaces are known."""

import gc
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.volumes import write_sidecar
from annotator.session import Session
from annotator.session.jobs import Job, Jobs
from annotator.session.options import SessionOptions
from annotator.settings import Settings

# The modules below begin with this one.
if TYPE_CHECKING:
    from annotations.prediction.checkpoint import Checkpoint
    from tests.annotator.predicted_study import KnownNetwork

SHAPE = (40, 60, 50)
SPACING_UM = (15.9, 13.5, 9.4)


def write_volume(path: Path, seed: int = 0) -> Path:
    """Write a volume of noise (below 40) with a slab of 200 at x 10–29, y 15–44, z 20–34, and its spacing."""
    data = np.random.default_rng(seed).integers(0, 40, SHAPE).astype(np.uint8)
    data[10:30, 15:45, 20:35] = 200
    np.save(path, data)
    write_sidecar(path, SPACING_UM, 2)
    return path


@pytest.fixture(autouse=True)
def cycles_are_collected_only_here() -> Iterator[None]:
    """Collect reference cycles between the tests, in this thread: `annotator.startup.garbage` says why."""
    gc.disable()
    yield
    gc.collect()
    # What is alive now lives on: looking through all of it again after each test costs 0.3 s.
    gc.freeze()
    gc.enable()


@pytest.fixture
def volume_path(tmp_path: Path) -> Path:
    """A small volume on disk, alone in its folder, with a sidecar that states its spacing."""
    folder = tmp_path / "volumes"
    folder.mkdir()
    return write_volume(folder / "v001.npy")


@pytest.fixture
def options(tmp_path: Path) -> SessionOptions:
    """A session's options: the annotator anna, folders of the test's own, saving left to the test."""
    return SessionOptions(
        annotator_name="anna",
        autosave_s=0.0,
        recovery_folder=tmp_path / "recovery",
        level_cache_folder=tmp_path / "levels",
        user_tool_folder=tmp_path / "tools",
    )


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """The settings of nobody, in a file of the test's own."""
    return Settings(tmp_path / "settings.ini")


@pytest.fixture
def empty_session(qtbot: QtBot, options: SessionOptions) -> Iterator[Session]:
    """A session with nothing open."""
    session = Session(options)
    yield session
    session.shut_down()


@pytest.fixture
def delays_ms(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """By title, how long each job that has been started waits before it begins."""
    delays_ms: dict[str, int] = {}
    start = Jobs.start

    def noted(jobs: Jobs, title: str, *arguments: Any, **options: Any) -> Job:
        delays_ms[title] = options.get("delay_ms", 0)
        return start(jobs, title, *arguments, **options)

    monkeypatch.setattr(Jobs, "start", noted)
    return delays_ms


@pytest.fixture
def cancelled_too_late(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Titles of jobs that are cancelled when their work has ended and nobody has heard of it yet."""
    titles: set[str] = set()
    start = Jobs.start

    def started(jobs: Jobs, title: str, work: Callable[..., Any], **options: Any) -> Job:
        if title not in titles:
            return start(jobs, title, work, **options)
        known, is_known = [], threading.Event()

        def work_and_cancel(*arguments: Any) -> Any:
            result = work(*arguments)
            assert is_known.wait(10)
            jobs.cancel(known[0])
            return result

        known.append(start(jobs, title, work_and_cancel, **options))
        is_known.set()
        return known[0]

    monkeypatch.setattr(Jobs, "start", started)
    return titles


def open_and_wait(qtbot: QtBot, session: Session, path: Path) -> None:
    """Open a path and wait until its volume is there with its averaged level."""
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(path)
    qtbot.waitUntil(lambda: not session.jobs.running)


def _opened(qtbot: QtBot, options: SessionOptions, path: Path) -> Iterator[Session]:
    session = Session(options)
    open_and_wait(qtbot, session, path)
    yield session
    session.shut_down()


@pytest.fixture
def session(qtbot: QtBot, empty_session: Session, volume_path: Path) -> Session:
    """A session with the small volume open and all its levels there."""
    open_and_wait(qtbot, empty_session, volume_path)
    return empty_session


@pytest.fixture
def rita(qtbot: QtBot, options: SessionOptions, folder: Path) -> Iterator[Session]:
    """The session of somebody who does not annotate in the study ``folder``, with its first volume open."""
    yield from _opened(qtbot, replace(options, annotator_name="rita"), folder)


@pytest.fixture
def boxes_session(qtbot: QtBot, options: SessionOptions, volume_path: Path) -> Iterator[Session]:
    """A session with the small volume open, its document one of boxes."""
    yield from _opened(qtbot, replace(options, method="boxes"), volume_path)


@pytest.fixture(scope="session")
def predicted_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study as by `write_predicted_study`, to be copied."""
    from tests.annotator.predicted_study import write_predicted_study

    return write_predicted_study(tmp_path_factory.mktemp("predicted") / "study")


@pytest.fixture(scope="session")
def checkpoint() -> "Checkpoint":
    """The checkpoint that ships."""
    from annotations.prediction.checkpoint import load_checkpoint
    from annotations.prediction.shipped import shipped_checkpoint

    path = shipped_checkpoint("magnetic-forceps")
    assert path is not None
    return load_checkpoint(path)


@pytest.fixture
def network(monkeypatch: pytest.MonkeyPatch, checkpoint: "Checkpoint", folder: Path) -> "KnownNetwork":
    """What predicts in the study ``folder`` in place of any checkpoint."""
    from annotations.prediction import inference_process
    from tests.annotator.predicted_study import KnownNetwork

    network = KnownNetwork(checkpoint, folder)
    monkeypatch.setattr(inference_process, "InferenceProcess", lambda _path, sha256: network)
    return network
