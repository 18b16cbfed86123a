"""The guards of the tests guard: each lets a tidy test pass and makes an untidy one fail."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

LEAKS_A_WINDOW = """
from PySide6.QtWidgets import QWidget

def test_it(qtbot):
    global forgotten
    forgotten = QWidget()
    forgotten.setObjectName("forgotten")
    forgotten.show()
"""
CLOSES_ITS_WINDOW = """
from PySide6.QtWidgets import QWidget

def test_it(qtbot):
    widget = QWidget()
    qtbot.addWidget(widget)
    widget.show()
"""
CAUSES_A_QT_WARNING = """
from PySide6.QtCore import qWarning

def test_it(qtbot):
    qWarning("paint outside of a paint event")
"""
ASKS_FOR_THE_HOME = """
from pathlib import Path

import platformdirs

def test_it(tmp_path):
    assert Path.home().is_relative_to(tmp_path)
    for folder in (platformdirs.user_data_path, platformdirs.user_cache_path, platformdirs.user_config_path):
        assert folder("x").is_relative_to(tmp_path)
"""


def run_guarded(folder: Path, test: str) -> subprocess.CompletedProcess[str]:
    """Run one test file under this project's own settings and guards."""
    shutil.copy(ROOT / "tests" / "conftest.py", folder)
    shutil.copy(ROOT / "pyproject.toml", folder)
    (folder / "test_it.py").write_text(test)
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "test_it.py"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("test", [CLOSES_ITS_WINDOW, ASKS_FOR_THE_HOME])
def test_a_tidy_test_passes(tmp_path: Path, test: str) -> None:
    done = run_guarded(tmp_path, test)

    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("test", "complaint"),
    [
        (LEAKS_A_WINDOW, "left open: QWidget 'forgotten'"),
        (CAUSES_A_QT_WARNING, "paint outside of a paint event"),
    ],
)
def test_an_untidy_test_fails(tmp_path: Path, test: str, complaint: str) -> None:
    done = run_guarded(tmp_path, test)

    assert done.returncode == 1, done.stdout
    assert complaint in done.stdout
