"""The command ``annotator``: opens the window, or draws it into a picture."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from annotations import __version__
from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotator.startup import toolkit
from annotator.startup.leaving import leave

_DEMO = "demo"
_SMALLEST_PX, _LARGEST_PX = 400, 16_000
_PICTURE_SIZE = (1600, 1000)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 0, or 1 if no picture could be made, or 2 for misuse or for want of a display."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.screenshot is not None and options.path is None:
        parser.error("--screenshot needs the PATH of what it should show")
    if options.annotator is not None and not options.annotator.strip():
        parser.error("--annotator needs a name")
    demo = options.path == _DEMO and not Path(_DEMO).exists()
    path = None if options.path is None or demo else Path(options.path)
    try:
        spacing_um = _spacing(options.spacing)
        toolkit.prepare(headless=options.screenshot is not None)
        if options.screenshot is None:
            from annotator.startup.start import run

            code = run(path, demo=demo, annotator=options.annotator, tool=options.tool, spacing_um=spacing_um)
        else:
            from annotator.startup.screenshot import take_screenshot

            code = take_screenshot(
                Path(options.screenshot),
                path,
                annotator=options.annotator,
                tool=options.tool,
                spacing_um=spacing_um,
                size=(options.size[0], options.size[1]),
            )
    except UserError as error:
        return _refused(error)
    except ImportError as error:
        if ".so" not in str(error):
            raise
        return _refused(toolkit.explain_import_error(error))
    return leave(code)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="annotator",
        description="Place keypoints and boxes of a surgical tool in OCT volumes, in 3D and in slices.",
        epilog="'annotations --help' lists the jobs that need no window.",
    )
    parser.add_argument(
        "path",
        nargs="?",
        metavar="PATH",
        help="a volume, an annotation, a study, a folder of volumes, a checkpoint, or 'demo' for the demo "
        "study",
    )
    parser.add_argument(
        "--screenshot", metavar="OUT.png", help="draw the window into a picture, without a display, and leave"
    )
    parser.add_argument(
        "--size",
        nargs=2,
        type=_pixels,
        default=_PICTURE_SIZE,
        metavar=("W", "H"),
        help=f"of the picture, in pixels ({_PICTURE_SIZE[0]} {_PICTURE_SIZE[1]})",
    )
    parser.add_argument(
        "--spacing",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        help="distance between voxels in µm, for volumes on which no annotation was begun yet",
    )
    parser.add_argument("--annotator", metavar="NAME", help="who annotates, for this time only")
    parser.add_argument(
        "--tool", metavar="NAME", help="the instrument for new annotations, for this time only"
    )
    parser.add_argument("--version", action="version", version=f"annotator {__version__}")
    return parser


def _pixels(text: str) -> int:
    number = int(text)
    if not _SMALLEST_PX <= number <= _LARGEST_PX:
        raise argparse.ArgumentTypeError(f"{number} is not between {_SMALLEST_PX} and {_LARGEST_PX}")
    return number


def _spacing(values: Sequence[float] | None) -> Vector | None:
    if values is None:
        return None
    from annotations.volumes import validate_spacing_um

    return validate_spacing_um(values, where="--spacing")


def _refused(error: UserError) -> int:
    sys.stderr.write(f"annotator: {error}\n")
    return 2


if __name__ == "__main__":
    sys.exit(main())
