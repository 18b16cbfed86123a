"""``annotations targets``: pose targets from annotation files alone."""

import argparse
from pathlib import Path
from typing import Any

from annotations.cli.documents import load_with_tool
from annotations.cli.output import for_each, write_json, write_text
from annotations.documents.annotation import Annotation
from annotations.documents.representations import document_targets
from annotations.geometry.frames import Vector
from annotations.geometry.targets import PoseTargets
from annotations.geometry.tool import ToolSpecification


def run(arguments: argparse.Namespace) -> int:
    """Compute the targets of each file; return the exit code."""

    def report(path: Path) -> None:
        annotation, tool = load_with_tool(path)
        targets = document_targets(annotation, tool)
        if arguments.json:
            write_json(_fields(path, annotation, tool, targets))
        else:
            write_text(_in_words(path, annotation, tool, targets))

    return for_each(arguments.files, arguments.json, report)


def _fields(
    path: Path, annotation: Annotation, tool: ToolSpecification, targets: PoseTargets
) -> dict[str, Any]:
    """Return the targets that the tool has, ``None`` for those whose keypoints have no position.

    A signed angle is there only where a box gives the hinge. Each keypoint or box stands with its state,
    certainty and source, so that what was filled in from a fit does not pass for what somebody saw.
    """
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
        if angle.name in targets.signed_angles_deg:
            fields[f"{angle.name}_signed_deg"] = targets.signed_angles_deg[angle.name]
    fields[annotation.method] = {
        part.name: {"state": part.state, "certainty": part.certainty, "source": part.source}
        for part in annotation.parts
    }
    return fields


def _in_words(path: Path, annotation: Annotation, tool: ToolSpecification, targets: PoseTargets) -> str:
    unknown = f"unknown: its {annotation.method} are not all placed"
    lines = [str(path)]
    if tool.targets.position:
        position_um = targets.position_um
        lines.append(f"  position     {_numbers(position_um, '.1f') + ' µm' if position_um else unknown}")
    if tool.targets.orientation:
        orientation = targets.orientation
        lines.append(f"  orientation  {_numbers(orientation, '.4f') if orientation else unknown}")
    for angle in tool.targets.angles:
        value = targets.angles_deg.get(angle.name)
        signed = targets.signed_angles_deg.get(angle.name)
        words = unknown if value is None else f"{value:.2f}°"
        lines.append(f"  {angle.name:<11}  {words}" + ("" if signed is None else f", signed {signed:+z.2f}°"))
    unseen = [
        f"{part.name} ({part.state.replace('_', ' ')}{', fitted' if part.source == 'fitted' else ''})"
        for part in annotation.parts
        if part.state in ("occluded", "out_of_view")
    ]
    if unseen:
        lines.append(f"  not seen     {', '.join(unseen)}")
    return "\n".join(lines)


def _numbers(values: Vector, form: str) -> str:
    return ", ".join(f"{value:z{form}}" for value in values)
