"""The end of the process, also where a thread still hangs in a read or in an import."""

import logging
import os
import sys
import threading

_OUR_THREADS = ("job-", "slices-")


def leave(code: int) -> int:
    """Return the exit code, or end the process with it at once if one of its own threads is still at work.

    Such a thread may be inside VTK or a dead network share. Python would take the interpreter down around it,
    and the process would crash or hang instead of ending with its code. Everything has been saved by now.
    """
    if any(thread.name.startswith(_OUR_THREADS) for thread in threading.enumerate()):
        logging.shutdown()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    return code
