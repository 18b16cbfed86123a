import errno
import os
import stat
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from annotations.durable_files import SaveError, check_writable, replace_durably, sync_folder

OLD = b"what stood there before\n"
NEW = b"what comes now\n" * 100
ERRORS = [errno.ENOSPC, errno.EACCES, errno.EROFS, errno.EIO]
POSIX = pytest.mark.skipif(os.name == "nt", reason="links and permissions as POSIX has them")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    folder = tmp_path / "folder"
    folder.mkdir()
    path = folder / "v001.keypoints.json"
    path.write_bytes(OLD)
    return path


@pytest.fixture
def fail_at(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, int, int], None]:
    """Let the operating system refuse one step, the first or second time that it is asked for."""

    def arrange(step: str, time: int, code: int) -> None:
        calls = 0

        def due() -> bool:
            nonlocal calls
            calls += 1
            return calls == time

        def refuse() -> None:
            raise OSError(code, os.strerror(code))

        class FullStream:
            """A stream whose disk is full after some bytes."""

            def __init__(self, stream: Any) -> None:
                self._stream = stream

            def __enter__(self) -> "FullStream":
                return self

            def __exit__(self, *_: object) -> None:
                self._stream.close()

            def write(self, content: bytes) -> int:
                if due():
                    self._stream.write(content[:7])
                    self._stream.flush()
                    refuse()
                return int(self._stream.write(content))

            def __getattr__(self, name: str) -> Any:
                return getattr(self._stream, name)

        original_open, original_fsync, original_replace = Path.open, os.fsync, os.replace

        def open_(self: Path, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
            if mode != "xb":
                return original_open(self, mode, *args, **kwargs)
            if step == "open" and due():
                refuse()
            stream = original_open(self, mode, *args, **kwargs)
            return FullStream(stream) if step == "write" else stream

        def fsync(descriptor: int) -> None:
            if due():
                refuse()
            original_fsync(descriptor)

        def replace(*args: Any, **kwargs: Any) -> None:
            if due():
                refuse()
            original_replace(*args, **kwargs)

        if step in ("open", "write"):
            monkeypatch.setattr(Path, "open", open_)
        elif step == "fsync":
            monkeypatch.setattr(os, "fsync", fsync)
        else:
            monkeypatch.setattr(os, "replace", replace)

    return arrange


def test_a_new_file_comes_with_its_folders(tmp_path: Path) -> None:
    path = tmp_path / "annotations" / "anna" / "v001.keypoints.json"
    replace_durably(path, NEW, backup=path.with_suffix(".bak"))
    assert path.read_bytes() == NEW
    assert list(path.parent.iterdir()) == [path]


def test_the_previous_content_is_kept_once(path: Path) -> None:
    backup = path.with_name(path.name + ".bak")
    replace_durably(path, NEW, backup=backup)
    assert (path.read_bytes(), backup.read_bytes()) == (NEW, OLD)
    replace_durably(path, b"third", backup=backup)
    assert (path.read_bytes(), backup.read_bytes()) == (b"third", NEW)
    assert sorted(path.parent.iterdir()) == [path, backup]


def test_without_a_wish_no_backup_is_made(path: Path) -> None:
    replace_durably(path, NEW)
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("code", ERRORS, ids=errno.errorcode.get)
@pytest.mark.parametrize("time", [1, 2])
@pytest.mark.parametrize("step", ["open", "write", "fsync", "replace"])
def test_a_failure_at_any_step_leaves_the_old_file_whole(
    path: Path, fail_at: Callable[[str, int, int], None], step: str, time: int, code: int
) -> None:
    backup = path.with_name(path.name + ".bak")
    backup.write_bytes(b"older still")
    fail_at(step, time, code)
    with pytest.raises(SaveError, match=os.strerror(code)) as refused:
        replace_durably(path, NEW, backup=backup)
    assert refused.value.where == path
    assert refused.value.remedy
    assert path.read_bytes() == OLD
    # The old backup, or already the next one, but never half of it; and nothing else is left.
    assert backup.read_bytes() in (b"older still", OLD)
    assert sorted(path.parent.iterdir()) == [path, backup]
    replace_durably(path, NEW, backup=backup)
    assert (path.read_bytes(), backup.read_bytes()) == (NEW, OLD)


@pytest.mark.parametrize("step", ["open", "write", "fsync", "replace"])
def test_a_failure_leaves_no_trace_where_nothing_was(
    tmp_path: Path, fail_at: Callable[[str, int, int], None], step: str
) -> None:
    fail_at(step, 1, errno.ENOSPC)
    with pytest.raises(SaveError):
        replace_durably(tmp_path / "new.json", NEW)
    assert not [entry for entry in tmp_path.iterdir() if entry.is_file()]


def test_a_folder_that_cannot_be_synced_is_no_failure(
    path: Path, fail_at: Callable[[str, int, int], None]
) -> None:
    # Some network shares refuse this; the file itself is on the disk, whole, under its name.
    fail_at("fsync", 2, errno.EINVAL)
    replace_durably(path, NEW)
    assert path.read_bytes() == NEW


def test_a_real_full_disk_leaves_the_old_file_whole(path: Path) -> None:
    resource = pytest.importorskip("resource", reason="the operating system sets no limits to files")
    program = (
        "import resource, sys; from pathlib import Path\n"
        "from annotations.durable_files import SaveError, replace_durably\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, (4096, {resource.RLIM_INFINITY}))\n"
        "try: replace_durably(Path(sys.argv[1]), bytes(100_000))\n"
        "except SaveError as error: print(error); sys.exit(7)\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=False, timeout=60
    )
    assert ended.returncode == 7, ended.stderr
    assert os.strerror(errno.EFBIG) in ended.stdout
    assert path.read_bytes() == OLD
    assert list(path.parent.iterdir()) == [path]


def test_a_folder_in_place_of_the_file_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "v001.json").mkdir()
    with pytest.raises(SaveError):
        replace_durably(tmp_path / "v001.json", NEW, backup=tmp_path / "v001.json.bak")
    assert (tmp_path / "v001.json").is_dir()
    assert [entry.name for entry in tmp_path.iterdir() if entry.name != "home"] == ["v001.json"]


