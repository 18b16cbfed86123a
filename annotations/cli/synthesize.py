"""``annotations synthesize``: a study of synthetic volumes."""

import argparse
from collections.abc import Callable
from typing import Any, NoReturn

from pydantic import ValidationError

from annotations.app_folders import tool_folder
from annotations.cli.output import remark, show_progress, write_json, write_text
from annotations.documents.study import annotation_path
from annotations.geometry.tool import ToolError
from annotations.geometry.tool_library import find_tool
from annotations.synthesis import (
    FULL_SHAPE,
    PLAIN_CONDITIONS,
    REALTIME_SHAPE,
    TRAINING_CONDITIONS,
    SceneConditions,
    write_study,
)
from annotations.synthesis.mesh_tool import UM_PER_MM, read_mesh_tool
from annotations.synthesis.synthetic_study import mask_path
from annotations.synthesis.truth import ANNOTATOR

_FIXED = ("clutter", "noise_sigma_grey", "looks")
"""The conditions that an option of that name gives one value."""


def run(arguments: argparse.Namespace) -> int:
    """Make the study; return the exit code."""
    try:
        tool = find_tool(arguments.tool, (tool_folder(),))
    except ToolError as error:
        arguments.misuse(f"argument --tool: {error}")
    shape = REALTIME_SHAPE if arguments.realtime else tuple(arguments.shape or FULL_SHAPE)
    conditions = _conditions(arguments)
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
        truth_methods=("keypoints", "boxes"),
        conditions=conditions,
        mesh=mesh,
        masks=arguments.masks,
        progress=show_progress,
    )
    for mended, repairs in mesh.repairs.items() if mesh else ():
        remark(f"{mended}: mended: {'; '.join(repairs)}")
    for volume in study.volumes:
        path = arguments.folder / volume.path
        truth, boxes = (
            annotation_path(arguments.folder, ANNOTATOR, volume.id, method)
            for method in ("keypoints", "boxes")
        )
        mask = mask_path(arguments.folder, volume.id) if arguments.masks else None
        if arguments.json:
            made = {"path": str(path), "annotation": str(truth), "boxes": str(boxes), "shape": shape}
            write_json(made if mask is None else made | {"mask": str(mask)})
        else:
            lines = [str(path), f"  truth  {truth}", f"  boxes  {boxes}"]
            write_text("\n".join(lines if mask is None else [*lines, f"  mask   {mask}"]))
    return 0


def _conditions(arguments: argparse.Namespace) -> SceneConditions:
    """Return what may vary: all as for training, or nothing, and then what was asked for one by one."""
    misuse: Callable[[str], NoReturn] = arguments.misuse
    conditions = TRAINING_CONDITIONS if arguments.varied else PLAIN_CONDITIONS
    asked: dict[str, Any] = {}
    if arguments.out_of_view is not None:
        asked["out_of_view_probability"], asked["largest_out_of_view_share"] = arguments.out_of_view
    for name in _FIXED:
        if (value := getattr(arguments, name)) is not None:
            asked[name] = (value, value)
    try:
        return SceneConditions.model_validate(conditions.model_dump() | asked)
    except ValidationError as error:
        found = error.errors()[0]
        misuse(f"argument --{str(found['loc'][0]).replace('_', '-')}: {found['msg']}")
