"""TVTK's classes are compiled once, and what is kept of them is never taken for something else."""

import builtins
import importlib
import logging
import shutil
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from annotator.scene.compiled_classes import kept_classes

KEPT = "tvtk-classes.code"


def forget_tvtk() -> dict[str, ModuleType]:
    names = [name for name in sys.modules if name == "tvtk" or name.startswith("tvtk.")]
    return {name: sys.modules.pop(name) for name in names}


@pytest.fixture
def archive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The archive of classes of a TVTK that takes the place of the real one."""
    folder = tmp_path / "packages" / "tvtk"
    folder.mkdir(parents=True)
    archive = folder / "tvtk_classes.zip"
    write_classes(archive, "1")
    (folder / "__init__.py").write_text(f"__path__.append({str(archive)!r})\n")
    real = forget_tvtk()
    monkeypatch.syspath_prepend(str(folder.parent))
    yield archive
    forget_tvtk()
    sys.modules.update(real)
    for place in [place for place in sys.path_importer_cache if Path(place).is_relative_to(tmp_path)]:
        del sys.path_importer_cache[place]


def write_classes(archive: Path, value: str, *, more: str = "") -> None:
    source = f"VALUE = {value}\n\ndef fail():\n    raise OSError(VALUE)\n{more}"
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("tvtk_classes/__init__.py", "")
        file.writestr("tvtk_classes/actor.py", source)


def started(folder: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[ModuleType, list[str]]:
    """Import a class as a new process would; returns its module, and the files that were compiled for it."""
    forget_tvtk()
    importlib.invalidate_caches()
    for place in [place for place in sys.path_importer_cache if "tvtk" in place]:
        del sys.path_importer_cache[place]
    compiled: list[str] = []
    real = compile

    def count(source: str, filename: str, *more: object, **options: object) -> object:
        if "tvtk_classes.zip" in filename:
            compiled.append(Path(filename).name)
        return real(source, filename, *more, **options)  # type: ignore[call-overload]

    with monkeypatch.context() as counting:
        counting.setattr(builtins, "compile", count)
        with kept_classes(folder):
            module = importlib.import_module("tvtk.tvtk_classes.actor")
    return module, compiled


def test_a_class_is_compiled_once_and_not_at_the_next_start(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module, compiled = started(tmp_path / "cache", monkeypatch)
    assert (module.VALUE, compiled) == (1, ["__init__.py", "actor.py"])
    module, compiled = started(tmp_path / "cache", monkeypatch)
    assert (module.VALUE, compiled) == (1, [])
    # As if it had been compiled now: where it is from stands in tracebacks.
    assert module.__file__ == str(archive / "tvtk_classes" / "actor.py")
    with pytest.raises(OSError, match="1") as raised:
        module.fail()
    assert str(raised.traceback[-1].path) == module.__file__


def test_another_archive_is_compiled_anew(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started(tmp_path / "cache", monkeypatch)
    write_classes(archive, "22")
    module, compiled = started(tmp_path / "cache", monkeypatch)
    assert (module.VALUE, compiled) == (22, ["__init__.py", "actor.py"])


LARGE = "MORE = [\n" + 10_000 * "    'a number: µ',\n" + "]\n"


def test_another_process_compiles_a_large_module(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    write_classes(archive, "3", more=LARGE)
    module, compiled = started(tmp_path / "cache", monkeypatch)
    assert (module.VALUE, compiled) == (3, ["__init__.py"])
    assert module.MORE == 10_000 * ["a number: µ"]
    with pytest.raises(OSError, match="3") as raised:
        module.fail()
    assert str(raised.traceback[-1].path) == str(archive / "tvtk_classes" / "actor.py")
    assert raised.traceback[-1].lineno == 3
    assert started(tmp_path / "cache", monkeypatch)[1] == []
    assert not caplog.records


@pytest.mark.parametrize("python", ["absent", "false", "true", "echo"])
def test_what_no_other_process_compiles_is_compiled_here(
    archive: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    python: str,
) -> None:
    write_classes(archive, "3", more=LARGE)
    monkeypatch.setattr(sys, "executable", shutil.which(python) or str(tmp_path / python))
    module, compiled = started(tmp_path / "cache", monkeypatch)
    assert (module.VALUE, compiled) == (3, ["__init__.py", "actor.py"])
    assert "actor is compiled here" in caplog.text


def test_a_large_module_with_an_error_says_where(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_classes(archive, "3", more=f"{LARGE}def\n")
    with pytest.raises(SyntaxError, match=r"actor\.py"):
        started(tmp_path / "cache", monkeypatch)


@pytest.mark.parametrize("damage", ["cut", "changed", "empty"])
def test_a_damaged_file_is_never_read(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: str
) -> None:
    started(tmp_path / "cache", monkeypatch)
    kept = tmp_path / "cache" / KEPT
    content = kept.read_bytes()
    damaged = {"cut": content[:-20], "changed": content[:-20] + bytes(20), "empty": b""}[damage]
    kept.write_bytes(damaged)
    module, compiled = started(tmp_path / "cache", monkeypatch)
    assert (module.VALUE, compiled) == (1, ["__init__.py", "actor.py"])
    assert started(tmp_path / "cache", monkeypatch)[1] == []


def test_where_nothing_can_be_kept_it_is_compiled(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "cache").write_text("a file where the folder would be")
    with caplog.at_level(logging.WARNING):
        module, compiled = started(tmp_path / "cache", monkeypatch)
    assert (module.VALUE, compiled) == (1, ["__init__.py", "actor.py"])
    assert "not kept" in caplog.text


def test_without_an_archive_nothing_is_kept(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    archive.unlink()
    with pytest.raises(ModuleNotFoundError):
        started(tmp_path / "cache", monkeypatch)
    assert not (tmp_path / "cache").exists()