def test_a_file_in_place_of_the_folder_is_an_error(path: Path) -> None:
    with pytest.raises(SaveError):
        replace_durably(path / "v001.json", NEW)
    assert path.read_bytes() == OLD


@POSIX
def test_permissions_are_kept_and_shared_with_the_backup(path: Path) -> None:
    path.chmod(0o640)
    backup = path.with_name(path.name + ".bak")
    replace_durably(path, NEW, backup=backup)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert stat.S_IMODE(backup.stat().st_mode) == 0o640


@POSIX
def test_a_new_file_has_the_permissions_of_any_other_new_file(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        replace_durably(tmp_path / "new.json", NEW)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "new.json").stat().st_mode) == 0o640


@POSIX
def test_a_link_stays_a_link(tmp_path: Path, path: Path) -> None:
    link = tmp_path / "link.json"
    link.symlink_to(os.path.relpath(path, tmp_path))
    backup = tmp_path / "link.json.bak"
    replace_durably(link, NEW, backup=backup)
    assert link.is_symlink()
    assert (link.read_bytes(), path.read_bytes(), backup.read_bytes()) == (NEW, NEW, OLD)
    assert list(path.parent.iterdir()) == [path]


@POSIX
def test_a_link_to_nothing_gets_its_file(tmp_path: Path) -> None:
    link = tmp_path / "link.json"
    link.symlink_to(tmp_path / "elsewhere" / "v001.json")
    replace_durably(link, NEW)
    assert link.is_symlink()
    assert (tmp_path / "elsewhere" / "v001.json").read_bytes() == NEW


def test_a_file_made_read_only_is_protected(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # As the operating system answers anyone but root, for whom tests may run.
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(SaveError, match="Permission denied"):
        replace_durably(path, NEW)
    assert path.read_bytes() == OLD


@pytest.mark.parametrize(
    "name", ["Jürgen – Änderung.json", "注釈 3.json", "пример.json", "a b'\"c.json", "é" * 120]
)
def test_names_in_any_script(tmp_path: Path, name: str) -> None:
    replace_durably(tmp_path / name, OLD)
    replace_durably(tmp_path / name, NEW)
    assert (tmp_path / name).read_bytes() == NEW


def test_several_windows_that_save_one_file_do_not_meet(path: Path) -> None:
    backup = path.with_name(path.name + ".bak")
    contents = [bytes([letter]) * 20_000 for letter in b"abcd"]
    failures: list[SaveError] = []

    def save_again_and_again(content: bytes) -> None:
        try:
            for _ in range(10):
                replace_durably(path, content, backup=backup)
        except SaveError as error:
            failures.append(error)

    windows = [threading.Thread(target=save_again_and_again, args=(content,)) for content in contents]
    for window in windows:
        window.start()
    for window in windows:
        window.join()
    assert not failures
    assert path.read_bytes() in contents
    assert backup.read_bytes() in [*contents, OLD]
    assert sorted(path.parent.iterdir()) == [path, backup]


def test_content_is_synced_before_it_takes_the_name(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[str] = []
    original_fsync, original_replace = os.fsync, os.replace

    def fsync(descriptor: int) -> None:
        steps.append("sync folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "sync file")
        original_fsync(descriptor)

    def replace(*args: Any, **kwargs: Any) -> None:
        steps.append("replace")
        original_replace(*args, **kwargs)

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "replace", replace)
    replace_durably(path, NEW)
    assert steps == ["sync file", "replace", *([] if os.name == "nt" else ["sync folder"])]


def test_an_absent_folder_needs_no_sync(tmp_path: Path) -> None:
    sync_folder(tmp_path / "absent")
    assert not (tmp_path / "absent").exists()


def test_whether_a_folder_can_be_written_is_found_out_without_a_trace(tmp_path: Path) -> None:
    before = list(tmp_path.iterdir())
    check_writable(tmp_path / "a" / "b")
    assert list(tmp_path.iterdir()) == before

    (tmp_path / "a").write_text("mine")
    with pytest.raises(SaveError, match="nothing can be written there"):
        check_writable(tmp_path / "a" / "b")
