"""``annotations synthesize``: a study of synthetic volumes."""

import argparse

from annotations.app_folders import tool_folder
from annotations.cli.output import show_progress, write_json, write_text
from annotations.documents.study import annotation_path
from annotations.geometry.tool import ToolError
from annotations.geometry.tool_library import find_tool
from annotations.synthesis import FULL_SHAPE, write_study
from annotations.synthesis.truth import ANNOTATOR


def run(arguments: argparse.Namespace) -> int:
    """Make the study; return the exit code."""
    try:
        tool = find_tool(arguments.tool, (tool_folder(),))
    except ToolError as error:
        arguments.misuse(f"argument --tool: {error}")
    shape = tuple(arguments.shape) if arguments.shape else FULL_SHAPE
    study = write_study(
        arguments.folder,
        tool,
        count=arguments.count,
        seed=arguments.seed,
        shape=shape,
        progress=show_progress,
    )
    for volume in study.volumes:
        path = arguments.folder / volume.path
        truth = annotation_path(arguments.folder, ANNOTATOR, volume.id, "keypoints")
        if arguments.json:
            write_json({"path": str(path), "annotation": str(truth), "shape": shape})
        else:
            write_text(f"{path}\n  truth  {truth}")
    return 0
