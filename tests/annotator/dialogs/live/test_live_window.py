"""A person watches volumes as they come, in the live view's window."""

import os
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFileDialog,
    QLabel,
    QPlainTextEdit,
    QPushButton,
)

from annotations.errors import UserError
from annotations.geometry.tool_library import shipped_tools
from annotations.prediction import inference_child
from annotations.prediction.live import run as run_module
from annotations.prediction.live.frame import FrameTimes, LiveFrame
from annotations.prediction.prediction import Confidence, FittedPose, PredictedKeypoint
from annotations.volumes import write_folder_answer
from annotator.dialogs.files.spacing_dialog import SpacingDialog
from annotator.dialogs.live.live_projections import LiveProjections
from annotator.dialogs.live.live_window import LiveWindow
from annotator.session.predictions import kept_volumes
from tests.annotations.prediction.test_inference_process import replace_worker
from tests.annotations.prediction.tiny_networks import NEEDLE, save_tiny
from tests.annotator.blind_study import write_study
from tests.annotator.conftest import open_and_wait

SHAPE, SPACING_UM = (6, 20, 16), (600.0, 100.0, 50.0)
PATIENCE_MS = 30_000
FORCEPS = shipped_tools()["magnetic-forceps"]
SLOW = """
real = w.fit_prediction
def slow(*given):
    time.sleep(0.5)
    return real(*given)
w.fit_prediction = slow
"""
CRASHING = """
import os
w.sample_volume = lambda *given: os._exit(3)
"""


def voxels(seed=0):
    return np.random.default_rng(seed).integers(0, 255, SHAPE, dtype=np.uint8)


def put(folder, name, content=None):
    """Write a volume under a hidden name, and give it its own."""
    hidden = folder / f".{name}"
    np.save(hidden, voxels() if content is None else content)
    hidden.rename(folder / name)


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "incoming"
    path.mkdir()
    write_folder_answer(path, SHAPE, SPACING_UM, 2)
    return path


@pytest.fixture
def sequence(tmp_path):
    path = tmp_path / "sequence"
    path.mkdir()
    write_folder_answer(path, SHAPE, SPACING_UM, 2)
    for number in range(3):
        np.save(path / f"v{number}.npy", voxels(number))
    return path


@pytest.fixture
def session(empty_session, tmp_path):
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    return empty_session


@pytest.fixture
def window(qtbot, session):
    shown = LiveWindow(session)
    qtbot.addWidget(shown)
    shown.show()
    return shown


def button(window, name):
    return window.findChild(QPushButton, name)


def text(window, name):
    return window.findChild(QLabel, name).text()


def messages(window):
    return window.findChild(QPlainTextEdit, "live_messages").toPlainText()


def click(window, name):
    assert button(window, name).isEnabled()
    QTest.mouseClick(button(window, name), Qt.MouseButton.LeftButton)


def choose(window, folder, monkeypatch):
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_given: str(folder))
    click(window, "live_choose")


def play(window, rate_hz=20.0, *, loops=True):
    window.findChild(QComboBox, "live_kind").setCurrentIndex(1)
    window.findChild(QDoubleSpinBox, "live_rate").setValue(rate_hz)
    window.findChild(QCheckBox, "live_loops").setChecked(loops)


def start(qtbot, window, folder, monkeypatch):
    choose(window, folder, monkeypatch)
    click(window, "live_start")
    qtbot.waitUntil(lambda: window._living.is_ready, timeout=PATIENCE_MS)


def shown(window):
    frame = window.projections.frame
    return None if frame is None else frame.volume_path.name


def wait_for(qtbot, window, name):
    qtbot.waitUntil(lambda: shown(window) == name, timeout=PATIENCE_MS)


def process_id(window):
    return window._living._run._network._child._process.pid


def test_a_volume_that_arrives_is_shown_with_its_pose_and_counted(qtbot, window, folder, monkeypatch):
    start(qtbot, window, folder, monkeypatch)
    assert text(window, "live_folder") == str(folder)
    put(folder, "v1.npy")

    wait_for(qtbot, window, "v1.npy")
    qtbot.waitUntil(lambda: text(window, "live_shown") == "1", timeout=PATIENCE_MS)
    assert text(window, "live_latency").endswith("ms")
    assert text(window, "live_dropped") == "0"
    assert text(window, f"live_presence_{NEEDLE.keypoint_names[0]}").split("%")[0].isdigit()
    put(folder, "v2.npy")
    wait_for(qtbot, window, "v2.npy")
    assert not list(folder.glob("predictions"))


