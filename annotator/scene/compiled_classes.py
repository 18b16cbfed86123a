"""TVTK's classes, compiled once and kept.

They come as an archive of sources, and of what another Python has made of them: this one would compile them
at each start.
"""

import contextlib
import hashlib
import importlib.util
import logging
import marshal
import subprocess
import sys
import zipimport
from collections.abc import Iterator
from pathlib import Path
from types import CodeType

from annotations.durable_files import SaveError, replace_durably

_log = logging.getLogger(__name__)

_ARCHIVE = "tvtk_classes.zip"
_PACKAGE = "tvtk_classes"
_KEPT = "tvtk-classes.code"

# Takes some 25 ms.
_LARGE_CHARS = 100_000
_PATIENCE_S = 10.0
_COMPILE = """
import marshal, sys
source, filename, optimize = marshal.load(sys.stdin.buffer)
code = compile(source, filename, "exec", dont_inherit=True, optimize=optimize)
marshal.dump(code, sys.stdout.buffer)
"""


@contextlib.contextmanager
def kept_classes(folder: Path) -> Iterator[None]:
    """Import TVTK's classes as they were compiled before, and keep what is compiled in the block.

    To compile them takes a seventh of Mayavi's import, and keeps Python's lock for that long: for the module
    that all of them share 50 ms, so that another process does it. What cannot be read is compiled, what
    cannot be written is not kept.

    Parameters
    ----------
    folder : Path
        Holds one file. Whoever writes there can have the program do anything, as with Python's own
        ``__pycache__``: it belongs to the user.
    """
    archive = _archive()
    if archive is None:
        yield
        return
    path, identity = folder / _KEPT, _identity(archive)
    known = _read(path, identity)
    codes = dict(known)
    for place in (str(archive), str(archive / _PACKAGE)):
        # Where Python looks first. In its list of hooks another thread's import could miss one of them.
        sys.path_importer_cache[place] = _Importer(place, codes)
    yield
    if codes != known:
        try:
            replace_durably(path, _packed(codes, identity))
        except SaveError as error:
            _log.warning("TVTK's compiled classes are not kept: %s", error)
    # Python keeps the importers, and what has run is some 4 MiB.
    known.clear()
    codes.clear()


class _Importer(zipimport.zipimporter):
    """Compiles a module once. The base class does it for the name of its file, too."""

    def __init__(self, place: str, codes: dict[str, CodeType]) -> None:
        super().__init__(place)
        self._codes = codes

    def get_code(self, fullname: str) -> CodeType:
        code = self._codes.get(fullname)
        if code is None:
            code = self._codes[fullname] = self._compiled_apart(fullname) or super().get_code(fullname)
        return code

    def _compiled_apart(self, fullname: str) -> CodeType | None:
        """Let another process compile a large module; None where it is not large, or that did not work."""
        source = self.get_source(fullname)
        if source is None or len(source) < _LARGE_CHARS:
            return None
        try:
            done = subprocess.run(
                [sys.executable, "-I", "-S", "-c", _COMPILE],
                input=marshal.dumps((source, self.get_filename(fullname), sys.flags.optimize)),
                capture_output=True,
                check=True,
                timeout=_PATIENCE_S,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
            return marshal.loads(done.stdout)
        except (OSError, subprocess.SubprocessError, EOFError, ValueError, TypeError) as error:
            _log.warning("%s is compiled here: %s", fullname, error)
            return None

    def get_filename(self, fullname: str) -> str:
        path = Path(self.archive, self.prefix, fullname.rpartition(".")[2])
        return str(path / "__init__.py" if self.is_package(fullname) else path.with_suffix(".py"))


def _archive() -> Path | None:
    found = importlib.util.find_spec("tvtk")
    for folder in found.submodule_search_locations or () if found is not None else ():
        if (archive := Path(folder, _ARCHIVE)).is_file():
            return archive
    return None


def _identity(archive: Path) -> bytes:
    """Return what the compiled code belongs to: this archive, and a Python that would compile it alike."""
    state = archive.stat()
    parts = (
        archive,
        state.st_size,
        state.st_mtime_ns,
        sys.implementation.cache_tag,
        importlib.util.MAGIC_NUMBER,
        sys.flags.optimize,
    )
    return repr(parts).encode()


def _read(path: Path, identity: bytes) -> dict[str, CodeType]:
    try:
        content = path.read_bytes()
    except OSError:
        return {}
    size = hashlib.sha256().digest_size
    packed = content[size:]
    # What was torn or damaged must not reach `marshal`, which trusts it.
    if content[:size] != hashlib.sha256(identity + packed).digest():
        return {}
    return dict(marshal.loads(packed))


def _packed(codes: dict[str, CodeType], identity: bytes) -> bytes:
    packed = marshal.dumps(codes)
    return hashlib.sha256(identity + packed).digest() + packed
