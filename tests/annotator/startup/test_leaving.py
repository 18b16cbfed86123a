"""The process ends with its code, also while one of its threads hangs."""

import subprocess
import sys

SCRIPT = """
import sys, threading
from annotator.startup.leaving import leave
threading.Thread(target=threading.Event().wait, name="job-0", daemon={daemon}).start()
print("said before")
sys.exit(leave(3))
"""


def output_of(script: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False
    )


def test_a_hanging_thread_does_not_keep_the_process_or_its_code() -> None:
    for daemon in (True, False):
        done = output_of(SCRIPT.format(daemon=daemon))
        assert done.returncode == 3
        assert done.stdout == "said before\n"


def test_nothing_is_forced_where_nothing_hangs() -> None:
    script = "import atexit; from annotator.startup.leaving import leave; "
    assert output_of(script + "atexit.register(print, 'tidy'); leave(0)").stdout == "tidy\n"
