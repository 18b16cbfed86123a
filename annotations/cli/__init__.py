"""The command line ``annotations …``: every job that needs no window.

Each command is a module of its own, imported when it is called, so that ``--help`` answers at once.
Exit codes: 0, 1 for findings and failed files, 2 for misuse.
"""

import argparse
import io
import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from annotations import __version__
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

    info = _add(
        commands,
        "info",
        "say what a volume is",
        "Say what each volume is: format, shape, spacing, fingerprint.",
    )
    info.add_argument("volumes", nargs="+", type=Path, metavar="VOLUME", help="a file, or a Zarr folder")
    info.add_argument("--dataset", metavar="NAME", help="which array, where a file holds several")

    targets = _add(
        commands,
        "targets",
        "pose targets of annotation files",
        "Compute the pose targets of each annotation file: position (µm), orientation (a unit vector) and "
        "the joints' angles (degrees, unsigned; boxes give the signed ones besides). The volumes are not "
        "needed.",
    )
    targets.add_argument("files", nargs="+", type=Path, metavar="FILE", help="an annotation file (.json)")

    convert = _add(
        commands,
        "convert",
        "keypoints from boxes, or boxes from keypoints",
        "Derive a new annotation file of the other method; the original stays as it is. Boxes need a roll: "
        "that which the bend of the tool shows, or the one given.",
    )
    convert.add_argument("file", type=Path, metavar="FILE", help="an annotation file (.json)")
    convert.add_argument(
        "--to", required=True, choices=["keypoints", "boxes"], help="the method of the new file (required)"
    )
    convert.add_argument(
        "--roll-deg",
        type=_angle,
        metavar="R",
        help="roll of the first link's box in degrees (yaw-pitch-roll), where the keypoints do not show it",
    )
    convert.add_argument(
        "-o", "--output", required=True, type=Path, metavar="OUT", help="the new file (required)"
    )

    check = _add(
        commands,
        "check",
        "find what is wrong with annotation files",
        "Check each annotation file, whether the tool can look like that, and whether its volume is there "
        "and still the one that was annotated.",
    )
    check.add_argument("files", nargs="+", type=Path, metavar="FILE", help="an annotation file (.json)")

    synthesize = _add(
        commands,
        "synthesize",
        "make a study of synthetic volumes",
        "Make a study of OCT-like volumes of a tool in random poses, with exact annotations. Any shape "
        "covers the same workspace of 17.4 × 26.1 × 10.8 mm; axis 2 is depth; the same seed gives the same "
        "study.",
    )
    synthesize.add_argument("folder", type=Path, metavar="FOLDER", help="absent or empty")
    synthesize.add_argument(
        "--count", required=True, type=_at_least(1), metavar="N", help="how many volumes (required)"
    )
    synthesize.add_argument(
        "--seed",
        required=True,
        type=_at_least(0),
        metavar="S",
        help="where all random choices come from (required)",
    )
    synthesize.add_argument(
        "--shape",
        nargs=3,
        type=_at_least(1),
        metavar=("X", "Y", "Z"),
        help="voxels of each volume (those of the scanner's full volume, 2.4 GB, by default)",
    )
    synthesize.add_argument(
        "--tool",
        default="magnetic-forceps",
        metavar="NAME",
        help="a tool specification that ships or is in your tool folder (%(default)s)",
    )
    return parser


def _add(
    commands: "argparse._SubParsersAction[argparse.ArgumentParser]", name: str, summary: str, description: str
) -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=summary, description=description)
    command.add_argument(
        "--json", action="store_true", help="print one JSON object per file, each on a line of its own"
    )
    command.set_defaults(misuse=command.error)
    return command


def _angle(text: str) -> float:
    try:
        angle_deg = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not math.isfinite(angle_deg):
        raise argparse.ArgumentTypeError(f"{text!r} is not an angle")
    # Without the sign of a negative zero, which would be written down and shown.
    return angle_deg + 0.0


def _at_least(least: int) -> Callable[[str], int]:
    def whole_number(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if number < least:
            raise argparse.ArgumentTypeError(f"{number} is less than {least}")
        return number

    return whole_number
