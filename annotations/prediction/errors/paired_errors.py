"""Several checkpoints on the same volumes: the errors of each, and how they differ from the first one."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.intervals import estimate
from annotations.agreement.method_comparison import paired_test
from annotations.agreement.results import Estimate, PairedTest
from annotations.documents.record import Record
from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable, UnjudgedVolume
from annotations.prediction.prediction import CheckpointReference

Array = NDArray[np.float64]


class PairedFigure(Record):
    """One kind of error of several checkpoints, over the volumes in which all of them have it.

    Attributes
    ----------
    errors : tuple of Estimate
        Of each checkpoint, over the same ``n`` volumes.
    differences : tuple of PairedTest
        Of each checkpoint but the first: its error minus the first one's, in the same volume. Below zero it
        is the nearer one.
    absent : tuple of int
        In how many volumes each checkpoint does not have it though another one has: they are left out for
        all.
    """

    errors: tuple[Estimate, ...]
    differences: tuple[PairedTest, ...]
    absent: tuple[int, ...]


class PairedOverview(Record):
    """All kinds of errors, by one of the two ways.

    Attributes
    ----------
    targets : mapping of str to PairedFigure
        By ``position_mm``, ``orientation_deg`` and ``<angle>_deg``.
    keypoints_um : mapping of str to PairedFigure
        Distance of each keypoint.
    mean_keypoint_um : PairedFigure
        Mean distance of those keypoints of a volume that all checkpoints have: else one that does not find
        the difficult ones would look better for it.
    """

    targets: Mapping[str, PairedFigure] = {}
    keypoints_um: Mapping[str, PairedFigure] = {}
    mean_keypoint_um: PairedFigure


class PairedErrors(Record):
    """Several checkpoints beside each other.

    Attributes
    ----------
    checkpoints : tuple of CheckpointReference
        The first is the one that the others are compared with.
    volumes : tuple of str
        Those that are compared: all checkpoints are judged on them, by the same annotation.
    left_out : tuple of UnjudgedVolume
        The other volumes on which one of them is judged, and why they are not compared.
    by_formulas, by_fit : PairedOverview
        Of the predicted keypoints by the published formulas, and of the fitted pose's.
    """

    checkpoints: tuple[CheckpointReference, ...]
    volumes: tuple[str, ...]
    left_out: tuple[UnjudgedVolume, ...] = ()
    by_formulas: PairedOverview
    by_fit: PairedOverview


def paired_errors(tables: Sequence[ErrorTable]) -> PairedErrors:
    """Compare checkpoints on the volumes that all of them were judged on, by the same annotation.

    Parameters
    ----------
    tables : sequence of ErrorTable
        One a checkpoint, of the same study; those without a row are passed over.

    Notes
    -----
    Differences are per volume, so that a hard volume counts against all alike. The intervals are those of
    `annotations.agreement.intervals.mean_ci95`, the tests those of
    `annotations.agreement.method_comparison.paired_test`. They are not corrected for how many are shown.
    """
    judged = [(table, table.checkpoint) for table in tables]
    present = [(table, checkpoint) for table, checkpoint in judged if checkpoint is not None]
    rows_of = [{row.volume: row for row in table.independent_rows} for table, _ in present]
    every = tuple(dict.fromkeys(row.volume for table, _ in present for row in table.rows))
    reasons = {volume: _why_not(volume, present, rows_of) for volume in every}
    volumes = tuple(volume for volume, reason in reasons.items() if not reason)
    rows = [[of_checkpoint[volume] for volume in volumes] for of_checkpoint in rows_of]
    return PairedErrors(
        checkpoints=tuple(checkpoint for _, checkpoint in present),
        volumes=volumes,
        left_out=tuple(
            UnjudgedVolume(volume=volume, reason=reason) for volume, reason in reasons.items() if reason
        ),
        by_formulas=_overview(
            len(rows),
            _by_name([[row.targets for row in of_checkpoint] for of_checkpoint in rows]),
            _by_name([[row.keypoints_um for row in of_checkpoint] for of_checkpoint in rows]),
        ),
        by_fit=_overview(
            len(rows),
            _by_name([[row.targets_by_fit for row in of_checkpoint] for of_checkpoint in rows]),
            _by_name([[row.keypoints_by_fit_um for row in of_checkpoint] for of_checkpoint in rows]),
        ),
    )


def _why_not(
    volume: str,
    present: Sequence[tuple[ErrorTable, CheckpointReference]],
    rows_of: Sequence[Mapping[str, ErrorsOfVolume]],
) -> str:
    """Return why a volume is not compared; empty where it is."""
    for (table, checkpoint), rows in zip(present, rows_of, strict=True):
        if any(row.volume == volume and row.begun_from for row in table.rows):
            return "its annotation was begun from a prediction"
        if volume not in rows:
            known = next((each.reason for each in table.unjudged if each.volume == volume), "")
            return f"{checkpoint.name} is not judged on it" + (f": {known}" if known else "")
    truths = {(rows[volume].whose, rows[volume].annotation_sha256) for rows in rows_of}
    return "the checkpoints were held against different annotations of it" if len(truths) > 1 else ""


def _by_name(errors: Sequence[Sequence[Mapping[str, float]]]) -> Mapping[str, Array]:
    """Return errors by name, each (C, V), of those that C checkpoints have in V volumes; NaN for none."""
    names = dict.fromkeys(name for of_one in errors for of_volume in of_one for name in of_volume)
    return {
        name: np.array([[of_volume.get(name, np.nan) for of_volume in of_one] for of_one in errors])
        for name in names
    }


def _overview(
    checkpoints: int, targets: Mapping[str, Array], keypoints_um: Mapping[str, Array]
) -> PairedOverview:
    return PairedOverview(
        targets={name: _figure(errors) for name, errors in targets.items()},
        keypoints_um={name: _figure(errors) for name, errors in keypoints_um.items()},
        mean_keypoint_um=_figure(_mean_of_common(list(keypoints_um.values())))
        if keypoints_um
        else _figure(np.zeros((checkpoints, 0))),
    )


def _mean_of_common(distances_um: Sequence[Array]) -> Array:
    """Return mean distances, (C, V), over the keypoints, each (C, V), that all checkpoints have in a volume.

    NaN for all of them in a volume in which there is no such keypoint.
    """
    each_um = np.array(distances_um)
    is_common = np.isfinite(each_um).all(axis=1, keepdims=True)
    count = is_common.sum(axis=0)
    total_um = np.where(is_common, each_um, 0.0).sum(axis=0)
    mean_um: Array = np.where(count > 0, total_um, np.nan) / np.maximum(count, 1)
    return mean_um


def _figure(errors: Array) -> PairedFigure:
    """Return the figure of errors of shape (C, V)."""
    is_known = np.isfinite(errors)
    compared = errors[:, is_known.all(axis=0)]
    return PairedFigure(
        errors=tuple(estimate(of_one) for of_one in compared),
        differences=tuple(paired_test(of_one - compared[0]) for of_one in compared[1:]),
        absent=tuple(int(count) for count in (is_known.any(axis=0) & ~is_known).sum(axis=1)),
    )
