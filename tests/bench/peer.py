"""The program beside which ours is measured, and what is compared with it."""

import json
import shlex
import subprocess
from pathlib import Path

from tests.bench.ratios import Comparison

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
