import os
import subprocess
import sys
from pathlib import Path

import pytest

from annotations import __version__, cli
from annotations.cli import main

PROGRAM = Path(sys.executable).with_name("annotations.exe" if sys.platform == "win32" else "annotations")


def run(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PROGRAM, *map(str, arguments)],
        capture_output=True,
        text=True,
        encoding="utf-8",
        env=os.environ | environment,
        timeout=60,
        check=False,
    )


def test_help_names_every_command_and_the_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["--help"])

    assert caught.value.code == 0
    text = " ".join(capsys.readouterr().out.split())
    for word in ("info", "targets", "check", "synthesize", "1 for findings", "2 for misuse"):
        assert word in text


def test_it_runs_as_a_module() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "annotations.cli", "--version"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )

    assert (done.returncode, done.stdout) == (0, f"annotations {__version__}\n")


PRINT_VERSION = """
import sys
from annotations.cli import main
try:
    main(["--version"])
except SystemExit:
    sys.exit(" ".join(name for name in ("numpy", "scipy", "h5py", "zarr") if name in sys.modules))
"""


def test_help_and_version_import_nothing_heavy() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PRINT_VERSION], capture_output=True, text=True, timeout=60, check=False
    )

    assert done.stdout == f"annotations {__version__}\n"
    assert done.stderr == "\n"


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["dance"],
        ["info"],
        ["targets"],
        ["check"],
        ["check", "--quickly", "a.json"],
        ["synthesize", "folder"],
    ],
)
def test_misuse_ends_with_two(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)

    assert caught.value.code == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "usage: annotations" in captured.err


def test_an_interrupted_command_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(_arguments: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_command", lambda _name: interrupted)

    assert main(["info", "v.npy"]) == 130
    assert capsys.readouterr().err == "annotations: interrupted\n"


@pytest.mark.parametrize("command", ["info", "targets", "check"])
def test_the_installed_program_runs_each_command(study: Path, command: str) -> None:
    path = study / ("volumes/v001.npy" if command == "info" else "annotations/truth/v001.keypoints.json")

    done = run(command, path)

    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(str(path))


def test_the_installed_program_makes_a_study(tmp_path: Path) -> None:
    done = run("synthesize", tmp_path / "s", "--count", 1, "--seed", 1, "--shape", 9, 14, 11)

    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "s" / "study.toml").exists()


def test_a_terminal_without_the_fields_own_signs_gets_escapes(truth_path: Path) -> None:
    done = run("targets", truth_path, PYTHONIOENCODING="ascii")

    assert done.returncode == 0
    assert r"\xb5m" in done.stdout


def test_a_reader_that_stops_reading_is_no_error(study: Path) -> None:
    paths = [str(study / "annotations/truth/v001.keypoints.json")] * 2000
    with subprocess.Popen(
        [PROGRAM, "targets", *paths], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        messages = process.stderr.read()
        code = process.wait(timeout=60)

    assert messages == ""
    assert code == 1