def test_a_recorded_sequence_is_played_again_and_again_until_it_is_stopped(
    qtbot, window, sequence, monkeypatch
):
    play(window, 30.0)
    start(qtbot, window, sequence, monkeypatch)
    qtbot.waitUntil(lambda: window._living.statistics.shown > 3, timeout=PATIENCE_MS)
    assert not button(window, "live_choose").isEnabled()
    assert button(window, "live_start").text() == "&Stop"

    click(window, "live_start")

    assert button(window, "live_start").text() == "&Start"
    assert button(window, "live_choose").isEnabled()
    count = window._living.statistics.shown
    qtbot.wait(150)
    assert window._living.statistics.shown == count


def test_a_recorded_sequence_that_is_played_once_ends_with_its_last_volume(
    qtbot, window, sequence, monkeypatch
):
    play(window, 5.0, loops=False)
    start(qtbot, window, sequence, monkeypatch)

    qtbot.waitUntil(lambda: not window._living.is_running, timeout=PATIENCE_MS)

    assert shown(window) == "v2.npy"
    assert button(window, "live_start").text() == "&Start"
    assert messages(window) == ""


def test_what_a_slow_network_cannot_show_is_dropped_and_counted(qtbot, window, folder, monkeypatch):
    replace_worker(monkeypatch, SLOW)
    start(qtbot, window, folder, monkeypatch)
    put(folder, "v0.npy")
    qtbot.waitUntil(lambda: window._living._run._waiting is None, timeout=PATIENCE_MS)
    for number in range(1, 9):
        put(folder, f"v{number}.npy")
        qtbot.wait(20)

    wait_for(qtbot, window, "v8.npy")
    qtbot.waitUntil(lambda: text(window, "live_dropped") != "0", timeout=PATIENCE_MS)
    statistics = window._living.statistics
    assert statistics.shown + statistics.dropped == 9
    assert statistics.dropped >= 4


@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
def test_a_crash_is_told_and_survived(qtbot, window, folder, monkeypatch):
    replace_worker(monkeypatch, SLOW)
    start(qtbot, window, folder, monkeypatch)
    first = process_id(window)
    run = window._living._run
    put(folder, "v1.npy")
    qtbot.waitUntil(run._network._turn.locked, timeout=PATIENCE_MS)
    os.kill(first, signal.SIGKILL)

    qtbot.waitUntil(lambda: "started anew" in messages(window), timeout=PATIENCE_MS)
    put(folder, "v2.npy")
    wait_for(qtbot, window, "v2.npy")
    qtbot.waitUntil(lambda: text(window, "live_restarts") == "1", timeout=PATIENCE_MS)
    assert process_id(window) != first


def test_over_the_last_picture_stands_that_the_network_is_started_anew(qtbot, window, folder, monkeypatch):
    start(qtbot, window, folder, monkeypatch)
    put(folder, "v1.npy")
    wait_for(qtbot, window, "v1.npy")
    assert window.projections.note == ""
    before = window.projections.grab().toImage()

    window._living._on_run_restarting()

    assert "started anew" in window.projections.note
    assert window.projections.grab().toImage() != before
    window._living._on_run_ready()
    assert window.projections.note == ""
    assert window.projections.grab().toImage() == before


def test_a_network_that_crashes_again_and_again_stops_the_view_which_says_so(
    qtbot, window, folder, monkeypatch
):
    # Each start of a process takes a while.
    monkeypatch.setattr(run_module, "_MOST_CRASHES", 2)
    replace_worker(monkeypatch, CRASHING)
    start(qtbot, window, folder, monkeypatch)
    for number in range(2):
        qtbot.waitUntil(lambda: window._living.is_ready, timeout=PATIENCE_MS)
        put(folder, f"v{number}.npy")
        qtbot.waitUntil(
            lambda: window._living.statistics.skipped == number + 1,  # noqa: B023
            timeout=PATIENCE_MS,
        )

    qtbot.waitUntil(lambda: not window._living.is_running, timeout=PATIENCE_MS)
    last = messages(window).splitlines()[-1]
    assert "The live view has stopped" in last
    assert "v1.npy" in last
    assert "2 times one after the other" in last
    assert "start the view again" in last
    assert "has stopped" in window.projections.note


