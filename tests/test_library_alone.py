"""The library works on a machine with neither Qt nor VTK, and all of it but the learning without torch."""

import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import annotations

UNNEEDED_PACKAGES = (
    "torch",
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

IMPORT_ALL = """
import importlib
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name.partition(".")[0] != "torch" or not name.startswith("annotations.learning."):
            raise
"""


def run_without_unneeded_packages(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    # None in sys.modules makes Python refuse the import, as if the package were not installed.
    unimportable = f"import sys; sys.modules.update(dict.fromkeys({UNNEEDED_PACKAGES!r}))\n"
    return subprocess.run(
        [sys.executable, "-c", unimportable + script, *arguments], capture_output=True, text=True, check=False
    )


def test_the_unneeded_packages_really_cannot_be_imported() -> None:
    for module in ("PySide6.QtCore", "torch"):
        assert "ModuleNotFoundError" in run_without_unneeded_packages(f"import {module}").stderr


def test_every_module_of_the_library_imports() -> None:
    assert len(MODULES) > 1

    done = run_without_unneeded_packages(IMPORT_ALL, *MODULES)

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
    done = run_without_unneeded_packages(
        "from annotations.cli import main; sys.exit(main(sys.argv[1:]))", command, "--help"
    )

    assert done.returncode == 0, done.stderr
    assert command in done.stdout


def test_synthetic_volumes_are_made_described_and_checked(tmp_path: Path) -> None:
    script = "from annotations.cli import main; sys.exit(main(sys.argv[1:]))"
    folder = tmp_path / "study"

    made = run_without_unneeded_packages(
        script, "synthesize", str(folder), "--count", "1", "--seed", "3", "--shape", "32", "40", "24"
    )

    assert made.returncode == 0, made.stderr
    documents = sorted(path.name for path in folder.rglob("*.json"))
    assert documents == ["v001.boxes.json", "v001.keypoints.json"]
    for command in ("targets", "check"):
        done = run_without_unneeded_packages(script, command, *map(str, folder.rglob("*.json")))
        assert done.returncode == 0, done.stdout + done.stderr
