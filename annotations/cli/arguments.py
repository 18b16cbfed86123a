"""Commands of the command line, and the kinds of values that their arguments have."""

import argparse
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]  # noqa: SLF001 - it has no other name

USUAL_TOOL = "magnetic-forceps"
"""Where nothing says the tool."""


def new_command(
    commands: "Commands",
    name: str,
    summary: str,
    description: str,
    json_help: str | None = "print one JSON object per file, each on a line of its own",
) -> argparse.ArgumentParser:
    """Add a command; without a `json_help` it takes no ``--json``."""
    command = commands.add_parser(name, help=summary, description=description)
    if json_help is not None:
        command.add_argument("--json", action="store_true", help=json_help)
    command.set_defaults(misuse=command.error)
    return command


def angle(text: str) -> float:
    """Return an angle in degrees."""
    angle_deg = _number(text)
    if not math.isfinite(angle_deg):
        raise argparse.ArgumentTypeError(f"{text!r} is not an angle")
    # Without the sign of a negative zero, which would be written down and shown.
    return angle_deg + 0.0


def share(text: str) -> float:
    """Return a share, from 0 to 1."""
    value = amount(text)
    if value > 1:
        raise argparse.ArgumentTypeError(f"{text} is more than 1, the whole")
    return value


def amount(text: str) -> float:
    """Return a number from 0 on."""
    value = _number(text)
    if not (math.isfinite(value) and value >= 0):
        raise argparse.ArgumentTypeError(f"{text} is not a number from 0 on")
    return value


def length(text: str) -> float:
    """Return a positive length in µm."""
    length_um = _number(text)
    if not (math.isfinite(length_um) and length_um > 0):
        raise argparse.ArgumentTypeError(f"{text} µm is no length")
    return length_um


def at_least(least: int) -> Callable[[str], int]:
    """Return what reads a whole number that is not less than the least one."""

    def whole_number(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if number < least:
            raise argparse.ArgumentTypeError(f"{number} is less than {least}")
        return number

    return whole_number


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
