"""The library works on a machine with neither Qt nor VTK."""

import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import annotations

SCREEN_PACKAGES = (
    "PySide6",
    "shiboken6",
    "mayavi",
    "pyface",
    "traits",
    "traitsui",
    "tvtk",
    "vtk",
    "vtkmodules",
)
MODULES = sorted(found.name for found in pkgutil.walk_packages(annotations.__path__, "annotations."))


def run_without_screen_packages(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    # None in sys.modules makes Python refuse the import, as if the package were not installed.
    unimportable = f"import sys; sys.modules.update(dict.fromkeys({SCREEN_PACKAGES!r}))\n"
    return subprocess.run(
        [sys.executable, "-c", unimportable + script, *arguments], capture_output=True, text=True, check=False
    )


def test_the_screen_packages_really_cannot_be_imported() -> None:
    done = run_without_screen_packages("import PySide6.QtCore")

    assert "ModuleNotFoundError" in done.stderr


def test_every_module_of_the_library_imports() -> None:
    assert len(MODULES) > 1

    done = run_without_screen_packages(
        "import importlib\nfor name in sys.argv[1:]: importlib.import_module(name)", *MODULES
    )

    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "command",
    [
        "synthesize",
        "info",
        "targets",
        "convert",
        "check",
        "agreement",
        "export",
        "landmarks",
        "predict",
        "checkpoint",
        "train",
        "evaluate",
        "experiment",
    ],
)
def test_every_command_explains_itself(command: str) -> None:
    done = run_without_screen_packages(
        "from annotations.cli import main; sys.exit(main(sys.argv[1:]))", command, "--help"
    )

    assert done.returncode == 0, done.stderr
    assert command in done.stdout


def test_synthetic_volumes_are_made_described_and_checked(tmp_path: Path) -> None:
    script = "from annotations.cli import main; sys.exit(main(sys.argv[1:]))"
    folder = tmp_path / "study"

    made = run_without_screen_packages(
        script, "synthesize", str(folder), "--count", "1", "--seed", "3", "--shape", "32", "40", "24"
    )

    assert made.returncode == 0, made.stderr
    [document] = folder.rglob("*.json")
    for command in ("targets", "check"):
        done = run_without_screen_packages(script, command, str(document))
        assert done.returncode == 0, done.stdout + done.stderr
