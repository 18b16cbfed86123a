"""What the fit of the tool says, in words: how well it fits, how the joints stand, and what stays open."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from annotations.fitting.pose_fit import ToolFit
from annotations.geometry import rotations
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool import ToolSpecification
from annotator.looks.angles import angle_title, signed_text
from annotator.panels.annotation.pose_readout import with_titles
from annotator.panels.widgets.readings_grid import Line

# Solutions that differ by less in a quantity are one to a reader.
_SAME_DEG = 1.0


@dataclass(frozen=True)
class FitReadout:
    """Everything that the section of the fit shows.

    Attributes
    ----------
    lines : tuple of Line
        The residual, every joint and the roll; the same rows for every fit of a tool.
    remarks : tuple of str
        What the data leave open, and which joints are held at a limit, in whole sentences.
    others : tuple of str
        The other solutions, by what tells them from the fit: ``θ1 = −32.1°, roll = 170.0°``.
    """

    lines: tuple[Line, ...]
    remarks: tuple[str, ...]
    others: tuple[str, ...]


def fit_readout(fit: ToolFit, tool: ToolSpecification) -> FitReadout:
    """Say what a fit of the tool found."""
    poses = (fit.pose, *fit.alternatives)
    lines = [_residual(fit)]
    for joint in tool.joints:
        name = joint.name
        lines.append(_angle(fit, f"{name}_deg", f"fit_{name}", angle_title(name), _bends_deg(name, poses)))
    lines.append(_angle(fit, "rotation_x_deg", "fit_roll", "Roll", [_roll_deg(pose) for pose in poses]))
    remarks = [*(question.text for question in fit.open_questions), *_of_limits(fit, tool)]
    return FitReadout(
        tuple(lines),
        tuple(with_titles(text, tool) for text in remarks),
        tuple(_difference(fit.pose, other, tool) for other in fit.alternatives),
    )


def _residual(fit: ToolFit) -> Line:
    count = len(fit.residuals_um)
    keypoints = f"{count} keypoint{'' if count == 1 else 's'}"
    return Line("fit_rms", "Residual", f"{fit.rms_um:.0f} µm rms of {keypoints}")


def _angle(fit: ToolFit, parameter: str, name: str, title: str, values_deg: Sequence[float]) -> Line:
    if parameter not in fit.parameters:
        return Line(name, title, "open", is_known=False)
    told: list[float] = []
    for value_deg in values_deg:
        if all(abs((value_deg - each + 180) % 360 - 180) > _SAME_DEG for each in told):
            told.append(value_deg)
    either = " or ".join(signed_text(value_deg, 1) for value_deg in told)
    return Line(name, title, f"{either}  ±\N{NO-BREAK SPACE}{fit.standard_deviations[parameter]:.1f}°")


def _of_limits(fit: ToolFit, tool: ToolSpecification) -> Iterator[str]:
    for joint in tool.joints:
        if joint.name in fit.limits_reached:
            at_deg = fit.pose.angles_deg[joint.name]
            limit_deg = min(joint.limits_deg, key=lambda limit: abs(limit - at_deg))
            yield f"{joint.name} is held at its limit of {signed_text(limit_deg, 0)}."


def _difference(pose: ToolPose, other: ToolPose, tool: ToolSpecification) -> str:
    differences = [
        f"{angle_title(joint.name)} = {signed_text(other.angles_deg[joint.name], 1)}"
        for joint in tool.joints
        if abs(other.angles_deg[joint.name] - pose.angles_deg[joint.name]) > _SAME_DEG
    ]
    return ", ".join(differences or [f"roll = {signed_text(_roll_deg(other), 1)}"])


def _bends_deg(joint: str, poses: Sequence[ToolPose]) -> list[float]:
    return [pose.angles_deg[joint] for pose in poses]


def _roll_deg(pose: ToolPose) -> float:
    return rotations.yaw_pitch_roll_deg(pose.rotation_wxyz)[2]
