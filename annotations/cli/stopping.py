"""Long work that a person may stop politely: once to end it where it can go on, twice at once."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

STOPPED = 130
"""Exit code of a command that a person stopped."""


def say(line: str) -> None:
    """Write a line of how it goes to standard error, at once."""
    sys.stderr.write(line + "\n")
    sys.stderr.flush()


@contextmanager
def stopping() -> Iterator[Callable[[], bool]]:
    """Give what says whether a person asked to stop."""
    asked = False

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True
        say("stopping after this step; press Ctrl-C again to lose what was learned since the last epoch")

    before = signal.signal(signal.SIGINT, on_signal)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)
