"""Whether somebody may still write into a file."""

import os
import signal
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows has none.
    fcntl = None  # type: ignore[assignment]


def has_writer(path: Path) -> bool | None:
    """Say whether a program of this machine has a file open for writing, or mapped; None if nobody can say.

    Linux grants a lease for reading only where nobody has, and is asked for one, which is given back at once.
    It says nothing of files of another user, or of a network disk; other systems say nothing at all.

    Raises
    ------
    OSError
        The file cannot be opened.
    """
    if not hasattr(fcntl, "F_SETLEASE"):
        return None
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        # Whoever opens it for writing meanwhile waits until it is closed here, and this process is signalled:
        # the usual signal would end it, so it is to be one that does nothing.
        fcntl.fcntl(descriptor, fcntl.F_SETSIG, signal.SIGURG)
        fcntl.fcntl(descriptor, fcntl.F_SETLEASE, fcntl.F_RDLCK)
    except BlockingIOError:
        return True
    except OSError:
        return None
    finally:
        os.close(descriptor)
    return False
