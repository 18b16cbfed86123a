"""``annotations experiment``: a published comparison of networks, repeated."""

import argparse
import os

from annotations.app_folders import tool_folder
from annotations.cli.arguments import USUAL_TOOL
from annotations.cli.learning_extra import require_torch
from annotations.cli.output import write_text
from annotations.cli.stopping import STOPPED, say, stopping
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool_library import find_tool
from annotations.learning.examples.annotated_examples import find_studies
from annotations.learning.experiments.experiments import EXPERIMENT_SIZES, experiment, resized
from annotations.learning.settings.training_settings import AnnotatedSettings

_FULL = "full"


def run(arguments: argparse.Namespace) -> int:
    """Train what is not done yet; return the exit code: 130 where a person stopped it, and it can go on."""
    if arguments.studies:
        for option, value in (("--volumes", arguments.volumes), ("--tool", arguments.tool)):
            if value is not None:
                arguments.misuse(f"{option} is for volumes that stand in: a study says that itself")
    require_torch()
    import torch

    from annotations.learning.experiments.experiment import experiment_data, run_experiment

    torch.set_num_threads(arguments.threads or os.cpu_count() or 1)
    studies = find_studies(arguments.studies)
    tool = studies[0].tool if studies else find_tool(arguments.tool or USUAL_TOOL, (tool_folder(),))
    size = resized(EXPERIMENT_SIZES[arguments.size], arguments.volumes, arguments.epochs)
    if arguments.size == _FULL and not torch.cuda.is_available():
        say("size 'full' without a graphics card takes weeks; --size small takes hours")
    comparison = experiment(
        arguments.name,
        size,
        arguments.seed,
        AnnotatedSettings(method=arguments.method, annotator=arguments.annotator),
    )
    try:
        with stopping() as stopped:
            data = experiment_data(studies, tool, comparison, size, say, stopped)
            if not data.examples.validation:
                raise UserError(
                    "no volume is left for validation",
                    remedy="Annotate more volumes: a fifth of them is held out",
                )
            written = run_experiment(comparison, size, data, tool, arguments.output, say, stopped)
    except Cancelled:
        written = None
    if written is None:
        say("stopped; the same command goes on from here")
        return STOPPED
    write_text("\n".join(map(str, written)))
    return 0
