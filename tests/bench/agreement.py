"""Times the comparison of many annotators: ``python -m tests.bench.agreement``.

Writes a synthetic study of annotation files, without volumes, into a temporary folder; then collects and
compares them, as `annotations agreement` does. The baseline is to read the same files and parse their JSON,
which nothing that reads them can go below. Each step has a process of its own, so that its peak of memory is
its own. Prints a table on standard error and one JSON object on standard output; judges nothing.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.bench.annotated_study import write_annotated_study
from tests.bench.figures import Figures, peak_mib, print_figures


def parse_only(folder: Path) -> Figures:
    """Read every file and parse its JSON."""
    with Timer("parse") as timer:
        for path in folder.glob("annotations/*/*.json"):
            json.loads(path.read_bytes())
    return timer.figures


def collect_and_compare(folder: Path) -> Figures:
    """Collect and compare, as the program does."""
    from annotations.agreement.collecting import collect
    from annotations.agreement.comparison import compare

    with Timer("collect") as collecting:
        material = collect(folder)
    with Timer("compare") as comparing:
        compare(material)
    return {
        "files": float(len(material.inputs)),
        "left_out": float(len(material.left_out)),
        **collecting.figures,
        **comparing.figures,
    }


class Timer:
    """Notes what is used within it: time, the processor's time, which other work does not add to, and memory.

    The memory is the largest that this process has held so far.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self.figures: Figures = {}

    def __enter__(self) -> "Timer":
        self._began_s = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_error: object) -> None:
        self.figures = {
            f"{self._name}_s": time.perf_counter() - self._began_s[0],
            f"{self._name}_cpu_s": time.process_time() - self._began_s[1],
            f"{self._name}_peak_mib": peak_mib(),
        }


STEPS = {"parse": parse_only, "compare": collect_and_compare}


def main() -> None:
    """Write, measure and print."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.agreement", description=__doc__)
    parser.add_argument("--annotators", type=int, default=20)
    parser.add_argument("--volumes", type=int, default=10_000)
    parser.add_argument("--method", choices=("keypoints", "boxes"), default="keypoints")
    parser.add_argument("--step", nargs=2, metavar=("STEP", "FOLDER"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.step:
        step, folder = options.step
        sys.stdout.write(json.dumps(STEPS[step](Path(folder))))
        return
    figures: Figures = {}
    with tempfile.TemporaryDirectory(prefix="oct-annotator-bench-") as name:
        began_s = time.perf_counter()
        people = [f"annotator{number:02}" for number in range(options.annotators)]
        write_annotated_study(Path(name), people, options.volumes, options.method)
        figures["write_s"] = time.perf_counter() - began_s
        for step in STEPS:
            command = [sys.executable, "-m", "tests.bench.agreement", "--step", step, name]
            figures |= json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    print_figures(figures)


if __name__ == "__main__":
    main()
