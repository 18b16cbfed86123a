"""The results of an experiment's trainings, and the files that hold them. Needs no torch."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from pydantic import Field

from annotations import __version__
from annotations.documents.files import DocumentFile, document_bytes
from annotations.documents.record import Moment, Record
from annotations.durable_files import replace_durably
from annotations.errors import UserError
from annotations.learning.experiments.experiments import ExperimentRow
from annotations.prediction.errors.prediction_errors import ErrorFigures

SCHEMA: Literal["oct-experiment-row/1"] = "oct-experiment-row/1"

_TRAININGS = "trainings"


class DataDescription(Record):
    """The volumes that all rows of an experiment are trained on and judged by.

    Attributes
    ----------
    studies : tuple of str
        Titles; empty where synthetic volumes stand in for annotated ones.
    fingerprint : str
        Of the annotations and their split, or of how the volumes that stand in are made.
    tool : str
    training, validation : int
        How many volumes.
    """

    studies: tuple[str, ...] = ()
    fingerprint: str
    tool: str
    training: int
    validation: int

    @property
    def in_words(self) -> str:
        """What they are, as a sentence for a caption."""
        counts = f"{self.training} volumes for training, {self.validation} for validation"
        if self.studies:
            return f"Annotated volumes of {', '.join(self.studies)}: {counts}."
        return (
            f"Synthetic volumes stand in for annotated real ones: {counts}. The whole tool is in view and "
            "nothing else. Those of the pre-training come from the same program, so that what it gains here "
            "says little of real volumes."
        )


class RowResult(Record):
    """What came of one training.

    Attributes
    ----------
    key : str
        Of the row.
    settings : str
        Of the training, as TOML.
    data : DataDescription
    parameters : int
        How many numbers were learned.
    synthetic_volumes : int
        Of the pre-training.
    epochs : int
        Over the annotated volumes.
    seconds : float
        Wall-clock time of all of it.
    device : str
    targets : mapping of str to ErrorFigures
        Errors on the validation volumes after the last epoch, by the published formulas.
    keypoints_mm : ErrorFigures or None
        Of all keypoints together; None of a network that does not tell them.
    far_share : float or None
        Of the keypoints, which share is more than 2 mm off, or not found.
    """

    schema_id: Literal["oct-experiment-row/1"] = Field(default=SCHEMA, alias="schema")
    key: str
    settings: str
    data: DataDescription
    parameters: int
    synthetic_volumes: int
    epochs: int
    seconds: float
    device: str
    targets: Mapping[str, ErrorFigures]
    keypoints_mm: ErrorFigures | None = None
    far_share: float | None = None
    created: Moment
    program: str = __version__


_ROW_FILE = DocumentFile(
    RowResult, SCHEMA, "a result of an experiment", "Delete it; the same command trains that network again"
)


def training_path(folder: Path, row: ExperimentRow) -> Path:
    """Return the path beside which a row's training keeps its files, in an experiment's folder."""
    return folder / _TRAININGS / row.key


def read_result(folder: Path, row: ExperimentRow, data: DataDescription) -> RowResult | None:
    """Return the result of a row that is done, else None.

    Raises
    ------
    UserError
        What is there is no result, or one of other settings or data.
    """
    path = _result_path(folder, row)
    if not path.exists():
        return None
    result = _ROW_FILE.parse(_ROW_FILE.read(path), path)
    if (result.settings, result.data) != (row.settings.as_toml(), data):
        raise UserError(
            "there is a result of this row by other settings, or of other volumes",
            where=path,
            remedy="Give the size, volumes, epochs and seed that it was begun with, or another folder",
        )
    return result


def write_result(folder: Path, row: ExperimentRow, result: RowResult) -> None:
    """Keep the result of a row, atomically; SaveError where that is not possible."""
    fields = result.model_dump(mode="json", exclude_none=True)
    replace_durably(_result_path(folder, row), document_bytes(fields))


def _result_path(folder: Path, row: ExperimentRow) -> Path:
    path = training_path(folder, row)
    return path.with_name(path.name + ".json")