def test_a_folder_that_is_deleted_stops_the_view_which_says_so(qtbot, window, folder, monkeypatch):
    start(qtbot, window, folder, monkeypatch)
    for number in range(3):
        put(folder, f"v{number}.npy")
        wait_for(qtbot, window, f"v{number}.npy")
    assert window._living.statistics.rate_hz > 0

    shutil.rmtree(folder)

    qtbot.waitUntil(lambda: not window._living.is_running, timeout=PATIENCE_MS)
    assert "The live view has stopped" in messages(window)
    assert "the folder that receives the volumes is gone" in messages(window)
    assert text(window, "live_rate") == "0.0"
    assert "has stopped" in window.projections.note


def test_a_folder_that_is_not_there_is_told_at_once(window, tmp_path, monkeypatch):
    choose(window, tmp_path / "absent", monkeypatch)
    click(window, "live_start")

    assert "does not exist" in messages(window)
    assert not window._living.is_running


def test_a_file_that_is_still_being_written_is_told_until_it_is_shown(qtbot, window, folder, monkeypatch):
    np.save(folder / ".whole.npy", voxels())
    content = (folder / ".whole.npy").read_bytes()
    words = window.findChild(QLabel, "live_unfinished")
    start(qtbot, window, folder, monkeypatch)
    with (folder / "slow.npy").open("wb") as stream:
        stream.write(content[:1500])
        stream.flush()
        qtbot.waitUntil(words.isVisible, timeout=PATIENCE_MS)
        assert words.text() == f"Still being written, or cut short: {folder / 'slow.npy'} (71%)"
        assert text(window, "live_skipped") == "0"
        stream.write(content[1500:])

    wait_for(qtbot, window, "slow.npy")
    qtbot.waitUntil(lambda: not words.isVisible(), timeout=PATIENCE_MS)
    assert messages(window) == ""
    assert text(window, "live_skipped") == "0"


def test_a_half_written_file_is_not_read_and_a_wrong_one_is_told(qtbot, window, folder, monkeypatch):
    start(qtbot, window, folder, monkeypatch)
    np.save(folder / ".whole.npy", voxels())
    content = (folder / ".whole.npy").read_bytes()
    with (folder / "half.npy").open("wb") as stream:
        stream.write(content[:900])
        stream.flush()
        (folder / "wrong.npy").write_bytes(b"not a volume")
        put(folder, "right.npy")
        wait_for(qtbot, window, "right.npy")
        qtbot.waitUntil(lambda: "wrong.npy" in messages(window), timeout=PATIENCE_MS)
        stream.write(content[900:])
    wait_for(qtbot, window, "half.npy")
    qtbot.waitUntil(lambda: text(window, "live_skipped") != "0", timeout=PATIENCE_MS)


def test_closing_the_window_ends_the_process(qtbot, window, folder, monkeypatch):
    start(qtbot, window, folder, monkeypatch)
    run = window._living._run
    process = run._network._child._process
    window._living.failed.emit(UserError("it cannot be read", where="wrong.npy"))

    window.close()

    assert not window._living.is_running
    assert messages(window) == ""
    run.join(PATIENCE_MS / 1000)
    assert process.poll() is not None


def test_the_spacing_that_no_file_says_is_asked_for_once(qtbot, window, folder, monkeypatch):
    (folder / "volumes.toml").unlink()
    put(folder, "v1.npy")
    start(qtbot, window, folder, monkeypatch)
    qtbot.waitUntil(lambda: window.findChild(SpacingDialog) is not None, timeout=PATIENCE_MS)
    dialog = window.findChild(SpacingDialog)
    for axis, value in zip("xyz", SPACING_UM, strict=True):
        field = dialog.findChild(object, f"spacing_{axis}")
        field.setText(f"{value:g}")
    dialog.accept()

    wait_for(qtbot, window, "v1.npy")
    put(folder, "v2.npy")
    wait_for(qtbot, window, "v2.npy")
    # Nothing was written, and yet the next start knows it.
    assert {path.name for path in folder.iterdir()} == {"v1.npy", "v2.npy"}
    click(window, "live_start")
    start(qtbot, window, folder, monkeypatch)
    put(folder, "v3.npy")
    wait_for(qtbot, window, "v3.npy")


