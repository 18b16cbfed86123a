"""The command line ``annotations …``: every job that needs no window.

Each command is a module of its own, imported when it is called, so that ``--help`` answers at once.
Exit codes: 0, 1 for findings and failed files, 2 for misuse.
"""

import argparse
import io
import os
import sys
from collections.abc import Callable, Sequence

from annotations import __version__
from annotations.cli.annotation_commands import add_annotation_commands
from annotations.cli.network_commands import add_network_commands
from annotations.errors import UserError

__all__ = ["main"]

_INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv : sequence of str, optional
        The arguments after the program's name; those of the process by default.

    Returns
    -------
    int
        The exit code: 0, or 1 for findings and failed files.

    Raises
    ------
    SystemExit
        With 2 for misuse, with 0 after ``--help`` and ``--version``.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        # An old terminal that knows no µ gets an escape for it, not an error.
        sys.stdout.reconfigure(errors="backslashreplace")
    arguments = _parser().parse_args(argv)
    try:
        code = _command(arguments.command)(arguments)
        sys.stdout.flush()
    except UserError as error:
        sys.stderr.write(f"annotations: {error}\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("annotations: interrupted\n")
        return _INTERRUPTED
    except BrokenPipeError:
        # The reader of the output has seen enough; the interpreter's own flush at exit shall not complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return code


def _command(name: str) -> Callable[[argparse.Namespace], int]:
    match name:
        case "info":
            from annotations.cli.info import run
        case "targets":
            from annotations.cli.targets import run
        case "convert":
            from annotations.cli.convert import run
        case "check":
            from annotations.cli.check import run
        case "study":
            from annotations.cli.study import run
        case "agreement":
            from annotations.cli.agreement import run
        case "export":
            from annotations.cli.export import run
        case "landmarks":
            from annotations.cli.landmarks import run
        case "predict":
            from annotations.cli.predict import run
        case "train":
            from annotations.cli.train import run
        case "checkpoint":
            from annotations.cli.checkpoint import run
        case "evaluate":
            from annotations.cli.evaluate import run
        case "experiment":
            from annotations.cli.experiment import run
        case _:
            from annotations.cli.synthesize import run
    return run


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="annotations",
        description="Annotations of OCT volumes, without a window.",
        epilog="Results go to standard output, messages to standard error. "
        "Exit codes: 0, 1 for findings and failed files, 2 for misuse.",
    )
    parser.add_argument("--version", action="version", version=f"annotations {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    add_annotation_commands(commands)
    add_network_commands(commands)
    return parser
