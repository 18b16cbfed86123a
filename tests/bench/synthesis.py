"""Times synthetic volumes at network resolution: ``python -m tests.bench.synthesis``.

Random scenes are drawn and seen as for training, by one process and by two at once. The baseline is to make
planes of a full-size volume of the same scenes and to sample them, which costs the same for every plane: a
few are timed. Prints a table on standard error and one JSON object on standard output; judges nothing.
"""

import argparse
import os
import statistics
import time
from multiprocessing import get_context

from tests.bench.figures import print_figures

# Each process has a core of its own.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

FIRST_TIMED = 1000


def make(first: int, count: int, plain: bool) -> float:
    """Make volumes at network resolution; return the seconds taken."""
    from annotations.geometry.tool_library import find_tool
    from annotations.synthesis import (
        PLAIN_CONDITIONS,
        TRAINING_CONDITIONS,
        SceneSeed,
        network_volume,
        random_scene,
    )
    from annotations.volumes.sampling import OMES_SAMPLING

    tool = find_tool("magnetic-forceps")
    conditions = PLAIN_CONDITIONS if plain else TRAINING_CONDITIONS
    begun = time.perf_counter()
    for number in range(first, first + count):
        network_volume(random_scene(tool, SceneSeed(1, number), conditions=conditions), OMES_SAMPLING)
    return time.perf_counter() - begun


def warm_then_make(first: int, count: int, plain: bool) -> float:
    """Make some volumes untimed, so that the distributions of noise are there, then others; the seconds."""
    make(0, count // 2, plain)
    return make(first, count, plain)


def plane_s() -> float:
    """Return the seconds that a plane of a full-size volume and its samples take."""
    import numpy as np

    from annotations.geometry.tool_library import find_tool
    from annotations.synthesis import SceneSeed, random_scene

    taken = []
    for number in range(5):
        scene = random_scene(find_tool("magnetic-forceps"), SceneSeed(1, number))
        middle = scene.grid.shape[0] // 2
        _ = scene.surface
        begun = time.perf_counter()
        np.add.reduceat(scene.plane(middle)[::14], np.arange(0, 1152, 14), axis=1, dtype=np.float32)
        taken.append(time.perf_counter() - begun)
    return statistics.median(taken)


def main() -> None:
    """Time one process, two, and the baseline."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300, help="volumes a process (%(default)s)")
    parser.add_argument("--plain", action="store_true", help="scenes in which the pose alone varies")
    options = parser.parse_args()
    figures: dict[str, float] = {}
    for processes in (1, 2):
        with get_context("spawn").Pool(processes) as pool:
            tasks = [
                (FIRST_TIMED * (1 + number), options.count, options.plain) for number in range(processes)
            ]
            taken_s = pool.starmap(warm_then_make, tasks, chunksize=1)
        figures[f"volumes_per_s_processes_{processes}"] = sum(options.count / seconds for seconds in taken_s)
    # What a network sees of a volume lies in 28 of its planes.
    figures["sampled_planes_s"] = 28 * plane_s()
    figures["times_faster_than_planes"] = figures["sampled_planes_s"] * figures["volumes_per_s_processes_1"]
    print_figures(figures)


if __name__ == "__main__":
    main()
