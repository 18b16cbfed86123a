"""How long the program takes from the start of its process: measured by the process that starts it."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from tests.bench.figures import Figures

_USER_FOLDERS = {
    "XDG_CACHE_HOME": "cache",
    "XDG_CONFIG_HOME": "config",
    "XDG_DATA_HOME": "data",
    "XDG_STATE_HOME": "state",
}


def environment_of_nobody(home: Path) -> dict[str, str]:
    """Return the environment of a process that neither reads nor writes the user's own files."""
    return {
        **os.environ,
        "HOME": str(home),
        **{name: str(home / folder) for name, folder in _USER_FOLDERS.items()},
    }


def measure_start(home: Path, volume: Path | None) -> tuple[Figures, dict[str, object]]:
    """Start the command and wait for its stages; returns the figures, and what the watchdog saw.

    Parameters
    ----------
    home : Path
        Kept from one start to the next, as a person's home is; but for the levels of volumes.
    volume : Path or None
        To be opened at once.
    """
    shutil.rmtree(home / _USER_FOLDERS["XDG_CACHE_HOME"] / "oct-annotator" / "levels", ignore_errors=True)
    home.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "tests.bench.started_application", *([str(volume)] if volume else [])]
    prefix = "start_with_volume" if volume else "start"
    figures: Figures = {}
    watch: dict[str, object] = {}
    began_s = time.monotonic()
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env=environment_of_nobody(home)
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            said = json.loads(line)
            if "stage" in said:
                figures[f"{prefix}_to_{said['stage']}_ms"] = 1000 * (said["at_s"] - began_s)
                figures[f"{prefix}_to_{said['stage']}_cpu_ms"] = 1000 * said["cpu_s"]
            else:
                watch = said["watch"]
    if process.returncode or not watch:
        raise RuntimeError(f"the application ended with {process.returncode} before it could be used")
    figures[f"{prefix}_longest_step_ms"] = float(str(watch["rest_ms"]))
    return figures, watch
