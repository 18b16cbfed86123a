"""The prediction document: what one checkpoint says of one volume. Frozen, and made anew, never edited."""

from collections.abc import Callable, Mapping
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from annotations import __version__
from annotations.documents.annotation import (
    PositionUm,
    VolumeReference,
    check_position,
    check_tool_copy,
    refuse_repeats,
)
from annotations.documents.files import ships
from annotations.documents.record import Moment, Record, UsablePath, now
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.rotations import Quaternion, quaternion
from annotations.geometry.tool import Finite, NonNegative, ToolSpecification
from annotations.prediction.predicted_pose import PredictedPose
from annotations.prediction.predictor import PredictedKeypoints

SCHEMA: Literal["oct-prediction/1"] = "oct-prediction/1"

PredictedState = Literal["placed", "out_of_view", "unplaced"]

_Share = Annotated[Finite, Field(ge=0, le=1)]


class CheckpointReference(Record):
    """The checkpoint that predicted.

    Attributes
    ----------
    name : str
    sha256 : str
        Of its file, by which it is known.
    path : str or None
        Where it was, relative to the prediction's folder where possible, with forward slashes; None for one
        that ships with the program.
    """

    name: Annotated[str, Field(min_length=1, max_length=200)]
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    path: UsablePath | None = None


class Confidence(Record):
    """How sure a network is of a keypoint; see `PredictedKeypoints`.

    Attributes
    ----------
    peak : float
        Of the heatmap.
    presence : float
        That the keypoint is within the range of the network's input, 0 to 1.
    spread_um : (float, float, float)
        Standard deviation of the heatmap along axes 0, 1, 2.
    """

    peak: Finite
    presence: _Share
    spread_um: tuple[NonNegative, NonNegative, NonNegative]


class PredictedKeypoint(Record):
    """One predicted keypoint.

    Attributes
    ----------
    name : str
    state : str
        ``placed``: in the volume; ``out_of_view``: outside of it; ``unplaced``: beyond the range of the
        network's input, or seen nowhere.
    position_um : (float, float, float) or None
        In the volume's frame; None for the state ``unplaced`` and for no other.
    source : str or None
        ``predicted`` where there is a position, as in an annotation.
    confidence : Confidence
    """

    name: str
    state: PredictedState
    position_um: PositionUm | None = None
    source: Literal["predicted"] | None = None
    confidence: Confidence

    @model_validator(mode="after")
    def _check_position(self) -> Self:
        check_position(self.name, self.state, self.position_um, self.source)
        return self


class FittedPose(Record):
    """The pose of the tool that fits the predicted keypoints, and what they tell of it.

    Attributes
    ----------
    position_um : (float, float, float)
        Middle of the root link's axis in the volume's frame.
    rotation_wxyz : (float, float, float, float)
        Of the root link, a unit quaternion with w ≥ 0.
    angles_deg : mapping of str to float
        Signed angle of each joint that the keypoints tell.
    open : tuple of str
        What they do not tell, named as in `ToolFit.open_parameters`: there the pose is one of many.
    keypoints_um : mapping of str to (float, float, float)
        Where the pose puts those keypoints of which it tells the place.
    rms_um : float
        Root of the mean square by which the keypoints that count are off the pose.
    left_out : tuple of str
        Keypoints that do not count: the tool cannot have them where they were predicted.
    """

    position_um: PositionUm
    rotation_wxyz: Annotated[Quaternion, AfterValidator(quaternion)]
    angles_deg: Mapping[str, Finite] = {}
    open: tuple[str, ...] = ()
    keypoints_um: Mapping[str, PositionUm] = {}
    rms_um: NonNegative
    left_out: tuple[str, ...] = ()

    @property
    def tool_pose(self) -> ToolPose:
        """The pose itself; a joint that the keypoints do not tell is straight."""
        return ToolPose(self.position_um, self.rotation_wxyz, self.angles_deg)


def _each_once(keypoints: tuple[PredictedKeypoint, ...]) -> tuple[PredictedKeypoint, ...]:
    refuse_repeats("keypoint", [keypoint.name for keypoint in keypoints])
    return keypoints


