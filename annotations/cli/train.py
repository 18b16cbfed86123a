"""``annotations train``: a checkpoint from synthetic volumes and annotated ones."""

import argparse
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from annotations.app_folders import tool_folder
from annotations.cli.arguments import USUAL_TOOL
from annotations.cli.learning_extra import require_torch
from annotations.cli.output import write_text
from annotations.cli.stopping import STOPPED, say, stopping
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotations.learning.settings.training_settings import TrainingSettings, read_settings

if TYPE_CHECKING:
    from annotations.learning.examples.annotated_examples import FoundStudy


def run(arguments: argparse.Namespace) -> int:
    """Train; return the exit code: 130 where a person stopped it, and it can go on."""
    settings = read_settings(arguments.config) if arguments.config else TrainingSettings()
    if arguments.threads is not None:
        settings = settings.model_copy(update={"threads": arguments.threads})
    if arguments.origin is not None and arguments.studies:
        settings = settings.going_on()
    if arguments.print_config:
        write_text(settings.as_toml().rstrip())
        return 0
    if arguments.output is None:
        arguments.misuse("the following arguments are required: -o/--output")
    require_torch()
    import torch

    from annotations.learning.examples.annotated_examples import annotated_examples, find_studies
    from annotations.learning.examples.examples import AnnotatedExamples
    from annotations.learning.training.checkpoint_training import train_checkpoint
    from annotations.learning.training.origin import read_origin
    from annotations.learning.training.stages import learned_fingerprints

    torch.set_num_threads(settings.threads or os.cpu_count() or 1)
    studies = find_studies(arguments.studies)
    tool = _tool(arguments.tool, studies)
    origin = None if arguments.origin is None else read_origin(arguments.origin)
    if origin is not None:
        # Before the volumes are read.
        origin.check(settings, tool)
    learned = frozenset() if origin is None else learned_fingerprints(origin.description.training)
    with stopping() as stopped:
        try:
            annotated = (
                annotated_examples(studies, settings.sampling, settings.annotated, say, stopped, learned)
                if studies
                else AnnotatedExamples()
            )
            checkpoint = train_checkpoint(
                settings,
                tool,
                annotated,
                arguments.output,
                say=say,
                stopped=stopped,
                restart=arguments.restart,
                origin=origin,
            )
        except Cancelled:
            checkpoint = None
    if checkpoint is None:
        say("stopped; the same command goes on from here")
        return STOPPED
    write_text(str(checkpoint.path))
    return 0


def _tool(name: str | None, studies: Sequence["FoundStudy"]) -> ToolSpecification:
    if not studies:
        return find_tool(name or USUAL_TOOL, (tool_folder(),))
    tool = studies[0].tool
    if name not in (None, tool.name):
        raise UserError(
            f"the study is of the tool {tool.name!r}, not of {name!r}",
            where=studies[0].folder,
            remedy="Leave --tool out, or name other studies",
        )
    return tool
