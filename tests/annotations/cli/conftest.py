"""What the tests of the command line share."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from annotations.cli import main
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis import write_study

SHAPE = (22, 39, 23)


@pytest.fixture(scope="session")
def made_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "study"
    write_study(folder, shipped_tools()["magnetic-forceps"], count=2, seed=3, shape=SHAPE)
    return folder


@pytest.fixture
def study(made_study: Path, tmp_path: Path) -> Path:
    """A study of two synthetic volumes, to be changed at will."""
    return shutil.copytree(made_study, tmp_path / "study")


@pytest.fixture
def volume_path(study: Path) -> Path:
    return study / "volumes" / "v001.npy"


@pytest.fixture
def truth_path(study: Path) -> Path:
    return study / "annotations" / "truth" / "v001.keypoints.json"


Edit = Callable[[dict[str, Any]], None]


@pytest.fixture
def rewrite(truth_path: Path) -> Callable[[Edit], None]:
    """Change the fields of the annotation file as a careless person might."""

    def rewrite(edit: Edit) -> None:
        fields = json.loads(truth_path.read_text())
        edit(fields)
        truth_path.write_text(json.dumps(fields, indent=1))

    return rewrite


@pytest.fixture
def run_json(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, list[dict[str, Any]], str]]:
    """Run a command with ``--json``: its exit code, the objects, one a line, and its messages."""

    def run_json(*arguments: object) -> tuple[int, list[dict[str, Any]], str]:
        code = main([*map(str, arguments), "--json"])
        captured = capsys.readouterr()
        return code, [json.loads(line) for line in captured.out.splitlines()], captured.err

    return run_json