class Prediction(Record):
    """What a checkpoint says of a volume.

    Attributes
    ----------
    volume : VolumeReference
        As in an annotation.
    tool, tool_fingerprint, tool_copy
        The checkpoint's tool, as in an annotation.
    checkpoint : CheckpointReference
    keypoints : tuple of PredictedKeypoint
        Those that the checkpoint knows, in its order.
    pose : FittedPose or None
        None where the keypoints do not tell the direction of any link.
    created : datetime
        UTC.
    program : str
        Version of the program that made it.
    """

    schema_id: Literal["oct-prediction/1"] = Field(default=SCHEMA, alias="schema")
    volume: VolumeReference
    tool: str
    tool_fingerprint: str | None = None
    tool_copy: ToolSpecification | None = None
    checkpoint: CheckpointReference
    keypoints: Annotated[tuple[PredictedKeypoint, ...], AfterValidator(_each_once)]
    pose: FittedPose | None = None
    created: Moment
    program: str = __version__

    @model_validator(mode="after")
    def _check_tool(self) -> Self:
        check_tool_copy(self.tool, self.tool_fingerprint, self.tool_copy)
        return self

    @property
    def positions_um(self) -> Mapping[str, Vector]:
        """Positions in µm of the keypoints that have one, by name."""
        return {
            keypoint.name: keypoint.position_um
            for keypoint in self.keypoints
            if keypoint.position_um is not None
        }

    def is_of(self, checkpoint_sha256: str, volume_fingerprint: str) -> bool:
        """Say whether the same checkpoint would say the same again of the same volume."""
        return (self.checkpoint.sha256, self.volume.fingerprint) == (checkpoint_sha256, volume_fingerprint)


def prediction_of(
    predicted: PredictedKeypoints,
    pose: PredictedPose | None,
    volume: VolumeReference,
    checkpoint: CheckpointReference,
    tool: ToolSpecification,
) -> Prediction:
    """Return the document of what was predicted, and of the fit to it."""
    return Prediction(
        volume=volume,
        tool=tool.name,
        tool_fingerprint=tool.fingerprint,
        tool_copy=None if ships(tool) else tool,
        checkpoint=checkpoint,
        keypoints=keypoints_of(predicted, volume.contains),
        pose=None if pose is None else fitted_pose(pose),
        created=now(),
    )


def keypoints_of(
    predicted: PredictedKeypoints, is_inside: Callable[[Vector], bool]
) -> tuple[PredictedKeypoint, ...]:
    """Return what a document keeps of predicted keypoints, given which positions in µm are in the volume."""
    return tuple(_keypoint(predicted, number, is_inside) for number in range(len(predicted.names)))


def _keypoint(
    predicted: PredictedKeypoints, number: int, is_inside: Callable[[Vector], bool]
) -> PredictedKeypoint:
    name = predicted.names[number]
    position_um = predicted.by_name.get(name)
    confidence = Confidence(
        peak=float(predicted.peak[number]),
        presence=float(predicted.presence[number]),
        spread_um=vector(predicted.spread_um[number]),
    )
    if position_um is None:
        return PredictedKeypoint(name=name, state="unplaced", confidence=confidence)
    state: PredictedState = "placed" if is_inside(position_um) else "out_of_view"
    return PredictedKeypoint(
        name=name, state=state, position_um=position_um, source="predicted", confidence=confidence
    )


def fitted_pose(pose: PredictedPose) -> FittedPose:
    """Return what a document keeps of the fit to predicted keypoints."""
    fit = pose.fit
    return FittedPose(
        position_um=fit.pose.position_um,
        rotation_wxyz=fit.pose.rotation_wxyz,
        angles_deg={
            name: angle_deg
            for name, angle_deg in fit.pose.angles_deg.items()
            if f"{name}_deg" not in fit.open_parameters
        },
        open=fit.open_parameters,
        keypoints_um=pose.keypoints_um,
        rms_um=fit.rms_um,
        left_out=pose.left_out,
    )