def questions(window):
    return [dialog for dialog in window.findChildren(SpacingDialog) if dialog.isVisible()]


def test_whoever_does_not_know_the_spacing_of_one_file_sees_the_others(qtbot, window, folder, monkeypatch):
    put(folder, "stray.npy", np.zeros((2, 2, 2), dtype=np.uint8))
    start(qtbot, window, folder, monkeypatch)
    qtbot.waitUntil(lambda: len(questions(window)) == 1, timeout=PATIENCE_MS)
    qtbot.waitUntil(lambda: text(window, "live_waiting") == "1", timeout=PATIENCE_MS)
    assert text(window, "live_skipped") == "0"

    questions(window)[0].reject()

    assert "Volumes of 2 × 2 × 2 voxels" in messages(window)
    assert "nobody said how far apart" in messages(window)
    put(folder, "v1.npy")
    wait_for(qtbot, window, "v1.npy")
    qtbot.waitUntil(lambda: text(window, "live_skipped") == "1", timeout=PATIENCE_MS)
    assert text(window, "live_waiting") == "0"
    put(folder, "another.npy", np.zeros((2, 2, 2), dtype=np.uint8))
    qtbot.waitUntil(lambda: text(window, "live_skipped") == "2", timeout=PATIENCE_MS)
    assert questions(window) == []


def test_one_question_is_asked_at_a_time(qtbot, window, folder, monkeypatch):
    start(qtbot, window, folder, monkeypatch)
    for count in (2, 3):
        put(folder, f"stray{count}.npy", np.zeros((count, 2, 2), dtype=np.uint8))
        qtbot.waitUntil(lambda: text(window, "live_waiting") == str(count - 1), timeout=PATIENCE_MS)  # noqa: B023
    [first] = questions(window)

    first.reject()

    [second] = questions(window)
    assert second is not first
    second.reject()
    assert questions(window) == []
    assert "3 × 2 × 2" in messages(window)
    assert window._living.is_running


def test_predictions_are_kept_where_that_is_wanted(qtbot, window, sequence, monkeypatch):
    window.findChild(QCheckBox, "live_keeps").setChecked(True)
    play(window, 5.0, loops=False)
    start(qtbot, window, sequence, monkeypatch)

    qtbot.waitUntil(lambda: not window._living.is_running, timeout=PATIENCE_MS)

    kept = sequence / "predictions" / "Tiny"
    assert (kept / "v2.json").is_file()


def test_predictions_that_cannot_be_kept_are_told_once_and_shown(qtbot, window, folder, monkeypatch):
    (folder / "predictions").write_text("This is no folder")
    window.findChild(QCheckBox, "live_keeps").setChecked(True)
    start(qtbot, window, folder, monkeypatch)
    for number in range(3):
        put(folder, f"v{number}.npy")
        wait_for(qtbot, window, f"v{number}.npy")

    qtbot.waitUntil(lambda: text(window, "live_shown") == "3", timeout=PATIENCE_MS)
    assert messages(window).count("predictions are not kept") == 1
    assert text(window, "live_skipped") == "0"


def test_without_a_checkpoint_it_offers_to_load_one(qtbot, empty_session, folder, monkeypatch):
    window = LiveWindow(empty_session)
    qtbot.addWidget(window)
    window.show()
    choose(window, folder, monkeypatch)
    assert not button(window, "live_start").isEnabled()
    with qtbot.waitSignal(window.action_requested, check_params_cb=lambda name: name == "shipped_checkpoint"):
        click(window, "live_ship")
    with qtbot.waitSignal(window.action_requested, check_params_cb=lambda name: name == "load_checkpoint"):
        click(window, "live_load")


def test_a_worker_that_cannot_start_is_told_and_ends_it(qtbot, window, folder, monkeypatch):
    monkeypatch.setattr(inference_child, "_COMMAND", ("/nowhere/python",))
    choose(window, folder, monkeypatch)
    click(window, "live_start")

    qtbot.waitUntil(lambda: "could not be started" in messages(window), timeout=PATIENCE_MS)
    assert not window._living.is_running


