"""The command as a person types it."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtGui import QImage

from annotations import __version__
from annotator.__main__ import main


def run(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own, without a display unless the environment names one."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM", "VTK_DEFAULT_OPENGL_WINDOW")
    }
    return subprocess.run(
        [sys.executable, "-m", "annotator", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
        env=kept | environment,
    )


def test_version_and_help_need_no_display():
    assert run("--version").stdout == f"annotator {__version__}\n"
    told = run("--help").stdout
    assert "--screenshot" in told
    assert "in pixels (1600 1000)" in " ".join(told.split())


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
def test_without_display_it_says_so_and_names_the_screenshot():
    done = run()
    assert done.returncode == 2
    assert done.stdout == ""
    assert "DISPLAY" in done.stderr
    assert "--screenshot OUT.png PATH" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--screenshot", "out.png"], "PATH"),
        (["--screenshot", "out.png", "v.npy", "--size", "10", "10"], "between"),
        (["--screenshot", "out.png", "v.npy", "--size", "wide", "10"], "wide"),
        (["--screenshot", "out.png", "v.npy", "--spacing", "1", "2"], "--spacing"),
        (["--annotator", " ", "v.npy"], "--annotator"),
        (["--fly"], "--fly"),
    ],
)
def test_misuse_is_explained(capsys, arguments, said):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("spacing", [("0", "1", "1"), ("1", "-2", "1"), ("1", "1", "nan"), ("inf", "1", "1")])
def test_impossible_spacing_is_explained(capsys, spacing):
    assert main(["v.npy", "--spacing", *spacing]) == 2
    assert "--spacing" in capsys.readouterr().err


@pytest.fixture
def bare_volume(tmp_path: Path) -> Path:
    path = tmp_path / "bare.npy"
    data = np.zeros((20, 30, 40), np.uint8)
    data[5:15, 5:25, 10:20] = 200
    np.save(path, data)
    return path


class TestScreenshot:
    def test_unknown_spacing_is_one_unit_per_voxel(self, bare_volume, tmp_path, user_home):
        picture = tmp_path / "out.png"
        done = run("--screenshot", picture, bare_volume, "--size", 1024, 700)
        assert done.returncode == 0, done.stderr
        assert done.stdout == ""
        assert done.stderr == ""
        image = QImage(str(picture))
        assert (image.width(), image.height()) == (1024, 700)
        # The scene, the slices and the panels are all there: hardly a picture of one colour.
        colors = {image.pixel(x, y) for x in range(0, 1024, 3) for y in range(0, 700, 3)}
        assert len(colors) > 100
        # Nothing was asked, and nothing is left: neither an answer nor an annotation.
        assert sorted(path.name for path in tmp_path.iterdir()) == ["bare.npy", "home", "out.png"]
        assert not list(user_home.rglob("*.ini"))
        assert not list(user_home.rglob("*.journal"))

    def test_absent_volume(self, tmp_path):
        done = run("--screenshot", tmp_path / "out.png", tmp_path / "nowhere.npy")
        assert done.returncode == 1
        assert "nowhere.npy" in done.stderr
        assert not (tmp_path / "out.png").exists()

    def test_a_checkpoint_is_no_picture(self, tmp_path):
        (tmp_path / "best.pt").touch()
        done = run("--screenshot", tmp_path / "out.png", tmp_path / "best.pt")
        assert done.returncode == 1
        assert "annotations checkpoint info" in done.stderr
        assert not (tmp_path / "out.png").exists()

    def test_picture_that_cannot_be_written(self, bare_volume, tmp_path):
        (tmp_path / "file").write_text("in the way")
        done = run("--screenshot", tmp_path / "file" / "out.png", bare_volume, "--spacing", 1, 1, 1)
        assert done.returncode == 1
        assert "out.png" in done.stderr
        assert "Traceback" not in done.stderr


@pytest.mark.skipif(os.name == "nt", reason="about POSIX signals")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_program_that_is_asked_to_end_ends_tidily(bare_volume, user_home, number):
    journals = user_home / ".local" / "state" / "oct-annotator" / "recovery"
    with subprocess.Popen(
        [sys.executable, "-m", "annotator", str(bare_volume), "--spacing", "10", "10", "10"],
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        # The journal is begun when the volume is open.
        while process.poll() is None and not list(journals.glob("*.journal")):
            time.sleep(0.05)
        process.send_signal(number)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 0, said
    assert "Traceback" not in said
    assert not list(journals.glob("*.journal"))
    assert (user_home / ".config" / "oct-annotator" / "annotator.ini").exists()
