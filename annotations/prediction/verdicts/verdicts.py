"""Verdicts: who is wrong where a checkpoint and an annotation differ, as a reviewer says of each volume."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from annotations import __version__
from annotations.documents.annotation import refuse_repeats
from annotations.documents.record import Moment, Record, now
from annotations.geometry.tool import NonNegative
from annotations.prediction.errors.error_table import ErrorsOfVolume
from annotations.prediction.prediction import CheckpointReference

SCHEMA: Literal["oct-verdicts/1"] = "oct-verdicts/1"

Verdict = Literal["annotation_wrong", "model_wrong", "both_wrong", "neither_wrong"]
"""Who is wrong; neither, where both are as right as can be seen."""

LONGEST_NOTE = 2000

_Name = Annotated[str, Field(min_length=1, max_length=200)]
_Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class VolumeVerdict(Record):
    """What a reviewer says of one volume.

    Attributes
    ----------
    volume : str
        Its id.
    verdict : str
    note : str
        In the reviewer's words; empty for none.
    moment : datetime
        When it was given, UTC.
    annotator : str
        Whose annotation it is about.
    annotation_sha256 : str or None
        Of where that had its keypoints (`truth_sha256`), by which it is noticed that one was moved since.
    checkpoint_sha256 : str
        Of the file of the checkpoint that had predicted: another one may have the same name.
    errors : mapping of str to float
        At that time, by target: ``position_mm``, ``orientation_deg`` and ``<angle>_deg``.
    """

    volume: _Name
    verdict: Verdict
    note: Annotated[str, Field(max_length=LONGEST_NOTE)] = ""
    moment: Moment
    annotator: _Name
    annotation_sha256: _Sha256 | None = None
    checkpoint_sha256: _Sha256
    errors: Mapping[str, NonNegative] = {}


def _each_once(verdicts: tuple[VolumeVerdict, ...]) -> tuple[VolumeVerdict, ...]:
    refuse_repeats("the verdict on volume", [each.volume for each in verdicts])
    return verdicts


class VerdictList(Record):
    """What one reviewer says of what one checkpoint predicted in a study.

    Attributes
    ----------
    checkpoint : str
        Its name.
    reviewer : str
    verdicts : tuple of VolumeVerdict
        One a volume at most, in the order in which they were first given.
    program : str
        Version of the program that wrote the file.
    """

    schema_id: Literal["oct-verdicts/1"] = Field(default=SCHEMA, alias="schema")
    checkpoint: _Name
    reviewer: _Name
    verdicts: Annotated[tuple[VolumeVerdict, ...], AfterValidator(_each_once)] = ()
    program: str = __version__

    def on(self, volume: str) -> VolumeVerdict | None:
        """Return the verdict on a volume, if there is one."""
        return next((each for each in self.verdicts if each.volume == volume), None)


def verdict_on(
    row: ErrorsOfVolume, checkpoint: CheckpointReference, verdict: Verdict, note: str = ""
) -> VolumeVerdict:
    """Return a verdict, given now, on what a row of a table of errors shows."""
    return VolumeVerdict(
        volume=row.volume,
        verdict=verdict,
        note=note,
        moment=now(),
        annotator=row.whose,
        annotation_sha256=row.annotation_sha256,
        checkpoint_sha256=checkpoint.sha256,
        errors=row.targets,
    )


def is_stale(verdict: VolumeVerdict, row: ErrorsOfVolume | None, checkpoint_sha256: str) -> bool:
    """Say whether a verdict is about something else than what is there now.

    Parameters
    ----------
    verdict : VolumeVerdict
    row : ErrorsOfVolume or None
        Of the volume, as it was computed last; None where nothing speaks for the volume any more.
    checkpoint_sha256 : str
        Of the checkpoint that the row is of.

    Returns
    -------
    bool
        True where another annotation speaks for the volume, where keypoints of it were moved, or where
        another checkpoint has predicted.
    """
    if row is None or verdict.checkpoint_sha256 != checkpoint_sha256:
        return True
    seen = (verdict.annotator, verdict.annotation_sha256)
    return seen != (row.whose, row.annotation_sha256)
