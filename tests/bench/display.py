"""A display to draw on: the one that is there, else a virtual one."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

# Room for a window whose scene is as large as a peer's canvas.
SIZE_PX = (1920, 1200)


@contextmanager
def display() -> Iterator[None]:
    """Give this process, and those that it starts, a display; an Xvfb where there is none.

    Raises
    ------
    SystemExit
        There is neither a display nor an Xvfb.
    """
    if os.environ.get("DISPLAY") or not sys.platform.startswith("linux"):
        yield
        return
    reader, writer = os.pipe()
    screen = ["-screen", "0", f"{SIZE_PX[0]}x{SIZE_PX[1]}x24"]
    try:
        server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writer), *screen, "-nolisten", "tcp", "-noreset"],
            pass_fds=(writer,),
            stderr=subprocess.DEVNULL,
        )
    except FileNotFoundError:
        sys.exit("There is no display, and no Xvfb. On Debian or Ubuntu: sudo apt-get install xvfb")
    os.close(writer)
    with os.fdopen(reader) as numbers:
        os.environ["DISPLAY"] = f":{numbers.readline().strip()}"
    try:
        yield
    finally:
        del os.environ["DISPLAY"]
        server.terminate()
        server.wait()