def test_a_sequence_without_volumes_is_told(window, tmp_path, monkeypatch):
    play(window)
    choose(window, tmp_path / "home", monkeypatch)
    click(window, "live_start")

    assert "no volume in this folder" in messages(window)
    assert not window._living.is_running


def forceps_frame(states):
    sure = Confidence(peak=1.0, presence=1.0, spread_um=(1.0, 1.0, 1.0))
    keypoints = tuple(
        PredictedKeypoint(
            name=name,
            state=state,
            position_um=None if state == "unplaced" else (8000.0 + 900 * place, 9000.0, 4000.0),
            source=None if state == "unplaced" else "predicted",
            confidence=sure,
        )
        for place, (name, state) in enumerate(zip(FORCEPS.keypoint_names, states, strict=True))
    )
    pose = FittedPose(position_um=(9000.0, 9000.0, 4000.0), rotation_wxyz=(1.0, 0.0, 0.0, 0.0), rms_um=50.0)
    pictures = tuple(np.full(shape, 90, dtype=np.uint8) for shape in ((139, 83), (28, 83), (28, 139)))
    return LiveFrame(
        Path("v1.npy"),
        keypoints,
        pose,
        pictures,
        (0.0, 0.0, 61.0),
        (622.0, 189.0, 131.6),
        2,
        FrameTimes(0, 0, 0, 0),
    )


def test_keypoints_that_are_not_seen_are_warned_of_in_red(qtbot):
    view = LiveProjections()
    qtbot.addWidget(view)
    view.resize(700, 460)
    with qtbot.waitExposed(view):
        view.show()

    assert view.show_frame(forceps_frame(["placed"] * 6), FORCEPS)
    assert view.warning == ""
    below = view.grab().toImage().pixelColor(10, view.height() - 3)
    assert view.show_frame(forceps_frame(["placed"] * 4 + ["out_of_view", "unplaced"]), FORCEPS)

    assert view.warning == "Not seen: k5.  Outside the volume: k4"
    assert view.accessibleDescription() == view.warning
    assert view.grab().toImage().pixelColor(10, view.height() - 3) == QColor("#b3261e") != below


def test_a_frame_that_nobody_can_see_is_not_counted_as_shown(qtbot):
    view = LiveProjections()
    qtbot.addWidget(view)

    assert not view.show_frame(forceps_frame(["placed"] * 6), FORCEPS)


def test_a_blind_study_that_is_opened_takes_picture_pose_and_messages_away(
    qtbot, window, tmp_path, monkeypatch
):
    window._session.set_annotator_name("rita")
    study = write_study(tmp_path / "study")
    start(qtbot, window, study / "volumes" / "left side", monkeypatch)
    qtbot.waitUntil(lambda: window.projections.frame is not None, timeout=PATIENCE_MS)
    window._living.failed.emit(UserError("it cannot be read", where="porcine-liver.npy"))
    window._session.set_annotator_name("anna")
    open_and_wait(qtbot, window._session, study)

    assert window.projections.frame is None
    assert "porcine" not in messages(window)
    assert "kept from you" in messages(window)
    assert text(window, f"live_presence_{NEEDLE.keypoint_names[0]}") == "—"


def test_after_the_window_is_closed_what_it_showed_is_not_looked_for_again(
    qtbot, window, tmp_path, monkeypatch
):
    window._session.set_annotator_name("rita")
    start(qtbot, window, write_study(tmp_path / "study") / "volumes" / "left side", monkeypatch)
    listed = []
    monkeypatch.setattr(kept_volumes, "volume_paths", lambda folder: listed.append(folder) or [])
    window.close()
    open_and_wait(qtbot, window._session, write_study(tmp_path / "other", blind=False))

    assert listed == []


def test_a_file_that_is_called_like_a_volume_of_the_blind_study_is_not_called_by_its_number(
    qtbot, window, folder, tmp_path, monkeypatch
):
    open_and_wait(qtbot, window._session, write_study(tmp_path / "study"))
    start(qtbot, window, folder, monkeypatch)
    (folder / "porcine-liver.npy").write_bytes(b"no volume")
    qtbot.waitUntil(lambda: messages(window) != "", timeout=PATIENCE_MS)

    assert "porcine-liver.npy" in messages(window)
    assert "Volume " not in messages(window)
