"""The tables of an experiment in the published layout, mean ± standard deviation. Needs no torch."""

import csv
import io
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from annotations import __version__
from annotations.agreement.report.labels import NOTHING
from annotations.documents.files import document_bytes
from annotations.durable_files import replace_durably
from annotations.learning.experiments.experiment_results import DataDescription, RowResult
from annotations.learning.experiments.experiments import Experiment, ExperimentRow, ExperimentSize
from annotations.prediction.errors.error_text import column_title, decimals_of, mean_and_deviation
from annotations.prediction.errors.prediction_errors import ErrorFigures

SCHEMA = "oct-experiment/1"

_CAPTION = (
    "Errors on the validation volumes after the last epoch, mean ± standard deviation over them. Published: "
    "152 real volumes for training, 40 for validation."
)
_STATISTICS = ("mean", "sd", "median", "p95", "n", "missing")


@dataclass(frozen=True)
class ExperimentTable:
    """What is known of an experiment by now.

    Attributes
    ----------
    experiment : Experiment
    size : ExperimentSize
    data : DataDescription
    targets : tuple of str
        ``position_mm``, ``orientation_deg`` and ``<angle>_deg``, those that the tool has.
    results : mapping of str to RowResult
        By the row's key; rows that are not done are absent.
    """

    experiment: Experiment
    size: ExperimentSize
    data: DataDescription
    targets: tuple[str, ...]
    results: Mapping[str, RowResult]

    def write(self, folder: Path) -> tuple[Path, ...]:
        """Write the table as Markdown, CSV and JSON; SaveError where that is not possible."""
        name = self.experiment.name
        contents = {
            f"{name}.md": self.as_markdown().encode(),
            f"{name}.csv": self.as_csv().encode(),
            f"{name}.json": document_bytes(self.as_fields()),
        }
        for file, content in contents.items():
            replace_durably(folder / file, content)
        return tuple(folder / file for file in contents)

    def as_markdown(self) -> str:
        """Return the table for a person: below each row the published one, then the settings of each."""
        lines = [
            f"# {self.experiment.title}",
            "",
            _CAPTION,
            "",
            self.data.in_words,
            "",
            self.size.in_words,
            "",
            *_markdown(["", *map(column_title, self.targets), "keypoints over 2 mm"], self._error_rows()),
            "",
            "Settings:",
            "",
            *_markdown(_SETTINGS, self._setting_rows()),
        ]
        return "\n".join(lines) + "\n"

    def as_csv(self) -> str:
        """Return the table for programs: one row a run."""
        stream = io.StringIO()
        rows = [self._csv_row(row) for row in self.experiment.rows]
        writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return stream.getvalue()

    def as_fields(self) -> dict[str, Any]:
        """Return everything, for JSON."""
        return {
            "schema": SCHEMA,
            "experiment": self.experiment.name,
            "title": self.experiment.title,
            "size": self.size.name,
            "caption": f"{self.data.in_words} {self.size.in_words}",
            "rows": [
                {
                    "key": row.key,
                    "label": row.label,
                    "published": None
                    if row.published is None
                    else {name: list(pair) for name, pair in row.published.targets.items()},
                    "result": None
                    if (result := self.results.get(row.key)) is None
                    else result.model_dump(mode="json", exclude_none=True),
                }
                for row in self.experiment.rows
            ],
            "program": __version__,
        }

    def _error_rows(self) -> Iterator[Sequence[str]]:
        for row in self.experiment.rows:
            result = self.results.get(row.key)
            if result is None:
                yield [f"{row.label} (not done)", *[NOTHING] * len(self.targets), NOTHING]
            else:
                cells = [_cell(result.targets.get(name), name) for name in self.targets]
                far = NOTHING if result.far_share is None else f"{result.far_share:.1%}"
                yield [row.label, *cells, far]
            if row.published is not None:
                said = row.published.targets
                yield ["*published*", *(_published(said.get(name), name) for name in self.targets), ""]

    def _setting_rows(self) -> Iterator[Sequence[str]]:
        for row in self.experiment.rows:
            settings, result = row.settings, self.results.get(row.key)
            how = settings.optimization
            yield [
                row.label,
                settings.network.kind,
                NOTHING if result is None else f"{result.parameters:,}",
                f"{settings.synthetic.volumes:,}",
                f"{settings.annotated.epochs:,}",
                f"{how.batch}",
                f"{how.learning_rate:g}",
                f"{how.weight_decay:g}",
                f"{settings.network.dropout:g}",
                _heatmaps(row),
                f"{settings.seed}",
                NOTHING if result is None else f"{result.seconds:,.0f}",
                NOTHING if result is None else result.device,
            ]

    def _csv_row(self, row: ExperimentRow) -> dict[str, object]:
        result, published = self.results.get(row.key), row.published
        fields: dict[str, object] = {"key": row.key, "label": row.label, "done": result is not None}
        for name in self.targets:
            figures = ErrorFigures() if result is None else result.targets.get(name, ErrorFigures())
            fields |= {f"{name}_{statistic}": getattr(figures, statistic) for statistic in _STATISTICS}
            said = None if published is None else published.targets.get(name)
            fields |= {
                f"published_{name}_mean": None if said is None else said[0],
                f"published_{name}_sd": None if said is None else said[1],
            }
        keypoints = None if result is None else result.keypoints_mm
        fields["keypoint_mm_mean"] = None if keypoints is None else keypoints.mean
        fields["share_over_2_mm"] = None if result is None else result.far_share
        fields |= {
            "data": "; ".join(self.data.studies) or "synthetic volumes stand in",
            "training_volumes": self.data.training,
            "validation_volumes": self.data.validation,
            "parameters": None if result is None else result.parameters,
            "seconds": None if result is None else round(result.seconds, 1),
            "device": None if result is None else result.device,
            "size": self.size.name,
        }
        return fields | dict(_flat(tomllib.loads(row.settings.as_toml()), "settings."))


_SETTINGS = (
    "",
    "network",
    "parameters",
    "synthetic volumes",
    "epochs",
    "batch",
    "learning rate",
    "weight decay",
    "dropout",
    "heatmaps",
    "seed",
    "seconds",
    "device",
)


def _heatmaps(row: ExperimentRow) -> str:
    if not row.settings.gives_heatmaps:
        return NOTHING
    heatmaps, loss = row.settings.heatmaps, row.settings.loss
    sharpness = f" T = {heatmaps.temperature:g}" if heatmaps.decoding == "soft-argmax" else ""
    return f"{heatmaps.target}, {heatmaps.decoding}{sharpness}, losses {loss.heatmap:g} : {loss.coordinate:g}"


def _cell(figures: ErrorFigures | None, name: str) -> str:
    said = mean_and_deviation(figures, decimals_of(name))
    missing = 0 if figures is None else figures.missing
    # What is not found has no error: a mean over the rest alone would look too good.
    return f"{said}, not found in {missing} of {missing + figures.n}" if figures and missing else said


def _published(pair: tuple[float, float] | None, name: str) -> str:
    if pair is None:
        return NOTHING
    return f"*{pair[0]:.{decimals_of(name)}f} ± {pair[1]:.{decimals_of(name)}f}*"


def _markdown(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    return [
        f"| {' | '.join(titles)} |",
        f"|{'---|' * len(titles)}",
        *(f"| {' | '.join(row)} |" for row in rows),
    ]


def _flat(content: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, object]]:
    """Yield settings by their names, such as ``optimization.batch``."""
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, " ".join(map(str, value)) if isinstance(value, list) else value
