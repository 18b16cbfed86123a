"""The fit in words: what it found, and what the data leave open."""

import re

import pytest

from annotations.fitting.evidence import BodyPoint
from annotations.fitting.pose_fit import fit_points
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotations.geometry.tool_library import find_tool
from annotator.panels.annotation.fit_readout import FitReadout, fit_readout

FORCEPS = find_tool("magnetic-forceps")


def readout_of(theta1_deg: float, theta2_deg: float, *absent: str, roll_deg: float = 30.0) -> FitReadout:
    pose = ToolPose(
        (3000.0, 4000.0, 2000.0),
        from_yaw_pitch_roll(20.0, 10.0, roll_deg),
        {"theta1": theta1_deg, "theta2": theta2_deg},
    )
    points = []
    for name, position_um in keypoints_um(pose, FORCEPS).items():
        link = FORCEPS.link_of(name)
        assert link is not None
        if name not in absent:
            along_um = 0.0 if name == link.base else link.length_um
            points.append(BodyPoint(link.name, (along_um, 0.0, 0.0), position_um, keypoint=name))
    fit = fit_points(points, FORCEPS)
    assert fit is not None
    return fit_readout(fit, FORCEPS)


def texts(readout: FitReadout) -> dict[str, str]:
    return {line.name: line.text.replace("\N{NO-BREAK SPACE}", " ") for line in readout.lines}


def test_a_bent_tool_has_signed_angles_and_a_roll_with_their_deviations() -> None:
    found = texts(readout_of(-32.1, 25.0))
    assert re.fullmatch(r"−32\.1°  ± 0\.\d°", found["fit_theta1"])
    assert re.fullmatch(r"\+25\.0°  ± \d\.\d°", found["fit_theta2"])
    assert re.fullmatch(r"\+30\.0°  ± \d\.\d°", found["fit_roll"])
    assert found["fit_rms"] == "0 µm rms of 6 keypoints"
    assert readout_of(-32.1, 25.0).remarks == ()


def test_a_closed_link_leaves_both_senses_open_and_offers_the_other() -> None:
    readout = readout_of(32.1, 0.0)
    found = texts(readout)
    assert re.fullmatch(r"[+−]32\.1° or [+−]32\.1°  ± 0\.\d°", found["fit_theta1"])
    assert " or " in found["fit_roll"]
    first, other = re.findall(r"[+−]32\.1°", found["fit_theta1"])
    assert first != other
    assert readout.others == (f"θ1 = {other}",)
    assert any("senses" in remark and "θ1" in remark for remark in readout.remarks)


def test_what_is_not_seen_is_open() -> None:
    readout = readout_of(32.1, 25.0, "k4", "k5")
    lines = {line.name: line for line in readout.lines}
    assert (lines["fit_theta2"].text, lines["fit_theta2"].is_known) == ("open", False)
    assert lines["fit_theta1"].is_known
    assert any("θ2 is open" in remark for remark in readout.remarks)


def test_the_roll_of_a_straight_tool_is_never_invented() -> None:
    readout = readout_of(0.0, 0.0)
    lines = {line.name: line for line in readout.lines}
    assert (lines["fit_roll"].text, lines["fit_roll"].is_known) == ("open", False)
    assert any("roll" in remark for remark in readout.remarks)


def test_a_joint_at_its_limit_is_named() -> None:
    assert readout_of(95.0, 25.0).remarks == ("θ1 is held at its limit of +90°.",)


@pytest.mark.parametrize("theta1_deg", [-50.0, 50.0])
def test_every_fit_has_the_same_rows(theta1_deg: float) -> None:
    rows = [line.name for line in readout_of(theta1_deg, 0.0, "k5").lines]
    assert rows == ["fit_rms", "fit_theta1", "fit_theta2", "fit_roll"]
