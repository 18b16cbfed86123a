"""The errors of one checkpoint, volume by volume and over all, beside how far people are apart themselves."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from annotations import __version__
from annotations.agreement.deviation import Deviations
from annotations.documents.record import Method, Moment, Record, now
from annotations.geometry.frames import Vector, um_to_voxel
from annotations.geometry.targets import target_arrays
from annotations.geometry.tool import ToolSpecification
from annotations.prediction.errors.circumstances import depth_um, truth_sha256, visible_share
from annotations.prediction.errors.prediction_errors import (
    ErrorFigures,
    ErrorOverview,
    PredictionErrors,
    error_figures,
    positions_array_um,
    prediction_errors,
    summarise,
)
from annotations.prediction.prediction import CheckpointReference, Prediction

SCHEMA: Literal["oct-errors/1"] = "oct-errors/1"


@dataclass(frozen=True, eq=False)
class JudgedPrediction:
    """A prediction, and what is true of its volume.

    Attributes
    ----------
    volume_id : str
    prediction : Prediction
    truth_um : mapping of str to (float, float, float)
        Position in µm of each keypoint that the truth has.
    whose : str
        Annotator who speaks for the volume.
    out_of_range : frozenset of str
        Keypoints whose true place is beyond what the checkpoint can tell; none where nobody looked.
    depth_axis : int
        Along which the light travels in the volume.
    begun_from : tuple of str
        Names of the checkpoints from whose predictions the truth was begun.
    """

    volume_id: str
    prediction: Prediction
    truth_um: Mapping[str, Vector]
    whose: str
    out_of_range: frozenset[str] = frozenset()
    depth_axis: int = 2
    begun_from: tuple[str, ...] = ()


class HumanFloor(Record):
    """How far the annotators of the same volumes are apart, over those volumes that have two of them or more.

    Shown is the published statistic, the mean distance from the mean of all. The two others are what one
    opinion is held against: the mean of several people's, or one person's; see
    `annotations.agreement.deviation`.

    Attributes
    ----------
    method : str
        By which they annotated.
    targets : mapping of str to ErrorFigures
        The published statistic, in the units of the errors.
    volumes : mapping of str to (mapping of str to float)
        The published statistic of each volume, by target.
    leave_one_out, pairwise : mapping of str to (mapping of str to float)
        Of each volume, by target: how far one person is from the mean of the others, and how far two people
        are from each other.
    annotators : tuple of str
        Who they are.
    """

    method: Method
    targets: Mapping[str, ErrorFigures] = {}
    volumes: Mapping[str, Mapping[str, float]] = {}
    leave_one_out: Mapping[str, Mapping[str, float]] = {}
    pairwise: Mapping[str, Mapping[str, float]] = {}
    annotators: tuple[str, ...] = ()


class ErrorsOfVolume(Record):
    """The errors of one prediction; a target or keypoint that cannot be compared is absent.

    Attributes
    ----------
    volume, whose : str
        The volume's id, and the annotator who speaks for it.
    targets, targets_by_fit : mapping of str to float
        By ``position_mm``, ``orientation_deg`` and ``<angle>_deg``: of the predicted keypoints by the
        published formulas, and of the keypoints of the fitted pose.
    keypoints_um, keypoints_by_fit_um : mapping of str to float
        Distance of each keypoint.
    missing : tuple of str
        Keypoints that the truth has, and the prediction has not, though the checkpoint could tell them.
    rightly_out_of_range : tuple of str
        Those that lie where it could not, and that it rightly says to be nowhere.
    out_of_view : tuple of str
        Keypoints that lie outside of the volume.
    presence : float
        Confidence in the keypoint that the network is least sure of, 0 to 1.
    spread_um : float or None
        Standard deviation of the heatmap over all three axes together, of the keypoint where that is largest;
        of those that were found. None where none was.
    residual_um : float or None
        Root mean square by which the fitted pose misses the keypoints; None where there is no pose.
    left_out : tuple of str
        Keypoints that do not count in the fit.
    true_angles_deg : mapping of str to float
        Unsigned angle of each joint, by its name, as the truth has it.
    depth_um : float or None
        Mean of the true keypoints along the axis of the light; None where the truth has none.
    visible_share : float or None
        Of the length of the true links' axes, which share lies inside the volume; None where no link has both
        ends.
    annotation_sha256 : str or None
        Of where the truth has its keypoints (`truth_sha256`).
    begun_from : tuple of str
        Names of the checkpoints from whose predictions the truth was begun. Such a truth leans towards what
        networks say, this one or another: the volume is listed, and counts in no figure.
    """

    volume: str
    whose: str
    targets: Mapping[str, float] = {}
    targets_by_fit: Mapping[str, float] = {}
    keypoints_um: Mapping[str, float] = {}
    keypoints_by_fit_um: Mapping[str, float] = {}
    missing: tuple[str, ...] = ()
    rightly_out_of_range: tuple[str, ...] = ()
    out_of_view: tuple[str, ...] = ()
    presence: float
    spread_um: float | None = None
    residual_um: float | None = None
    left_out: tuple[str, ...] = ()
    true_angles_deg: Mapping[str, float] = {}
    depth_um: float | None = None
    visible_share: float | None = None
    annotation_sha256: str | None = None
    begun_from: tuple[str, ...] = ()

    @property
    def mean_keypoint_um(self) -> float | None:
        """Mean distance of the keypoints; None where none can be compared."""
        return fmean(self.keypoints_um.values()) if self.keypoints_um else None


class UnjudgedVolume(Record):
    """A volume whose prediction has no row, and why, as a sentence without its full stop."""

    volume: str
    reason: str


class ErrorTable(Record):
    """The errors of one checkpoint.

    Attributes
    ----------
    title : str
        The study's.
    tool : str
    checkpoint : CheckpointReference or None
        None where nothing was predicted.
    rows : tuple of ErrorsOfVolume
    by_formulas, by_fit : ErrorOverview
        Over the rows whose truth is independent of networks: by the published formulas of the predicted
        keypoints, and of the fitted pose's. So are all shares.
    with_begun : ErrorOverview or None
        By the published formulas over all rows; None where every truth is independent.
    out_of_view_share : float or None
        Of the keypoints that the truth has, which share lies outside of the volume.
    missing_share : float or None
        Of the keypoints that the truth has, which share the network did not find, and should have.
    rightly_out_of_range_share : float or None
        Of these, which share lies beyond the range of the network's input, and it says so.
    human : HumanFloor or None
        Where volumes that were judged have several annotators.
    unjudged : tuple of UnjudgedVolume
    trained_on : int
        How many volumes more would belong to the part that was judged, and are left out because the network
        was trained on them.
    """

    schema_id: Literal["oct-errors/1"] = Field(default=SCHEMA, alias="schema")
    title: str
    tool: str
    checkpoint: CheckpointReference | None = None
    rows: tuple[ErrorsOfVolume, ...] = ()
    by_formulas: ErrorOverview = ErrorOverview()
    by_fit: ErrorOverview = ErrorOverview()
    with_begun: ErrorOverview | None = None
    out_of_view_share: float | None = None
    missing_share: float | None = None
    rightly_out_of_range_share: float | None = None
    human: HumanFloor | None = None
    unjudged: tuple[UnjudgedVolume, ...] = ()
    trained_on: int = 0
    created: Moment
    program: str = __version__

    @property
    def independent_rows(self) -> tuple[ErrorsOfVolume, ...]:
        """Those that count in the figures: no prediction was the start of their truth."""
        return tuple(row for row in self.rows if not row.begun_from)


def error_table(
    judged: Sequence[JudgedPrediction],
    tool: ToolSpecification,
    *,
    title: str = "",
    human: HumanFloor | None = None,
    unjudged: Sequence[UnjudgedVolume] = (),
    checkpoint: CheckpointReference | None = None,
) -> ErrorTable:
    """Return the errors of one checkpoint's predictions.

    Parameters
    ----------
    judged : sequence of JudgedPrediction
        Of one checkpoint, each of another volume.
    tool : ToolSpecification
        Names the keypoints and the targets.
    checkpoint : CheckpointReference, optional
        Which it is, where nothing was judged.
    """
    true_um = positions_array_um([each.truth_um for each in judged], tool)
    predicted_um = positions_array_um([each.prediction.positions_um for each in judged], tool)
    fitted_um = positions_array_um(
        [each.prediction.pose.keypoints_um if each.prediction.pose else {} for each in judged], tool
    )
    is_in_range = np.array(
        [[name not in each.out_of_range for name in tool.keypoint_names] for each in judged], dtype=bool
    ).reshape(true_um.shape[:2])
    by_formulas = prediction_errors(predicted_um, true_um, tool, is_in_range)
    by_fit = prediction_errors(fitted_um, true_um, tool, is_in_range)
    angles_deg = target_arrays(true_um, tool).angles_deg
    is_outside = _is_outside(true_um, judged)
    rows = tuple(
        _row(each, place, by_formulas, by_fit, angles_deg, is_outside, tool)
        for place, each in enumerate(judged)
    )
    is_independent = np.array([not each.begun_from for each in judged], dtype=bool)
    counted = [row for row in rows if not row.begun_from]
    known = sum(len(each.truth_um) for each in judged if not each.begun_from)

    def share(names: Iterable[Sequence[str]]) -> float | None:
        return sum(map(len, names)) / known if known else None

    def overview(of_each: PredictionErrors) -> ErrorOverview:
        return summarise(of_each.of_volumes(is_independent), tool)

    return ErrorTable(
        title=title,
        tool=tool.name,
        checkpoint=judged[0].prediction.checkpoint if judged else checkpoint,
        rows=rows,
        by_formulas=overview(by_formulas),
        by_fit=overview(by_fit),
        with_begun=None if is_independent.all() else summarise(by_formulas, tool),
        out_of_view_share=share(row.out_of_view for row in counted),
        missing_share=share(row.missing for row in counted),
        rightly_out_of_range_share=share(row.rightly_out_of_range for row in counted),
        human=human,
        unjudged=tuple(unjudged),
        created=now(),
    )


def human_floor(
    method: Method,
    annotators: Sequence[str],
    volumes: Sequence[str],
    apart: Mapping[str, Deviations],
) -> HumanFloor | None:
    """Return how far people are apart, of the deviations of V volumes by target, in the units of errors.

    None where no volume has two annotators.
    """
    published = {name: values.published for name, values in apart.items()}
    figures = {name: error_figures(values, np.zeros(1, dtype=bool)) for name, values in published.items()}
    if not any(each.n for each in figures.values()):
        return None

    def by_volume(values: Mapping[str, NDArray[np.float64]]) -> Mapping[str, Mapping[str, float]]:
        of_each = {
            volume: _known({name: of_target[place] for name, of_target in values.items()})
            for place, volume in enumerate(volumes)
        }
        return {volume: targets for volume, targets in of_each.items() if targets}

    return HumanFloor(
        method=method,
        targets=figures,
        volumes=by_volume(published),
        leave_one_out=by_volume({name: values.leave_one_out for name, values in apart.items()}),
        pairwise=by_volume({name: values.pairwise for name, values in apart.items()}),
        annotators=tuple(annotators),
    )


def _row(
    judged: JudgedPrediction,
    place: int,
    by_formulas: PredictionErrors,
    by_fit: PredictionErrors,
    true_angles_deg: Mapping[str, NDArray[np.float64]],
    is_outside: NDArray[np.bool_],
    tool: ToolSpecification,
) -> ErrorsOfVolume:
    prediction, names = judged.prediction, tool.keypoint_names
    spreads_um = (
        math.hypot(*each.confidence.spread_um)
        for each in prediction.keypoints
        if each.position_um is not None
    )
    return ErrorsOfVolume(
        volume=judged.volume_id,
        whose=judged.whose,
        targets=_known({name: values[place] for name, values in by_formulas.targets.items()}),
        targets_by_fit=_known({name: values[place] for name, values in by_fit.targets.items()}),
        keypoints_um=_known(dict(zip(names, by_formulas.keypoints_um[place], strict=True))),
        keypoints_by_fit_um=_known(dict(zip(names, by_fit.keypoints_um[place], strict=True))),
        missing=_chosen(names, by_formulas.keypoints_missing[place]),
        rightly_out_of_range=_chosen(names, by_formulas.keypoints_rightly_absent[place]),
        out_of_view=_chosen(names, is_outside[place]),
        presence=min((each.confidence.presence for each in prediction.keypoints), default=0.0),
        spread_um=max(spreads_um, default=None),
        residual_um=None if prediction.pose is None else prediction.pose.rms_um,
        left_out=() if prediction.pose is None else prediction.pose.left_out,
        true_angles_deg=_known({name: values[place] for name, values in true_angles_deg.items()}),
        depth_um=depth_um(judged.truth_um, judged.depth_axis),
        visible_share=visible_share(judged.truth_um, tool, prediction.volume),
        annotation_sha256=truth_sha256(judged.truth_um),
        begun_from=judged.begun_from,
    )


def _is_outside(true_um: NDArray[np.float64], judged: Sequence[JudgedPrediction]) -> NDArray[np.bool_]:
    """Return which of the true keypoints, (V, K, 3), lie outside of their volumes, (V, K), all at once."""
    shapes = np.array([each.prediction.volume.shape for each in judged], dtype=np.float64).reshape(-1, 1, 3)
    spacings_um = np.array([each.prediction.volume.spacing_um for each in judged], dtype=np.float64)
    index = um_to_voxel(true_um, spacings_um.reshape(-1, 1, 3))
    return np.asarray(((index < -0.5) | (index > shapes - 0.5)).any(axis=-1), dtype=np.bool_)


def _chosen(names: Sequence[str], is_chosen: NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(name for name, each in zip(names, is_chosen, strict=True) if each)


def _known(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items() if np.isfinite(value)}
