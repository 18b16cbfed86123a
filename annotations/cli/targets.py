"""``annotations targets``: pose targets from annotation files alone."""

import argparse
from pathlib import Path
from typing import Any

from annotations.cli.output import for_each, write_json, write_text
from annotations.cli.tool_folders import tool_folders
from annotations.documents.annotation import Annotation
from annotations.documents.files import completed, load_annotation, tool_of
from annotations.errors import UserError
from annotations.geometry.targets import PoseTargets, pose_targets
from annotations.geometry.tool import ToolSpecification


def run(arguments: argparse.Namespace) -> int:
    """Compute the targets of each file; return the exit code."""

    def report(path: Path) -> None:
        annotation, tool = _load(path)
        targets = pose_targets(annotation.positions_um, tool)
        if arguments.json:
            write_json(_fields(path, annotation, tool, targets))
        else:
            write_text(_in_words(path, tool, targets))

    return for_each(arguments.files, arguments.json, report)


def _load(path: Path) -> tuple[Annotation, ToolSpecification]:
    annotation, _ = load_annotation(path)
    try:
        tool = tool_of(annotation, tool_folders(path))
        return completed(annotation, tool), tool
    except UserError as error:
        # These speak of the tool; which of many files names it is known here.
        raise UserError(str(error).removesuffix("."), where=path) from error


def _fields(
    path: Path, annotation: Annotation, tool: ToolSpecification, targets: PoseTargets
) -> dict[str, Any]:
    """Return the targets that the tool has, ``None`` for those whose keypoints have no position."""
    fields: dict[str, Any] = {
        "path": str(path),
        "volume": annotation.volume.path,
        "tool": annotation.tool,
        "annotator": annotation.annotator,
        "method": annotation.method,
        "status": annotation.status,
    }
    if tool.targets.position:
        fields["position_um"] = targets.position_um
    if tool.targets.orientation:
        fields["orientation"] = targets.orientation
    for angle in tool.targets.angles:
        fields[f"{angle.name}_deg"] = targets.angles_deg.get(angle.name)
    return fields


def _in_words(path: Path, tool: ToolSpecification, targets: PoseTargets) -> str:
    lines = [str(path)]
    if tool.targets.position:
        lines.append(f"  position     {_numbers(targets.position_um, '.1f', ' µm')}")
    if tool.targets.orientation:
        lines.append(f"  orientation  {_numbers(targets.orientation, '.4f', '')}")
    for angle in tool.targets.angles:
        value = targets.angles_deg.get(angle.name)
        lines.append(f"  {angle.name:<11}  {_numbers(None if value is None else (value,), '.2f', '°')}")
    return "\n".join(lines)


def _numbers(values: tuple[float, ...] | None, form: str, unit: str) -> str:
    if values is None:
        return "unknown: its keypoints are not all placed"
    return ", ".join(f"{value:{form}}" for value in values) + unit
