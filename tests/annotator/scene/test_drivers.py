"""What OpenGL loads is noted at one start, and loaded ahead at the next."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="nobody else tells what is loaded")

CODE = """
import ctypes
import mmap
import sys
from pathlib import Path
from annotator.scene.drivers import Drivers
folder, *needed = sys.argv[1:]
drivers = Drivers(Path(folder), "xcb")
drivers.keep()  # nothing is known yet
drivers.load()
maps = Path("/proc/self/maps").read_bytes()
print(*[name for name in ("old", "new") if f"lib{name}.so".encode() in maps])
data = []
for path in needed:
    if path == "crash":
        sys.exit()
    if "lib" in Path(path).name:
        ctypes.CDLL(path)
    else:
        with open(path, "rb") as file:
            data.append(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
drivers.keep()
"""


@pytest.fixture
def libraries(tmp_path: Path) -> dict[str, str]:
    """Two libraries that no program has loaded yet."""
    found = importlib.util.find_spec("pydantic_core._pydantic_core")
    assert found is not None
    assert found.origin is not None
    return {name: str(shutil.copyfile(found.origin, tmp_path / f"lib{name}.so")) for name in ("old", "new")}


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    return tmp_path / "cache" / "opengl-libraries-xcb.json"


def start(kept: Path, *needed: str) -> list[str]:
    """Start a program that needs some libraries, and return which of them were loaded ahead."""
    command = [sys.executable, "-c", CODE, str(kept.parent), *needed]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def noted(kept: Path) -> list[str]:
    """Return those that are noted of the two; a library may need others of the system."""
    return [
        path for path in json.loads(kept.read_text())["libraries"] if kept.parents[1] in Path(path).parents
    ]


def test_the_next_start_loads_what_this_one_needed(libraries: dict[str, str], kept: Path) -> None:
    assert start(kept, libraries["old"]) == []
    assert noted(kept) == [libraries["old"]]
    before = kept.read_text()
    assert start(kept, libraries["old"]) == ["old"]
    assert kept.read_text() == before
    assert not Path(kept.parent, "opengl-libraries-offscreen.json").exists()


def test_a_library_that_is_gone_is_forgotten(libraries: dict[str, str], kept: Path) -> None:
    start(kept, libraries["old"])
    Path(libraries["old"]).unlink()
    assert start(kept, libraries["new"]) == []
    assert noted(kept) == [libraries["new"]]


def test_after_a_month_it_is_noted_anew_whatever_was_added_meanwhile(
    libraries: dict[str, str], kept: Path
) -> None:
    start(kept, libraries["old"])
    note = json.loads(kept.read_text())
    kept.write_text(json.dumps(note | {"noted_s": note["noted_s"] - 29 * 24 * 3600}))
    assert start(kept, libraries["new"]) == ["old"]
    assert noted(kept) == sorted(libraries.values())
    note = json.loads(kept.read_text())
    kept.write_text(json.dumps(note | {"noted_s": note["noted_s"] - 2 * 24 * 3600}))
    assert start(kept, libraries["new"]) == []
    assert noted(kept) == [libraries["new"]]


def test_what_ends_the_program_is_not_tried_again(libraries: dict[str, str], kept: Path) -> None:
    start(kept, libraries["old"])
    assert start(kept, "crash") == ["old"]
    assert start(kept, libraries["new"]) == []


def test_data_are_no_libraries_whatever_they_are_called(
    libraries: dict[str, str], kept: Path, tmp_path: Path
) -> None:
    folder = tmp_path / os.fsdecode(b"M\xfcller.source")
    folder.mkdir()
    volume = shutil.copyfile(libraries["old"], folder / "volume.so")
    assert start(kept, str(volume), libraries["new"]) == []
    assert noted(kept) == [libraries["new"]]


@pytest.mark.parametrize(
    "content", ["", "{", "[]", '{"noted_s": 1e12, "libraries": [1]}', '{"libraries": []}']
)
def test_a_damaged_note_is_none(content: str, libraries: dict[str, str], kept: Path) -> None:
    kept.parent.mkdir()
    kept.write_text(content)
    assert start(kept, libraries["new"]) == []
    assert noted(kept) == [libraries["new"]]


def test_a_folder_that_cannot_be_written_is_no_error(libraries: dict[str, str], kept: Path) -> None:
    kept.parent.write_text("a file")
    assert start(kept, libraries["new"]) == []
