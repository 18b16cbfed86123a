"""Measures the real application on a full-size volume: ``python -m tests.bench [VOLUME.npy]``.

Without a volume, one of 1096 × 1936 × 1152 voxels (2.4 GB) is synthesised the first time, and kept. Without a
display an Xvfb is started. Every frame is waited for; each step has a process of its own. With ``--peer``
another program's benchmark of the same work runs in turn with this one, and ratios are printed. Judges
nothing. The figures are explained in docs/performance.md.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from annotations.app_folders import cache_folder
from tests.bench.display import display
from tests.bench.peer import COMPARISONS, run_peer
from tests.bench.ratios import Comparison, ratios
from tests.bench.starting import measure_start
from tests.bench.steps import Request, run_step
from tests.bench.table import page, write_page
from tests.bench.volumes import PARTS, full_volume, part, placed

PARTS_OF_ALL = ("start", "window", "cold", "watch", "edits", "sizes", "studies")
STUDIES = (10, 100, 1000)
_COLD_TIMES = 3
_COMPARED_VOLUMES = 100
_GROWTH_TIMES = 7
_GROWTH_ROUNDS = {
    "rounds": ("empty", "empty, × 4"),
    "rounds_of_single_pages": ("empty, single pages", "empty, × 4, single pages"),
}
_GROWTH = tuple(
    Comparison(f"open to {name.replace('_', ' ')}", f"open_to_{name}_ms", f"open_to_{name}_ms")
    for name in ("first_slice", "first_3d_frame", "finest_level", "rest")
)


class Benchmark:
    """Runs the steps that are asked for, and gathers what they measure.

    Attributes
    ----------
    results : dict
        By step.
    own, peers : list
        The figures of each round.
    growth : dict
        Of opening an empty volume, and one four times as large: the two names, and what each round took.
    failed : list of str
        The steps that ended with an error.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._volume: Path = options.volume
        self.results: dict[str, Any] = {}
        self.own: list[dict[str, Any]] = []
        self.peers: list[dict[str, Any]] = []
        self.growth: dict[tuple[str, str], list[tuple[dict[str, Any], dict[str, Any]]]] = {}
        self.failed: list[str] = []
        self._starts: dict[str, Any] = {}
        self._temporary = tempfile.TemporaryDirectory(prefix="oct-annotator-bench-")
        self._home = Path(self._temporary.name) / "home"
        self._link = placed(self._volume, Path(self._temporary.name) / "volume")

    def run(self) -> None:
        """Run everything that was asked for."""
        only, options = self._options.only, self._options
        self._home.mkdir()
        if "start" in only:
            # Python's and the fonts' caches are there when a person starts it again.
            measure_start(self._home, None)
        for number in range(options.rounds):
            if "start" in only or "window" in only:
                _say(f"round {number + 1} of {options.rounds}: ours")
                self.own.append(self._round())
            if options.peer is not None:
                _say(f"round {number + 1} of {options.rounds}: the peer's")
                self.peers.append(run_peer(options.peer, self._volume))
        if self.own:
            self.results |= {"rounds": self.own, "figures": medians(self.own)}
        watches = dict(self._starts)
        if self.peers:
            self.results["peer"] = self.peers
        for step, times, count in (
            ("cold", _COLD_TIMES, 0),
            ("watch", 1, _COMPARED_VOLUMES),
            ("edits", 1, options.edits),
        ):
            if step in only:
                self.results[step] = self._step(step, times=times, count=count)
        if "sizes" in only:
            self.results["sizes"] = self._sizes()
        if "studies" in only:
            self.results["studies"] = {f"{n:,}": self._step("study", count=n) for n in STUDIES}
        for result in (self.results.get("watch", {}), *self.results.get("studies", {}).values()):
            watches |= result.get("watches", {})
        if watches:
            self.results["watches"] = watches
        self._temporary.cleanup()

    def _round(self) -> dict[str, Any]:
        figures: dict[str, Any] = {}
        if "start" in self._options.only:
            for name, path in (("start", None), ("start_with_volume", self._link)):
                found, watch = measure_start(self._home, path)
                figures |= found
                self._starts[name] = watch
        if "window" in self._options.only:
            figures |= self._step("window", times=self._options.times)
        return figures

    def _sizes(self) -> dict[str, Any]:
        folder, found = self._options.folder, {}
        for name in PARTS:
            _say(f"{name} of the volume")
            request = Request("window", part(self._volume, folder, name), max(4, self._options.times // 4))
            found[name] = self._run(request)
        grown = self._step("growth", times=_GROWTH_TIMES)
        self.growth = {names: grown[rounds] for rounds, names in _GROWTH_ROUNDS.items() if rounds in grown}
        for names, rounds in self.growth.items():
            found |= {
                name: medians(each) for name, each in zip(names, zip(*rounds, strict=True), strict=True)
            }
        return found

    def _step(self, step: str, *, times: int = 1, count: int = 0) -> dict[str, Any]:
        return self._run(Request(step, self._volume, times, count))

    def _run(self, request: Request) -> dict[str, Any]:
        """Run a step; one that fails is told, and the others go on."""
        _say(f"{request.step} {request.count or ''}")
        try:
            return run_step(request, self._home)
        except RuntimeError as error:
            _say(str(error))
            self.failed.append(request.step)
            return {}


def medians(rounds: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Return the median over the rounds of each figure that is a number."""
    names = dict.fromkeys(name for each in rounds for name in each)
    found = {}
    for name in names:
        values = [each[name] for each in rounds if isinstance(each.get(name), int | float)]
        if values:
            found[name] = statistics.median(values)
    return found


def machine(volume: Path, own: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what the figures were taken on."""
    return {
        "date": f"{datetime.now().astimezone():%Y-%m-%d}",
        "commit": _commit(),
        "cores": os.cpu_count(),
        "processor": _processor(),
        "renderer": next((each["renderer"] for each in own if "renderer" in each), "renderer not asked"),
        "shape": list(np.load(volume, mmap_mode="r").shape),
    }


def main() -> int:
    """Measure, and print tables; 1 if a step failed."""
    options = _parser().parse_args()
    with display():
        options.volume = options.volume or full_volume(options.folder)
        benchmark = Benchmark(options)
        benchmark.run()
    found = ratios(COMPARISONS, benchmark.own, benchmark.peers) if benchmark.own and benchmark.peers else []
    grown = {
        names: ratios(_GROWTH, [larger for _, larger in rounds], [empty for empty, _ in rounds])
        for names, rounds in benchmark.growth.items()
    }
    results = {"machine": machine(options.volume, benchmark.own), **benchmark.results}
    text = page(results, found, grown)
    sys.stdout.write(text)
    if options.json is not None:
        results["ratios"] = [asdict(ratio) for ratio in found]
        results["growth"] = {larger: [asdict(ratio) for ratio in each] for (_, larger), each in grown.items()}
        options.json.write_text(json.dumps(results, indent=1) + "\n")
    if options.markdown is not None:
        write_page(options.markdown, text)
    return int(bool(benchmark.failed))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=__doc__)
    parser.add_argument("volume", nargs="?", type=Path, help="a full-size .npy volume")
    parser.add_argument(
        "--folder",
        type=Path,
        default=cache_folder() / "bench",
        help="where the full volume and parts of it are made, and kept (%(default)s)",
    )
    parser.add_argument(
        "--only",
        nargs="+",
        choices=PARTS_OF_ALL,
        default=PARTS_OF_ALL,
        help="measure these alone; start and window are what the peer's are compared with",
    )
    parser.add_argument("--rounds", type=int, default=3, help="of start and window (%(default)s)")
    parser.add_argument("--times", type=int, default=20, help="of each figure in a round (%(default)s)")
    parser.add_argument("--edits", type=int, default=10_000, help="how many (%(default)s)")
    parser.add_argument("--peer", metavar="COMMAND", help="runs in turn with ours, on the same volume")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    parser.add_argument(
        "--markdown", type=Path, metavar="FILE", help="write the tables, in the middle of a page"
    )
    return parser


def _commit() -> str:
    command = ["git", "describe", "--always", "--dirty"]
    found = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parent)
    return found.stdout.strip() or "unknown"


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _say(text: str) -> None:
    sys.stderr.write(f"{text.strip()}\n")


if __name__ == "__main__":
    sys.exit(main())
