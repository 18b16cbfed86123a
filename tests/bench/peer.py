"""The peer's figures for the same work, and ours as a ratio to them."""

import json
import shlex
import statistics
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Comparison:
    """One row that is compared.

    Attributes
    ----------
    name : str
    ours, peers : str
        The figures' names.
    at_most : float
        What the ratio is to be at most.
    aim : float or None
        What it might be.
    """

    name: str
    ours: str
    peers: str
    at_most: float
    aim: float | None = None


COMPARISONS = (
    Comparison("edit to frame in the 3D scene", "edit_to_frame_ms", "edit_to_frame_ms", 0.10, 0.05),
    Comparison(
        "camera frame while dragging, finest level", "camera_moving_finest_ms", "camera_frame_ms", 0.15, 0.10
    ),
    Comparison(
        "camera frame while dragging, same data", "camera_moving_same_data_ms", "camera_frame_ms", 0.15, 0.10
    ),
    Comparison("full frame at rest, same data", "camera_at_rest_same_data_ms", "camera_frame_ms", 0.5),
    Comparison("open to first 3D frame", "open_to_first_3d_frame_ms", "open_to_first_3d_frame_ms", 0.5),
    Comparison("open to first slice", "open_to_first_slice_ms", "open_to_first_slice_ms", 0.2),
    *(
        Comparison(f"scrolling across axis {axis}", f"slice_axis{axis}_sharp_ms", f"slice_axis{axis}_ms", 0.4)
        for axis in range(3)
    ),
    Comparison("anonymous memory", "anonymous_mib", "anonymous_mib", 1.5),
    Comparison("process start to usable window", "start_to_window_ms", "start_ms", 1.0),
)


@dataclass(frozen=True)
class Ratio:
    """A comparison's outcome over some rounds.

    Attributes
    ----------
    ours, peers : float
        Medians.
    lowest, median, highest : float
        Of our figure over the peer's of the same round.
    """

    comparison: Comparison
    ours: float
    peers: float
    lowest: float
    median: float
    highest: float

    @property
    def reached(self) -> str:
        """Whether it is no more than what was asked for: in every round, in the median, or not."""
        at_most = self.comparison.at_most
        return "yes" if self.highest <= at_most else "in the median" if self.median <= at_most else "no"


def run_peer(command: str, volume: Path) -> dict[str, object]:
    """Run the peer's benchmark on a volume, and return its figures: its last line, which is JSON.

    Raises
    ------
    RuntimeError
        It failed; it has said on standard error why.
    """
    done = subprocess.run(
        [*shlex.split(command), str(volume)], stdout=subprocess.PIPE, text=True, check=False
    )
    if done.returncode or not done.stdout.strip():
        raise RuntimeError(f"the peer ended with {done.returncode}")
    return dict(json.loads(done.stdout.splitlines()[-1]))


def ratios(ours: Sequence[Mapping[str, object]], peers: Sequence[Mapping[str, object]]) -> list[Ratio]:
    """Return each comparison of which both have a figure; the rounds come in pairs."""
    found = []
    for comparison in COMPARISONS:
        pairs = [
            (float(str(own[comparison.ours])), float(str(other[comparison.peers])))
            for own, other in zip(ours, peers, strict=True)
            if comparison.ours in own and comparison.peers in other
        ]
        if pairs:
            quotients = [own / other for own, other in pairs]
            found.append(
                Ratio(
                    comparison,
                    ours=statistics.median(own for own, _ in pairs),
                    peers=statistics.median(other for _, other in pairs),
                    lowest=min(quotients),
                    median=statistics.median(quotients),
                    highest=max(quotients),
                )
            )
    return found
