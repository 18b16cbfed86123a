"""An experiment: the trainings of a published comparison one after the other, and their tables."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from annotations.documents.record import now
from annotations.geometry.tool import ToolSpecification
from annotations.learning.architectures.networks import parameter_count
from annotations.learning.examples.annotated_examples import FoundStudy, annotated_examples
from annotations.learning.examples.examples import AnnotatedExamples
from annotations.learning.examples.synthetic_stream import SyntheticSeries
from annotations.learning.experiments.experiment_results import (
    DataDescription,
    RowResult,
    read_result,
    training_path,
    write_result,
)
from annotations.learning.experiments.experiment_tables import ExperimentTable
from annotations.learning.experiments.experiments import Experiment, ExperimentRow, ExperimentSize
from annotations.learning.losses.objective import objective_of
from annotations.learning.training.processor import chosen_device
from annotations.learning.training.training import Training
from annotations.learning.training.validation import validate
from annotations.prediction.errors.prediction_errors import error_figures
from annotations.synthesis.conditions import PLAIN_CONDITIONS

_STAND_IN_SERIES = 3_000_000


@dataclass(frozen=True, eq=False)
class ExperimentData:
    """The annotated volumes of an experiment.

    Attributes
    ----------
    examples : AnnotatedExamples
    description : DataDescription
    """

    examples: AnnotatedExamples
    description: DataDescription


def experiment_data(
    studies: Sequence[FoundStudy],
    tool: ToolSpecification,
    comparison: Experiment,
    size: ExperimentSize,
    say: Callable[[str], None] = lambda _line: None,
    stopped: Callable[[], bool] = lambda: False,
) -> ExperimentData:
    """Sample the annotated volumes of studies, or make synthetic ones that stand in for them.

    Those that stand in show the whole tool and nothing else, as the real volumes of the publication did.

    Parameters
    ----------
    studies : sequence of FoundStudy
        None for volumes that stand in.
    tool : ToolSpecification
    comparison : Experiment
    size : ExperimentSize
    say, stopped : callable, optional
        Told what is read; asked whether to stop.

    Raises
    ------
    UserError
        No volume has an annotation, or one cannot be read; or the tool does not fit into the workspace.
    Cancelled
        `stopped` returned true.
    """
    settings = comparison.rows[0].settings
    if studies:
        examples = annotated_examples(studies, settings.sampling, settings.annotated, say, stopped)
    else:
        seed = _STAND_IN_SERIES + settings.seed
        series = SyntheticSeries(tool, settings.sampling, seed, PLAIN_CONDITIONS)
        say(f"making {size.training + size.validation} synthetic volumes that stand in for annotated ones")
        made = tuple(series.example(number) for number in range(size.training + size.validation))
        examples = AnnotatedExamples(
            made[: size.training], made[size.training :], fingerprint=f"synthetic series {seed}"
        )
    return ExperimentData(
        examples,
        DataDescription(
            studies=examples.studies,
            fingerprint=examples.fingerprint,
            tool=f"{tool.name} {tool.fingerprint}",
            training=len(examples.training),
            validation=len(examples.validation),
        ),
    )


def run_experiment(
    comparison: Experiment,
    size: ExperimentSize,
    data: ExperimentData,
    tool: ToolSpecification,
    folder: Path,
    say: Callable[[str], None] = lambda _line: None,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[Path, ...] | None:
    """Train every row that is not done yet, and write the tables after each.

    Parameters
    ----------
    comparison : Experiment
    size : ExperimentSize
    data : ExperimentData
    tool : ToolSpecification
    folder : Path
        Of the tables. Its folder ``trainings`` keeps the result and the training of each row.
    say : callable, optional
        Told one line at a time how it goes.
    stopped : callable, optional
        Asked after every step whether to stop.

    Returns
    -------
    tuple of Path or None
        The tables; None where it was stopped: the same call goes on from there.

    Raises
    ------
    UserError
        There is a result of other settings or data, or a training has come apart.
    SaveError
        Something cannot be written.
    """
    results = {
        row.key: result
        for row in comparison.rows
        if (result := read_result(folder, row, data.description)) is not None
    }
    angles = [f"{angle.name}_deg" for angle in tool.targets.angles]
    table = ExperimentTable(
        comparison, size, data.description, ("position_mm", "orientation_deg", *angles), results
    )
    written = table.write(folder)
    for number, row in enumerate(comparison.rows, 1):
        said = f"{number} of {len(comparison.rows)}, {row.label}"
        if row.key in results:
            say(f"{said}: done before")
            continue
        say(said)
        result = _trained(row, data, tool, folder, say, stopped)
        if result is None:
            return None
        write_result(folder, row, result)
        results[row.key] = result
        written = table.write(folder)
    return written


def _trained(
    row: ExperimentRow,
    data: ExperimentData,
    tool: ToolSpecification,
    folder: Path,
    say: Callable[[str], None],
    stopped: Callable[[], bool],
) -> RowResult | None:
    training = Training(row.settings, tool, data.examples, training_path(folder, row), say)
    if not training.run(stopped):
        return None
    # Not with the weights of the best epoch: that one would be chosen by the volumes that judge it.
    device = chosen_device(row.settings.device)
    errors = validate(
        training.network.eval(),
        objective_of(row.settings, tool, device),
        tool,
        data.examples.validation,
        row.settings.optimization.batch,
    )
    keypoints_mm = None
    if errors.keypoints_mm is not None:
        known = errors.keypoints_mm[~np.isnan(errors.keypoints_mm)]
        keypoints_mm = error_figures(known, np.isinf(known))
    return RowResult(
        key=row.key,
        settings=row.settings.as_toml(),
        data=data.description,
        parameters=parameter_count(training.network),
        synthetic_volumes=training.progress.synthetic_volumes,
        epochs=row.settings.annotated.epochs,
        seconds=round(training.progress.seconds, 1),
        device=device.type,
        targets={name: error_figures(values, np.isnan(values)) for name, values in errors.targets.items()},
        keypoints_mm=keypoints_mm,
        far_share=errors.far_share,
        created=now(),
    )
