"""``annotations convert``: a document of one method as a new document of the other."""

import argparse
from pathlib import Path

from annotations.cli.documents import load_with_tool
from annotations.cli.output import complain, for_each, write_json, write_text
from annotations.documents.annotation import Annotation
from annotations.documents.conversion import keypoints_without_box, sibling_path, to_boxes, to_keypoints
from annotations.documents.files import save_annotation
from annotations.errors import UserError
from annotations.geometry.box_conversion import RollUnknown, roll_evidence
from annotations.geometry.tool import ToolSpecification


def run(arguments: argparse.Namespace) -> int:
    """Convert the file; return the exit code."""
    if arguments.roll_deg is not None and arguments.to == "keypoints":
        arguments.misuse("argument --roll-deg: boxes have their roll; it is for --to boxes")

    def convert(path: Path) -> None:
        # Before the work, so that the message is about the file and not about a roll.
        if arguments.output.is_dir():
            name = sibling_path(path, arguments.to).name
            raise UserError(
                "it is a folder, and the new annotation is a file",
                where=arguments.output,
                remedy=f"Give the file's name too: -o {arguments.output / name}",
            )
        if arguments.output.exists():
            raise UserError(
                "there is a file already, and it is not overwritten",
                where=arguments.output,
                remedy="Choose another name for -o",
            )
        document, tool = load_with_tool(path)
        if arguments.to == "keypoints":
            derived = to_keypoints(document, tool, original=path, derived=arguments.output)
        else:
            derived = _boxes(path, document, tool, arguments)
        derived, _ = save_annotation(derived, arguments.output, expected="")
        placed = [part.name for part in derived.parts if part.state != "unplaced"]
        if arguments.json:
            write_json(
                {
                    "path": str(arguments.output),
                    "original": str(path),
                    "method": derived.method,
                    "placed": placed,
                    "roll_deg": arguments.roll_deg,
                }
            )
        else:
            write_text(f"{arguments.output}\n  {derived.method:<11}  {', '.join(placed)}")

    return for_each([arguments.file], arguments.json, convert)


def _boxes(
    path: Path, document: Annotation, tool: ToolSpecification, arguments: argparse.Namespace
) -> Annotation:
    try:
        derived = to_boxes(
            document,
            tool,
            original=path,
            derived=arguments.output,
            roll_deg=arguments.roll_deg,
        )
    except RollUnknown as error:
        options = " or ".join(f"--roll-deg {roll:z.1f}" for roll in error.candidates_deg)
        remedy = f"Say which: {options}" if options else "Say it: --roll-deg R"
        raise UserError(error.problem, where=path, remedy=remedy) from error
    for evidence in roll_evidence(document.positions_um, tool):
        off_deg = None if arguments.roll_deg is None else evidence.contradiction_deg(arguments.roll_deg)
        if off_deg is not None:
            shown = " or ".join(f"{roll:z.1f}°" for roll in evidence.candidates_deg)
            complain(
                UserError(
                    f"the bend shows a roll of {shown} for {evidence.link}, and the roll that was given is "
                    f"{off_deg:.1f}° off; it was taken as given",
                    where=path,
                )
            )
    left_out = keypoints_without_box(document, derived, tool)
    if left_out:
        complain(
            UserError(
                f"no box ends at {', '.join(left_out)}: the other end of the link is missing", where=path
            )
        )
    return derived
