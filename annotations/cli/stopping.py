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
        say("stopping after this step; asked again, what was learned since the last epoch is lost")

    # The first is a person's at the terminal; the second a machine's, such as a queue at its time limit.
    before = {number: signal.signal(number, on_signal) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
