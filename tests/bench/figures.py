"""Figures of a benchmark: how they are taken, and how those of one are printed."""

import json
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

Figures = dict[str, float]


def milliseconds(work: Callable[[], object]) -> float:
    """Return how long a call takes."""
    begun_s = time.perf_counter()
    work()
    return 1000 * (time.perf_counter() - begun_s)


def anonymous_mib() -> float:
    """Return the memory of this process that no file backs, MiB (Linux only, else NaN).

    A volume that is mapped into memory does not count: the system takes its pages back when it needs them.
    """
    return _of_process("status", "RssAnon")


def peak_mib() -> float:
    """Return the most memory that this process has had so far, pages of mapped files with it, MiB (Linux)."""
    return _of_process("status", "VmHWM")


def large_pieces_mib() -> float:
    """Return how much of mapped files lies in memory in pieces of 2 MiB, mapped at once, in MiB (Linux)."""
    return _of_process("smaps_rollup", "FilePmdMapped")


def print_figures(figures: Mapping[str, object]) -> None:
    """Print a table on standard error, and one JSON object on standard output."""
    for name, value in figures.items():
        shown = f"{value:10.2f}" if isinstance(value, float) else str(value)
        sys.stderr.write(f"{name:<36}{shown}\n")
    sys.stdout.write(json.dumps(figures) + "\n")
    sys.stdout.flush()


def _of_process(table: str, field: str) -> float:
    path = Path("/proc/self") / table
    if not path.exists():
        return float("nan")
    line = next(line for line in path.read_text().splitlines() if line.startswith(field))
    return int(line.split()[1]) / 1024
