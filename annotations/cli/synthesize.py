"""``annotations synthesize``: a study of synthetic volumes."""

import argparse

from annotations.app_folders import tool_folder
from annotations.cli.output import remark, show_progress, write_json, write_text
from annotations.documents.study import annotation_path
from annotations.geometry.tool import ToolError
from annotations.geometry.tool_library import find_tool
from annotations.synthesis import FULL_SHAPE, write_study
from annotations.synthesis.mesh_tool import UM_PER_MM, read_mesh_tool
from annotations.synthesis.truth import ANNOTATOR


def run(arguments: argparse.Namespace) -> int:
    """Make the study; return the exit code."""
    try:
        tool = find_tool(arguments.tool, (tool_folder(),))
    except ToolError as error:
        arguments.misuse(f"argument --tool: {error}")
    shape = tuple(arguments.shape) if arguments.shape else FULL_SHAPE
    if arguments.mesh_unit_um is not None and arguments.meshes is None:
        arguments.misuse("argument --mesh-unit-um: it is of use with --meshes alone")
    mesh = None
    if arguments.meshes is not None:
        mesh = read_mesh_tool(tool, arguments.meshes, arguments.mesh_unit_um or UM_PER_MM)
    study = write_study(
        arguments.folder,
        tool,
        count=arguments.count,
        seed=arguments.seed,
        shape=shape,
        mesh=mesh,
        progress=show_progress,
    )
    for mended, repairs in mesh.repairs.items() if mesh else ():
        remark(f"{mended}: mended: {'; '.join(repairs)}")
    for volume in study.volumes:
        path = arguments.folder / volume.path
        truth = annotation_path(arguments.folder, ANNOTATOR, volume.id, "keypoints")
        if arguments.json:
            write_json({"path": str(path), "annotation": str(truth), "shape": shape})
        else:
            write_text(f"{path}\n  truth  {truth}")
    return 0
