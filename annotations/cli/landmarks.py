"""``annotations landmarks``: how far landmarks of several people and sessions are from their mean point."""

import argparse
from dataclasses import asdict

from annotations.cli.output import write_json, write_text
from annotations.interchange.landmark_sets import (
    FILE_PATTERN,
    DistanceFigure,
    distance_figure,
    fcsv_files,
    read_landmark_sets,
    session_distances,
)


def run(arguments: argparse.Namespace) -> int:
    """Read the files and report; return the exit code."""
    paths = fcsv_files(arguments.places)
    sets = read_landmark_sets(paths, pattern=arguments.pattern or FILE_PATTERN)
    distance_mm = session_distances(sets, arguments.tutorial)
    overall = distance_figure(distance_mm)
    per_landmark = {name: distance_figure(distance_mm[:, :, k]) for k, name in enumerate(sets.landmarks)}
    per_rater = {name: distance_figure(distance_mm[r]) for r, name in enumerate(sets.raters)}
    if arguments.json:
        write_json(
            {
                "files": len(paths),
                "sessions": sets.sessions,
                "tutorial": arguments.tutorial,
                "overall": asdict(overall),
                "landmarks": {name: asdict(figure) for name, figure in per_landmark.items()},
                "raters": {name: asdict(figure) for name, figure in per_rater.items()},
                "remarks": sets.remarks,
            }
        )
        return 0
    tutorial = (
        f"\nSession {arguments.tutorial} counts in the mean points, not in the figures"
        if arguments.tutorial is not None
        else ""
    )
    write_text(
        f"{len(paths)} files: {len(sets.raters)} raters, {len(sets.sessions)} sessions, "
        f"{len(sets.landmarks)} landmarks{tutorial}\n"
        f"Distance to the mean point (mm){'mean':>9}{'sd':>7}{'largest':>9}{'n':>6}"
    )
    for kind, figures in (("landmark", per_landmark), ("rater", per_rater), ("", {"overall": overall})):
        for name, figure in figures.items():
            write_text(_line(f"{kind} {name}".strip(), figure))
    if sets.remarks:
        write_text("\n".join(["Labels", *(f"  {remark}" for remark in sets.remarks)]))
    return 0


def _line(name: str, figure: DistanceFigure) -> str:
    mean, sd, largest = (
        "–" if value is None else f"{value:.2f}"
        for value in (figure.mean_mm, figure.sd_mm, figure.largest_mm)
    )
    return f"  {name:<29}{mean:>9}{sd:>7}{largest:>9}{figure.n:>6}"
